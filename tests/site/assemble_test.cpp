// SPDX-License-Identifier: BSD-3-Clause
// Packets in any order, doubled, lost, broken: the same set gives the same views.
#include "site/assemble.h"

#include <algorithm>
#include <cstring>
#include <random>

#include <gtest/gtest.h>

#include "synthetic_site.h"

namespace outcrop {
namespace {

constexpr unsigned kSeed = 5;
using Bytes = std::vector<std::uint8_t>;

class Encoder {
public:
    explicit Encoder(std::uint8_t vehicle = 1, std::uint16_t sequence = 0) : vehicle_(vehicle), sequence_(sequence) {}

    oc_packet_head_t head(std::uint8_t type) { return {type, vehicle_, sequence_++}; }

    // All parts of a view with n junctions in datagrams of `cap` bytes.
    std::vector<Bytes> view(std::uint16_t id, int n, std::size_t cap, std::int64_t utime_us = 1000000)
    {
        std::mt19937 rng(kSeed + id);
        std::uniform_real_distribution<float> uniform(0, 1);
        std::vector<oc_junction_t> junctions(static_cast<std::size_t>(n));
        for (oc_junction_t &j : junctions) {
            j.x_px = 20 + 600 * uniform(rng), j.y_px = 20 + 440 * uniform(rng);
            j.n_branches = 2;
            j.branch[0].angle_rad = 0.5f, j.branch[1].angle_rad = 2.0f;
        }
        std::vector<oc_tie_t> ties = {{static_cast<std::uint16_t>(id > 0 ? id - 1 : 7), 100, 120, 130, 140}};
        oc_view_head_t view_head{};
        view_head.view = id;
        view_head.utime_us = utime_us;
        view_head.camera = synthetic::thesis_camera(id % 8);
        view_head.margin = synthetic::margin_of(0.01, 0.0174);
        std::vector<Bytes> datagrams;
        std::uint16_t first = 0, first_tie = 0;
        for (std::uint8_t part = 0; part < 60; ++part) {
            view_head.part = part;
            Bytes buf(cap);
            std::size_t n_bytes = 0;
            std::uint16_t taken = 0, ties_taken = 0;
            const oc_packet_head_t packet = head(OC_PACKET_VIEW);
            const oc_status_t status = oc_packet_encode_view(
                &packet, &view_head, junctions.data(), static_cast<std::uint16_t>(n), first, ties.data(),
                static_cast<std::uint16_t>(ties.size()), first_tie, buf.data(), cap, &n_bytes, &taken, &ties_taken);
            EXPECT_EQ(status, OC_OK) << oc_status_text(status);
            if (status != OC_OK) return datagrams;
            buf.resize(n_bytes);
            datagrams.push_back(buf);
            first = static_cast<std::uint16_t>(first + taken);
            first_tie = static_cast<std::uint16_t>(first_tie + ties_taken);
            if (first == n && first_tie == ties.size()) break;
        }
        return datagrams;
    }

    Bytes relabel(std::uint16_t view, std::uint16_t first, const std::vector<std::uint8_t> &labels)
    {
        oc_relabel_t relabel{};
        relabel.view = view, relabel.first = first, relabel.n = static_cast<std::uint16_t>(labels.size());
        std::copy(labels.begin(), labels.end(), relabel.labels);
        const oc_packet_head_t packet = head(OC_PACKET_RELABEL);
        return encoded([&](std::uint8_t *buf, std::size_t cap, std::size_t *n) {
            return oc_packet_encode_relabel(&packet, &relabel, buf, cap, n);
        });
    }

    Bytes patch(std::uint16_t view, std::uint8_t quality, const std::vector<std::uint16_t> &blocks, std::uint8_t grey,
                std::uint32_t width_px = 640)
    {
        const Bytes pixels(width_px * 480, grey);
        const oc_image_t image{pixels.data(), width_px, 480, width_px, 1};
        const oc_packet_head_t packet = head(OC_PACKET_PATCH);
        std::uint16_t taken = 0;
        const Bytes bytes = encoded([&](std::uint8_t *buf, std::size_t cap, std::size_t *n) {
            return oc_packet_encode_patch(&packet, view, quality, &image, blocks.data(),
                                          static_cast<std::uint16_t>(blocks.size()), buf, cap, n, &taken);
        });
        EXPECT_EQ(taken, blocks.size());
        return bytes;
    }

