// SPDX-License-Identifier: BSD-3-Clause
// A view as everybody on the base's network reads it.
#include "republish.h"

#include <vector>

#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>

#include "outcrop/view_t.hpp"

namespace outcrop {
namespace {

using Views = std::vector<view_t>;

void on_view(const lcm::ReceiveBuffer *, const std::string &channel, const view_t *message, Views *views)
{
    EXPECT_EQ(channel, "OUTCROP_VIEW");
    views->push_back(*message);
}

View some_view()
{
    View view;
    view.id = 12;
    view.camera_index = 2;
    view.utime_us = 1234567890;
    view.camera.k.width_px = 640;
    view.camera.k.height_px = 480;
    view.camera.k.fx_px = 500;
    view.camera.k.fy_px = 510;
    const double pose[9] = {0, 1, 0, 0, 0, -1, -1, 0, 0};
    for (int i = 0; i < 9; i++) view.camera.pose.R[i] = pose[i];
    for (int i = 0; i < 3; i++) view.camera.pose.t[i] = i + 0.5;
    for (int i = 0; i < 6; i++) view.margin.v[i] = 0.01 * i;
    oc_junction_t junction{};
    junction.x_px = 100.5f;
    junction.y_px = 50.25f;
    junction.label = OC_LABEL_OBSTACLE;
    junction.n_branches = 2;
    junction.branch[0].angle_rad = 0.5f;
    junction.branch[1].angle_rad = 2.5f;
    view.junctions.push_back(junction);
    return view;
}

TEST(Republisher, says_a_view_once_and_in_full)
{
    const auto lcm = std::make_shared<lcm::LCM>("memq://");
    ASSERT_TRUE(lcm->good());
    Views views;
    lcm->subscribeFunction("OUTCROP_VIEW", on_view, &views);
    Republisher republisher(lcm);
    const View view = some_view();
    republisher.publish(7, view);
    republisher.publish(7, view);
    while (lcm->handleTimeout(50) > 0) {
    }
    ASSERT_EQ(views.size(), 1u);
    const view_t &got = views[0];
    EXPECT_EQ(got.utime, view.utime_us);
    EXPECT_EQ(got.vehicle, 7);
    EXPECT_EQ(got.view, 12);
    EXPECT_EQ(got.camera, 2);
    EXPECT_EQ(got.width, 640);
    EXPECT_EQ(got.height, 480);
    EXPECT_EQ(got.fy, 510);
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++)
            EXPECT_EQ(got.cam_from_world[row][column], view.camera.pose.R[3 * row + column]);
        EXPECT_EQ(got.cam_from_world[row][3], row + 0.5);
    }
    EXPECT_EQ(got.margin[5], view.margin.v[5]);
    ASSERT_EQ(got.n_junctions, 1);
    EXPECT_EQ(got.junctions[0].x, 100.5);
    EXPECT_EQ(got.junctions[0].label, junction_t::OBSTACLE);
    ASSERT_EQ(got.junctions[0].n_branches, 2);
    EXPECT_EQ(got.junctions[0].branches[1].angle, 2.5);
}

TEST(Republisher, refuses_a_url_that_is_none)
{
    EXPECT_THROW(Republisher("udpm://not.an.address:1"), std::runtime_error);
    EXPECT_THROW(Republisher("nonsense"), std::runtime_error);
}

} // namespace
} // namespace outcrop
