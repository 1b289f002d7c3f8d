// SPDX-License-Identifier: BSD-3-Clause
// Whole keyframes: the base finds the boxes with the vehicle's own code, and asks for pieces that did not come.
#include "fake_link.h"

#include <map>

#include <gtest/gtest.h>

#include "null_rival.h"

namespace outcrop {
namespace {

// Four views that see both obstacles.
const std::vector<int> kViews = {1, 2, 3, 6};

std::vector<Packet> pieces_of(FakeVehicle &vehicle)
{
    std::vector<Packet> out;
    for (Packet packet = vehicle.next(); !packet.empty(); packet = vehicle.next()) out.push_back(packet);
    return out;
}

oc_image_piece_t decoded(const Packet &packet)
{
    oc_image_piece_t piece;
    EXPECT_EQ(oc_packet_decode_image(packet.data(), packet.size(), &piece), OC_OK);
    return piece;
}

TEST(NullRival, finds_the_boxes_from_whole_pictures)
{
    FakeVehicle vehicle("two_obstacles", kViews, 90);
    FakeLink down({}, 1), up({}, 2);
    double now_s = 0;
    Session session({}, [&](const std::uint8_t *p, std::size_t n) { up.send(Packet(p, p + n), now_s); });
    EXPECT_GE(play(vehicle, down, up, session, 0.05, &now_s), 0) << "did not settle";
    EXPECT_TRUE(session.is_null_rival());
    EXPECT_EQ(session.views().size(), kViews.size());
    EXPECT_EQ(session.model().obstacles.size(), 2u);
    EXPECT_GT(session.tiles().size(), 0u);
    EXPECT_EQ(up.n_sent(), 0) << "nothing was missing";
}

TEST(NullRival, asks_again_for_what_was_lost)
{
    for (const unsigned seed : {31u, 32u}) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        FakeVehicle vehicle("two_obstacles", kViews, 30);
        FakeLink down({0.2, 0.2, 0.3, false}, seed), up({0.2, 0, 0, false}, seed + 1);
        double now_s = 0;
        Session session({}, [&](const std::uint8_t *p, std::size_t n) { up.send(Packet(p, p + n), now_s); });
        EXPECT_GE(play(vehicle, down, up, session, 0.05, &now_s), 0) << "did not settle";
        EXPECT_GT(vehicle.n_resends(), 0);
        EXPECT_EQ(session.views().size(), kViews.size());
        EXPECT_EQ(session.given_up(), 0u);
    }
}

TEST(NullRival, names_the_missing_pieces_and_no_others)
{
    FakeVehicle vehicle("two_obstacles", {1}, 5);
    vehicle.take_frame();
    const std::vector<Packet> pieces = pieces_of(vehicle);
    ASSERT_GT(pieces.size(), 3u);
    ASSERT_LT(pieces.size(), 32u);
    const auto n = static_cast<std::uint32_t>(pieces.size());
    for (std::uint32_t lost = 0; lost < n; lost++) {
        NullRival rival;
        for (std::uint32_t i = 0; i < n; i++) {
            if (i != lost) {
                EXPECT_EQ(rival.take(decoded(pieces[i])), FeedResult::kTaken);
            }
        }
        const std::map<int, std::uint32_t> expected = {{1, 1u << lost}};
        EXPECT_EQ(rival.missing({}, {}), expected) << "piece " << lost;
        EXPECT_EQ(rival.take(decoded(pieces[lost])), FeedResult::kTaken);
        EXPECT_TRUE(rival.missing({}, {}).empty());
        EXPECT_EQ(rival.take(decoded(pieces[lost])), FeedResult::kKnown);
    }
}

TEST(NullRival, asks_for_views_the_status_tells_of_but_not_for_announced_ones)
{
    FakeVehicle vehicle("two_obstacles", {1, 3}, 5);
    vehicle.take_frame();
    NullRival rival;
    for (const Packet &packet : pieces_of(vehicle)) rival.take(decoded(packet));
    oc_vehicle_status_t status{};
    status.n_views = 1;
    status.newest_view = 1;
    EXPECT_TRUE(rival.missing(status, {}).empty()) << "there is only one view, and it came";
    status.n_views = 3;
    status.newest_view = 3;
    const std::map<int, std::uint32_t> without_two = {{0, UINT32_MAX}, {3, UINT32_MAX}};
    EXPECT_EQ(rival.missing(status, {{2, 1000}}), without_two);
    EXPECT_TRUE(rival.missing(status, {{2, 1000}, {3, 2000}}).empty());
}

TEST(NullRival, is_a_function_of_the_set_of_pieces)
{
    FakeVehicle vehicle("two_obstacles", {1, 2}, 40);
    vehicle.take_frame();
    vehicle.take_frame();
    std::vector<Packet> pieces = pieces_of(vehicle);
    NullRival forward, backward;
    for (const Packet &packet : pieces) forward.take(decoded(packet));
    std::reverse(pieces.begin(), pieces.end());
    for (const Packet &packet : pieces) backward.take(decoded(packet));
    const auto a = forward.make_views({}), b = backward.make_views({});
    ASSERT_EQ(a.size(), 2u);
    ASSERT_EQ(b.size(), 2u);
    for (const auto &[id, view] : a) {
        ASSERT_EQ(view.junctions.size(), b.at(id).junctions.size());
        for (std::size_t i = 0; i < view.junctions.size(); i++) {
            EXPECT_EQ(view.junctions[i].x_px, b.at(id).junctions[i].x_px);
            EXPECT_EQ(view.junctions[i].label, b.at(id).junctions[i].label);
        }
    }
}

TEST(NullRival, counts_a_keyframe_that_the_vehicles_code_refuses)
{
    FakeVehicle vehicle("two_obstacles", {1, 2}, 40);
    vehicle.take_frame();
    vehicle.take_frame();
    NullRival rival;
    int refused_view = -1;
    for (const Packet &packet : pieces_of(vehicle)) {
        oc_image_piece_t piece = decoded(packet);
        if (refused_view < 0) refused_view = piece.head.view;
        if (piece.head.view == refused_view) piece.head.camera_index = 255; // more cameras than a vehicle may have
        rival.take(piece);
    }
    EXPECT_EQ(rival.make_views({}).size(), 1u);
    EXPECT_EQ(rival.refused(), 1u);
    EXPECT_EQ(rival.make_views({}).count(refused_view), 0u);
    EXPECT_EQ(rival.refused(), 1u) << "counted anew, not added up";
}

} // namespace
} // namespace outcrop