    Bytes overhead(std::uint16_t view, std::int16_t ix, const Bytes &blob)
    {
        oc_overhead_t tile{};
        tile.view = view, tile.metres_per_pixel = 0.01, tile.tile_px = 64, tile.tile = {ix, 2};
        tile.codec = OC_CODEC_JPEG, tile.n_bytes = static_cast<std::uint16_t>(blob.size()), tile.bytes = blob.data();
        const oc_packet_head_t packet = head(OC_PACKET_OVERHEAD);
        return encoded([&](std::uint8_t *buf, std::size_t cap, std::size_t *n) {
            return oc_packet_encode_overhead(&packet, &tile, buf, cap, n);
        });
    }

    Bytes announce(std::uint16_t view)
    {
        const oc_announce_t announce{view, 5000000};
        const oc_packet_head_t packet = head(OC_PACKET_ANNOUNCE);
        return encoded([&](std::uint8_t *buf, std::size_t cap, std::size_t *n) {
            return oc_packet_encode_announce(&packet, &announce, buf, cap, n);
        });
    }

    Bytes status(std::uint32_t uptime_s, std::uint16_t n_views, std::uint16_t newest)
    {
        oc_vehicle_status_t status{};
        status.uptime_s = uptime_s, status.n_views = n_views, status.newest_view = newest;
        const oc_packet_head_t packet = head(OC_PACKET_STATUS);
        return encoded([&](std::uint8_t *buf, std::size_t cap, std::size_t *n) {
            return oc_packet_encode_status(&packet, &status, buf, cap, n);
        });
    }

    Bytes patch_request()
    {
        oc_patch_request_t request{};
        request.view = 1, request.quality = 5, request.n_blocks = 1;
        const oc_packet_head_t packet = head(OC_PACKET_PATCH_REQUEST);
        std::uint16_t taken = 0;
        return encoded([&](std::uint8_t *buf, std::size_t cap, std::size_t *n) {
            return oc_packet_encode_patch_request(&packet, &request, buf, cap, n, &taken);
        });
    }

private:
    template <typename Encode>
    Bytes encoded(const Encode &encode)
    {
        Bytes buf(OC_MAX_DATAGRAM_BYTES);
        std::size_t n = 0;
        const oc_status_t status = encode(buf.data(), buf.size(), &n);
        EXPECT_EQ(status, OC_OK) << oc_status_text(status);
        buf.resize(n);
        return buf;
    }

    std::uint8_t vehicle_;
    std::uint16_t sequence_;
};

bool same_view(const View &a, const View &b)
{
    return a.id == b.id && a.utime_us == b.utime_us && a.junctions.size() == b.junctions.size() &&
           std::memcmp(&a.camera, &b.camera, sizeof a.camera) == 0 &&
           std::equal(a.junctions.begin(), a.junctions.end(), b.junctions.begin(),
                      [](const oc_junction_t &x, const oc_junction_t &y) {
                          return x.x_px == y.x_px && x.y_px == y.y_px && x.label == y.label;
                      }) &&
           a.ties.size() == b.ties.size() && cv::countNonZero(a.grey != b.grey) == 0 &&
           cv::countNonZero(a.known != b.known) == 0;
}

bool same_views(const std::map<int, View> &a, const std::map<int, View> &b)
{
    return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](const auto &x, const auto &y) {
               return x.first == y.first && same_view(x.second, y.second);
           });
}

// Everything a drive sends, with contradictions: labels that change, patches in two qualities.
std::vector<Bytes> a_drive()
{
    Encoder encoder(1, 65500); // the numbers wrap on the way
    std::vector<Bytes> all;
    for (std::uint16_t id = 0; id < 6; ++id) {
        for (const Bytes &part : encoder.view(id, 150, 300)) all.push_back(part);
        all.push_back(encoder.relabel(id, 10, Bytes(40, OC_LABEL_GROUND)));
        all.push_back(encoder.relabel(id, 30, Bytes(40, OC_LABEL_OBSTACLE)));
        all.push_back(encoder.patch(id, 4, {0, 1, 85, 4799}, 90));
        all.push_back(encoder.patch(id, 20, {1, 85}, 120));
        all.push_back(encoder.overhead(id, 3, Bytes(50, 1)));
        all.push_back(encoder.overhead(id, 3, Bytes(80, 2)));
    }
    all.push_back(encoder.announce(6));
    all.push_back(encoder.status(10, 7, 6));
    all.push_back(encoder.status(20, 8, 7));
    return all;
}

