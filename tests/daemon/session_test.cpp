// SPDX-License-Identifier: BSD-3-Clause
// The session in virtual time against a real vehicle over a link that loses, doubles and reorders.
#include "fake_link.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include <gtest/gtest.h>

#include "ledger.h"
#include "output.h"

namespace outcrop {
namespace {

const std::vector<int> kViews = {1, 2, 3, 6}; // numbers with gaps, as a choice of a site's views has them

std::string bytes_of(const std::string &file)
{
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

// model/obstacles.json, matches.json and points.ply as outcrop-base would write them.
std::string model_bytes(Session &session)
{
    char name[] = "/tmp/outcrop_session_XXXXXX";
    OutputOptions options;
    options.dir = mkdtemp(name);
    options.represent = "none";
    write_output(session, Ledger(), ReceiveCounts(), options, [](const std::string &) {});
    const std::string out = bytes_of(options.dir + "/model/obstacles.json") + bytes_of(options.dir + "/matches.json") +
                            bytes_of(options.dir + "/model/points.ply");
    std::filesystem::remove_all(options.dir);
    return out;
}

std::set<int> ids_of(Session &session)
{
    std::set<int> out;
    for (const auto &[id, view] : session.views()) out.insert(id);
    return out;
}

std::size_t known_pixels(Session &session)
{
    std::size_t n = 0;
    for (const auto &[id, view] : session.views()) n += static_cast<std::size_t>(cv::countNonZero(view.known));
    return n;
}

struct Outcome {
    double time_s = -1;
    std::set<int> views;
    std::size_t pixels = 0, tiles = 0, obstacles = 0;
    std::uint64_t given_up = 0;
    int n_down = 0, n_up = 0;
    std::string model;
};

Outcome play_out(const LinkFaults &faults, unsigned seed, double frame_s = 0.05)
{
    FakeVehicle vehicle("two_obstacles", kViews);
    FakeLink down(faults, seed), up(faults, seed + 1);
    double now_s = 0;
    Session session({}, [&](const std::uint8_t *p, std::size_t n) { up.send(Packet(p, p + n), now_s); });
    Outcome out;
    out.time_s = play(vehicle, down, up, session, frame_s, &now_s);
    out.views = ids_of(session);
    out.pixels = known_pixels(session);
    out.tiles = session.tiles().size();
    out.given_up = session.given_up();
    out.n_down = down.n_sent();
    out.n_up = up.n_sent();
    out.model = model_bytes(session);
    out.obstacles = session.model().obstacles.size();
    return out;
}

const Outcome &clean_run()
{
    static const Outcome clean = play_out({}, 1);
    return clean;
}

TEST(Session, settles_on_a_clean_link_and_asks_for_nothing_that_never_was)
{
    const Outcome &clean = clean_run();
    EXPECT_GE(clean.time_s, 0) << "did not settle";
    EXPECT_EQ(clean.views, (std::set<int>{1, 2, 3, 6}));
    EXPECT_GT(clean.pixels, 10000u);
    EXPECT_GT(clean.tiles, 0u);
    EXPECT_EQ(clean.obstacles, 2u);
    EXPECT_EQ(clean.given_up, 0u) << "views 0, 4 and 5 were never given out";
}

TEST(Session, ends_with_the_same_model_when_a_fifth_is_lost_and_the_rest_comes_doubled_and_out_of_order)
{
    for (const unsigned seed : {11u, 12u}) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        LinkFaults faults{0.2, 0.2, 0.3, true};
        const Outcome lossy = play_out(faults, seed);
        EXPECT_GE(lossy.time_s, 0) << "did not settle";
        EXPECT_EQ(lossy.given_up, 0u);
        EXPECT_GT(lossy.n_up, clean_run().n_up) << "nothing had to be asked for again";
        EXPECT_EQ(lossy.views, clean_run().views);
        EXPECT_EQ(lossy.pixels, clean_run().pixels);
        EXPECT_EQ(lossy.tiles, clean_run().tiles);
        EXPECT_EQ(lossy.model, clean_run().model);
    }
}

TEST(Session, settles_with_all_views_and_boxes_when_relabels_are_lost_as_well)
{
    const Outcome lossy = play_out({0.2, 0.2, 0.3, false}, 21);
    EXPECT_GE(lossy.time_s, 0) << "did not settle";
    EXPECT_EQ(lossy.views, clean_run().views);
    EXPECT_EQ(lossy.obstacles, clean_run().obstacles);
}

TEST(Session, gives_the_same_model_however_fast_the_frames_come)
{
    const Outcome slow = play_out({}, 1, 4.5); // slower than settle_quiet_s: planned and solved again at every view
    EXPECT_GE(slow.time_s, 0) << "did not settle";
    EXPECT_GE(slow.pixels, clean_run().pixels);
    EXPECT_EQ(slow.model, clean_run().model);
}

TEST(Session, gives_up_what_nobody_answers_and_counts_it)
{
    FakeVehicle vehicle("two_obstacles", kViews);
    FakeLink down({}, 1), up({1, 0, 0, false}, 2); // no request ever arrives
    double now_s = 0;
    SessionOptions options;
    Session session(options, [&](const std::uint8_t *p, std::size_t n) { up.send(Packet(p, p + n), now_s); });
    EXPECT_GE(play(vehicle, down, up, session, 0.05, &now_s), 0) << "did not settle";
    EXPECT_EQ(known_pixels(session), 0u);
    // Every view's pixels, and tiles of every view that the map would take some from.
    EXPECT_GE(session.given_up(), kViews.size());
    EXPECT_EQ(vehicle.n_refused(), 0);
    const int n_before = up.n_sent();
    for (int i = 0; i < 1000; i++) session.step(now_s += 0.05);
    EXPECT_EQ(up.n_sent(), n_before) << "went on asking";
}

TEST(Session, gets_views_of_more_parts_than_a_resend_request_has_bits)
{
    FakeVehicle vehicle("two_obstacles", {1, 2}, 0, OC_MIN_DATAGRAM_BYTES, OC_MAX_JUNCTIONS);
    FakeLink down({0.1, 0.1, 0.3, false}, 41), up({0.1, 0, 0, false}, 42);
    double now_s = 0;
    SessionOptions options;
    options.max_tries = 30; // of a hundred small parts some are lost again and again
    Session session(options, [&](const std::uint8_t *p, std::size_t n) { up.send(Packet(p, p + n), now_s); });
    EXPECT_GE(play(vehicle, down, up, session, 0.05, &now_s), 0) << "did not settle";
    EXPECT_EQ(ids_of(session), (std::set<int>{1, 2}));
    // The first view has no other to tell its ground from, so all of it is sent, some 20 junctions a part.
    EXPECT_GT(session.views().at(1).junctions.size(), 700u);
}

TEST(Session, asks_for_views_of_which_only_the_status_tells)
{
    FakeVehicle vehicle("two_obstacles", kViews);
    std::vector<Packet> requests;
    Session session({}, [&](const std::uint8_t *p, std::size_t n) { requests.emplace_back(p, p + n); });
    vehicle.take_frame();
    const Packet status = vehicle.status(1);
    EXPECT_EQ(session.receive(status.data(), status.size(), 100), FeedResult::kTaken);
    session.step(101);
    ASSERT_FALSE(requests.empty());
    std::set<int> asked;
    for (const Packet &packet : requests) {
        oc_resend_request_t request;
        ASSERT_EQ(oc_packet_decode_resend(packet.data(), packet.size(), &request), OC_OK);
        EXPECT_EQ(request.parts, UINT32_MAX);
        asked.insert(request.view);
    }
    EXPECT_EQ(asked.count(1), 1u);
}

TEST(Session, ignores_other_vehicles_and_counts_what_is_ill_formed)
{
    FakeVehicle vehicle("two_obstacles", kViews);
    vehicle.take_frame();
    Packet packet = vehicle.next();
    SessionOptions options;
    options.vehicle = FakeVehicle::kId + 1;
    Session other(options, {});
    EXPECT_EQ(other.receive(packet.data(), packet.size(), 1), FeedResult::kForeign);
    EXPECT_TRUE(other.views().empty());

    Session first_heard({}, {});
    EXPECT_EQ(first_heard.receive(packet.data(), packet.size(), 1), FeedResult::kTaken);
    const oc_packet_head_t head{0, FakeVehicle::kId + 1, 0};
    const oc_announce_t announce{9, 1000};
    Packet foreign(100);
    std::size_t n_bytes = 0;
    ASSERT_EQ(oc_packet_encode_announce(&head, &announce, foreign.data(), foreign.size(), &n_bytes), OC_OK);
    EXPECT_EQ(first_heard.receive(foreign.data(), n_bytes, 2), FeedResult::kForeign);
    EXPECT_EQ(first_heard.vehicle(), FakeVehicle::kId);

    Session session({}, {});
    for (std::size_t i = 0; i < packet.size(); i++) {
        Packet bad = packet;
        bad[i] ^= 0x10;
        EXPECT_EQ(session.receive(bad.data(), bad.size(), 1), FeedResult::kIllFormed) << "byte " << i;
    }
    EXPECT_EQ(session.receive(packet.data(), 3, 1), FeedResult::kIllFormed);
    EXPECT_EQ(session.assembler().count(FeedResult::kIllFormed), packet.size() + 1);
    EXPECT_EQ(session.vehicle(), -1) << "an ill-formed packet chose the vehicle";
}

TEST(Session, falls_back_on_the_area_in_the_status)
{
    FakeVehicle vehicle("two_obstacles", kViews);
    Session session({}, {});
    EXPECT_FALSE(session.area().has_value());
    const Packet status = vehicle.status(1);
    session.receive(status.data(), status.size(), 1);
    ASSERT_TRUE(session.area().has_value());
    EXPECT_FLOAT_EQ(static_cast<float>(session.area()->x_min), -0.65f);
    EXPECT_FLOAT_EQ(static_cast<float>(session.area()->z_max), 0.302f);

    SessionOptions options;
    options.area = Area{-1, 1, -1, 1, 2};
    Session with_own(options, {});
    with_own.receive(status.data(), status.size(), 1);
    EXPECT_EQ(with_own.area()->z_max, 2);
}

} // namespace
} // namespace outcrop
