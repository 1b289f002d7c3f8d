// SPDX-License-Identifier: BSD-3-Clause
// One line per layer.
#include "ledger.h"

#include "core/packet.h"
#include "link_lcm.h"

namespace outcrop {
namespace {

constexpr std::size_t kLcmHeaderBytes = 8, kUdpIpBytes = 28;

std::string layer_of(const std::uint8_t *payload, std::size_t payload_bytes)
{
    std::size_t n_bytes = 0;
    const std::uint8_t *packet = oc_link_unwrap(payload, payload_bytes, &n_bytes);
    oc_packet_head_t head;
    if (!packet || oc_packet_decode_head(packet, n_bytes, &head) != OC_OK) return "other";
    switch (head.type) {
    case OC_PACKET_VIEW:
    case OC_PACKET_RELABEL:
    case OC_PACKET_ANNOUNCE: return "view";
    case OC_PACKET_PATCH: return "patch";
    case OC_PACKET_SILHOUETTE: return "silhouette";
    case OC_PACKET_TEXTURE: return "texture";
    case OC_PACKET_OVERHEAD: return "overhead";
    case OC_PACKET_STATUS: return "status";
    case OC_PACKET_IMAGE: return "image";
    default: return "request";
    }
}

} // namespace

void Ledger::add(const std::string &channel, const std::uint8_t *payload, std::size_t payload_bytes)
{
    LedgerLine &line = lines_[layer_of(payload, payload_bytes)];
    const std::size_t bytes = payload_bytes + channel.size() + 1 + kLcmHeaderBytes;
    line.messages++;
    line.bytes += bytes;
    line.bytes_ip += bytes + kUdpIpBytes;
}

LedgerLine Ledger::total() const
{
    LedgerLine sum;
    for (const auto &[layer, line] : lines_) {
        sum.messages += line.messages;
        sum.bytes += line.bytes;
        sum.bytes_ip += line.bytes_ip;
    }
    return sum;
}

} // namespace outcrop