TEST(Assemble, makes_views_of_parts_labels_and_pixels)
{
    PacketAssembler assembler;
    for (const Bytes &packet : a_drive()) EXPECT_EQ(assembler.feed(packet), FeedResult::kTaken);
    const std::map<int, View> &views = assembler.views();
    ASSERT_EQ(views.size(), 6u);
    const View &view = views.at(2);
    EXPECT_EQ(view.junctions.size(), 150u);
    EXPECT_EQ(view.ties.size(), 1u);
    EXPECT_EQ(view.junctions[9].label, OC_LABEL_UNKNOWN);
    EXPECT_EQ(view.junctions[29].label, OC_LABEL_GROUND);
    EXPECT_EQ(view.junctions[30].label, OC_LABEL_OBSTACLE) << "the later relabel wins, though the numbers have wrapped";
    EXPECT_EQ(view.known(0, 0), 255);
    EXPECT_EQ(view.known(0, 16), 0);
    EXPECT_EQ(view.known(479, 639), 255);
    EXPECT_EQ(cv::countNonZero(view.known), 4 * 64);
    EXPECT_NEAR(view.grey(0, 0), 90, 6);
    EXPECT_NEAR(view.grey(0, 8), 120, 4) << "the finer pixels stay";
    ASSERT_EQ(assembler.tiles().size(), 6u);
    EXPECT_EQ(assembler.tiles().begin()->second.bytes.size(), 80u);
    EXPECT_EQ(assembler.status()->uptime_s, 20u);
    EXPECT_EQ(assembler.announced().count(6), 1u);
    const std::map<int, std::uint32_t> missing = assembler.missing();
    ASSERT_EQ(missing.size(), 1u) << "view 7 exists, says the status, and nothing of it came";
    EXPECT_EQ(missing.at(7), 0xffffffffu);
}

TEST(Assemble, does_not_paint_pixels_that_were_cut_for_another_width)
{
    Encoder encoder(1);
    const std::vector<Bytes> parts = encoder.view(3, 50, 1300);
    const Bytes narrow = encoder.patch(3, 20, {0, 45}, 200, 320), wide = encoder.patch(3, 5, {45}, 100);
    for (const bool is_narrow_first : {true, false}) {
        PacketAssembler assembler;
        assembler.feed(is_narrow_first ? narrow : wide);
        for (const Bytes &part : parts) assembler.feed(part);
        assembler.feed(is_narrow_first ? wide : narrow);
        const View &view = assembler.views().at(3);
        EXPECT_EQ(cv::countNonZero(view.known), 64);
        EXPECT_EQ(view.known(0, 45 * 8), 255);
        EXPECT_NEAR(view.grey(0, 45 * 8), 100, 6);
    }
}

TEST(Assemble, is_a_function_of_the_set_of_packets)
{
    std::vector<Bytes> packets = a_drive();
    PacketAssembler reference;
    for (const Bytes &packet : packets) reference.feed(packet);
    std::mt19937 rng(kSeed);
    for (int trial = 0; trial < 10; ++trial) {
        std::shuffle(packets.begin(), packets.end(), rng);
        PacketAssembler assembler;
        for (std::size_t i = 0; i < packets.size(); ++i) {
            assembler.feed(packets[i]);
            if (i % 7 == 0) assembler.feed(packets[i / 2]);
            if (i % 11 == 0) assembler.views(); // looking in between changes nothing
        }
        EXPECT_TRUE(same_views(reference.views(), assembler.views())) << "trial " << trial << " seed " << kSeed;
        EXPECT_EQ(reference.missing(), assembler.missing());
        EXPECT_EQ(reference.tiles().begin()->second.bytes, assembler.tiles().begin()->second.bytes);
        EXPECT_EQ(reference.status()->uptime_s, assembler.status()->uptime_s);
    }
}

