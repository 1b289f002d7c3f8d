// SPDX-License-Identifier: BSD-3-Clause
// What a message costs, and that the lines add up.
#include "ledger.h"

#include <vector>

#include <gtest/gtest.h>

#include "core/packet.h"
#include "link_lcm.h"

namespace outcrop {
namespace {

std::vector<std::uint8_t> payload_of(const std::vector<std::uint8_t> &packet)
{
    std::vector<std::uint8_t> out(packet.size() + OC_LCM_PAYLOAD_BYTES);
    EXPECT_EQ(oc_link_wrap(packet.data(), packet.size(), out.data()), out.size());
    return out;
}

std::vector<std::uint8_t> announce_packet()
{
    const oc_packet_head_t head{0, 1, 2};
    const oc_announce_t announce{7, 1000};
    std::vector<std::uint8_t> out(OC_MAX_DATAGRAM_BYTES);
    std::size_t n = 0;
    EXPECT_EQ(oc_packet_encode_announce(&head, &announce, out.data(), out.size(), &n), OC_OK);
    out.resize(n);
    return out;
}

std::vector<std::uint8_t> resend_packet()
{
    const oc_packet_head_t head{0, 1, 2};
    const oc_resend_request_t request{7, 5};
    std::vector<std::uint8_t> out(OC_MAX_DATAGRAM_BYTES);
    std::size_t n = 0;
    EXPECT_EQ(oc_packet_encode_resend(&head, &request, out.data(), out.size(), &n), OC_OK);
    out.resize(n);
    return out;
}

TEST(Ledger, a_message_costs_payload_channel_and_header)
{
    Ledger ledger;
    const auto packet = announce_packet(), payload = payload_of(packet);
    ledger.add("OCD", payload.data(), payload.size());
    const LedgerLine &line = ledger.lines().at("view");
    EXPECT_EQ(line.messages, 1u);
    EXPECT_EQ(line.bytes, packet.size() + 22); // docs/protocol.md, section 1
    EXPECT_EQ(line.bytes, OC_LCM_WIRE_BYTES(packet.size(), OC_CHANNEL_DOWN));
    EXPECT_EQ(line.bytes_ip, packet.size() + 50);
}

TEST(Ledger, its_lines_add_up_to_the_total)
{
    Ledger ledger;
    const auto announce = payload_of(announce_packet()), resend = payload_of(resend_packet());
    const std::vector<std::uint8_t> garbage(100, 9);
    std::uint64_t bytes = 0;
    for (int i = 0; i < 3; i++) {
        ledger.add("OCD", announce.data(), announce.size());
        ledger.add("OCU", resend.data(), resend.size());
        bytes += announce.size() + resend.size() + 2 * 12;
    }
    ledger.add("OCD", garbage.data(), garbage.size());
    bytes += garbage.size() + 12;
    EXPECT_EQ(ledger.lines().at("view").messages, 3u);
    EXPECT_EQ(ledger.lines().at("request").messages, 3u);
    EXPECT_EQ(ledger.lines().at("other").bytes, 112u);
    EXPECT_EQ(ledger.total().messages, 7u);
    EXPECT_EQ(ledger.total().bytes, bytes);
    EXPECT_EQ(ledger.total().bytes_ip, bytes + 7 * 28);
}

} // namespace
} // namespace outcrop