TEST(Assemble, names_the_parts_that_are_missing)
{
    Encoder encoder;
    const std::vector<Bytes> parts = encoder.view(3, 200, 250);
    ASSERT_GE(parts.size(), 4u);
    PacketAssembler assembler;
    for (std::size_t i = 0; i < parts.size(); ++i)
        if (i != 1 && i != 2) assembler.feed(parts[i]);
    EXPECT_TRUE(assembler.views().empty());
    EXPECT_EQ(assembler.missing().at(3), 0b110u);
    assembler.feed(parts[2]);
    EXPECT_EQ(assembler.missing().at(3), 0b010u);
    assembler.feed(parts[1]);
    EXPECT_TRUE(assembler.missing().empty());
    EXPECT_EQ(assembler.views().at(3).junctions.size(), 200u);

    PacketAssembler headless;
    headless.feed(parts[0]);
    EXPECT_EQ(headless.missing().at(3), 0xfffffffeu) << "the last part is not known";
    headless.feed(encoder.relabel(9, 0, {1, 2}));
    EXPECT_EQ(headless.missing().at(9), 0xffffffffu) << "a view known by a relabel only";
}

TEST(Assemble, lets_the_newer_view_of_an_id_win_in_either_order)
{
    Encoder encoder;
    const std::vector<Bytes> old = encoder.view(1, 30, 1200, 1000000), fresh = encoder.view(1, 40, 1200, 9000000);
    PacketAssembler a, b;
    for (const Bytes &p : old) a.feed(p);
    EXPECT_EQ(a.views().at(1).utime_us, 1000000);
    for (const Bytes &p : fresh) a.feed(p);
    for (const Bytes &p : fresh) b.feed(p);
    for (const Bytes &p : old) EXPECT_EQ(b.feed(p), FeedResult::kKnown);
    EXPECT_EQ(a.views().at(1).junctions.size(), 40u);
    EXPECT_TRUE(same_views(a.views(), b.views()));
    EXPECT_EQ(a.outdated_parts(), b.outdated_parts());
}

TEST(Assemble, counts_what_is_foreign_broken_or_none_of_its_business)
{
    AssembleOptions options;
    options.vehicle = 1;
    PacketAssembler assembler(options);
    Encoder encoder(1), other(2);
    EXPECT_EQ(assembler.feed(other.announce(1)), FeedResult::kForeign);
    EXPECT_EQ(assembler.feed(encoder.patch_request()), FeedResult::kOther);
    EXPECT_EQ(assembler.feed(nullptr, 0), FeedResult::kIllFormed);
    std::mt19937 rng(kSeed);
    Bytes packet = encoder.view(2, 60, 1200)[0];
    for (int trial = 0; trial < 200; ++trial) {
        Bytes broken = packet;
        broken[rng() % broken.size()] ^= static_cast<std::uint8_t>(1 + rng() % 255);
        const FeedResult result = assembler.feed(broken);
        EXPECT_TRUE(result == FeedResult::kIllFormed || result == FeedResult::kForeign);
        EXPECT_EQ(assembler.feed(broken.data(), rng() % 4), FeedResult::kIllFormed);
    }
    EXPECT_TRUE(assembler.views().empty());
    EXPECT_GE(assembler.count(FeedResult::kIllFormed), 201u);
    EXPECT_EQ(assembler.feed(packet), FeedResult::kTaken);
    EXPECT_EQ(assembler.feed(packet), FeedResult::kKnown);
}

TEST(Assemble, stops_at_its_bounds)
{
    AssembleOptions options;
    options.max_views = 2, options.max_blocks = 3, options.max_relabels = 1, options.max_tiles = 1;
    PacketAssembler assembler(options);
    Encoder encoder;
    EXPECT_EQ(assembler.feed(encoder.relabel(1, 0, {1})), FeedResult::kTaken);
    EXPECT_EQ(assembler.feed(encoder.relabel(1, 0, {2})), FeedResult::kFull);
    EXPECT_EQ(assembler.feed(encoder.relabel(2, 0, {1})), FeedResult::kTaken);
    EXPECT_EQ(assembler.feed(encoder.relabel(3, 0, {1})), FeedResult::kFull);
    EXPECT_EQ(assembler.feed(encoder.patch(1, 5, {0, 1, 2}, 50)), FeedResult::kTaken);
    EXPECT_EQ(assembler.feed(encoder.patch(1, 5, {3}, 50)), FeedResult::kFull);
    EXPECT_EQ(assembler.feed(encoder.patch(1, 9, {2}, 50)), FeedResult::kTaken) << "better pixels need no room";
    EXPECT_EQ(assembler.feed(encoder.overhead(1, 1, {1, 2})), FeedResult::kTaken);
    EXPECT_EQ(assembler.feed(encoder.overhead(1, 2, {1, 2})), FeedResult::kFull);
}

} // namespace
} // namespace outcrop
