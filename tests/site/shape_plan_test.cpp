// SPDX-License-Identifier: BSD-3-Clause
// What is asked for: every obstacle in every view that shows it, within datagrams, and what came is put where it belongs.
#include "site/shape_plan.h"

#include <cmath>
#include <random>
#include <set>

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "site/triangulate.h"

namespace outcrop {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

oc_camera_t looking_at(const Vector3d &from, const Vector3d &to)
{
    oc_camera_t camera{};
    camera.k = {500, 500, 319.5, 239.5, 640, 480};
    const Vector3d z = (to - from).normalized(), x = z.cross(Vector3d::UnitZ()).normalized(), y = z.cross(x);
    Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rows;
    rows.row(0) = x, rows.row(1) = y, rows.row(2) = z;
    oc_pose_from_centre(rows.data(), from.data(), &camera.pose);
    return camera;
}

Obstacle box_at(int index, double x, double y)
{
    Obstacle box;
    box.index = index;
    box.aabb_min = Vector3d(x - 0.2, y - 0.15, 0), box.aabb_max = Vector3d(x + 0.2, y + 0.15, 0.5);
    box.obb_centre = Vector3d(x, y, 0.25), box.obb_size = Vector3d(0.4, 0.3, 0.5);
    return box;
}

// Cameras on a ring that look at its middle, with refined poses a little off the reported ones.
struct Ring {
    SiteModel model;
    std::map<int, View> views;

    explicit Ring(int n)
    {
        for (int i = 0; i < n; i++) {
            const double a = 6.283185307 * i / n;
            View view;
            view.id = 3 * i;
            view.camera = looking_at({4 * std::cos(a), 4 * std::sin(a), 1.2}, {0, 0, 0.2});
            RefinedView refined;
            refined.id = view.id;
            refined.camera = looking_at({4 * std::cos(a) + 0.01, 4 * std::sin(a), 1.21}, {0.01, 0, 0.2});
            views[view.id] = view;
            model.views.push_back(refined);
        }
    }
};

// Each (obstacle, view) that is asked for, how often.
std::map<std::pair<int, int>, int> asked(const std::vector<SilhouettePlan> &plans)
{
    std::map<std::pair<int, int>, int> out;
    for (const SilhouettePlan &plan : plans)
        for (int v = 0; v < plan.request.n_views; v++)
            for (std::size_t b = 0; b < plan.obstacle.size(); b++)
                if (plan.request.views[v].is_wanted && plan.obstacle[b] >= 0)
                    out[{plan.obstacle[b], plan.request.views[v].view}]++;
    return out;
}

TEST(PlanSilhouettes, OneRequestHoldsASmallSite)
{
    Ring ring(14);
    for (int i = 0; i < 5; i++)
        ring.model.obstacles.push_back(box_at(i + 1, 0.8 * std::cos(i * 1.2), 0.8 * std::sin(i * 1.2)));
    ring.model.suspected.push_back(box_at(1, 0, 0));
    const auto plans = plan_silhouettes(ring.model, ring.views, {});
    ASSERT_EQ(plans.size(), 1u);
    EXPECT_EQ(plans[0].request.n_boxes, 6);
    EXPECT_EQ(asked(plans).size(), 5u * 14u);
    // The steps lead from the reported pose to the refined one.
    for (int v = 0; v < plans[0].request.n_views; v++) {
        const oc_pose_step_t &step = plans[0].request.views[v];
        const Vector3d moved =
            camera_centre(ring.views.at(step.view).camera) + Vector3d(step.move_m[0], step.move_m[1], step.move_m[2]);
        EXPECT_LT((moved - camera_centre(ring.model.views[static_cast<std::size_t>(v)].camera)).norm(), 1e-9);
    }
}

TEST(PlanSilhouettes, EveryObstacleInEveryViewWhateverTheDatagram)
{
    for (const std::size_t bytes : {200u, 250u, 600u, 1380u}) {
        for (const int n_boxes : {1, 7, 60}) {
            Ring ring(20);
            std::mt19937 random(static_cast<unsigned>(n_boxes));
            std::uniform_real_distribution<double> place(-1, 1);
            for (int i = 0; i < n_boxes; i++)
                ring.model.obstacles.push_back(box_at(i + 1, place(random), place(random)));
            ShapeOptions options;
            options.datagram_bytes = bytes;
            const auto plans = plan_silhouettes(ring.model, ring.views, options);
            const auto all = asked(plans);
            EXPECT_EQ(all.size(), static_cast<std::size_t>(n_boxes) * 20u) << bytes << " bytes, " << n_boxes;
            for (const auto &[what, times] : all) EXPECT_EQ(times, 1);
            std::set<std::uint16_t> keys;
            for (const SilhouettePlan &plan : plans) {
                std::uint8_t buf[OC_MAX_DATAGRAM_BYTES];
                std::size_t n_bytes = 0;
                std::uint16_t key = 0;
                const oc_packet_head_t head{};
                ASSERT_EQ(oc_packet_encode_silhouette_request(&head, &plan.request, buf, bytes, &n_bytes, &key), OC_OK);
                EXPECT_EQ(key, plan.key);
                EXPECT_LE(n_bytes, bytes);
            }
        }
    }
}

TEST(PlanSilhouettes, NothingIsAskedWithoutObstaclesOrOfAPoseTooFarOff)
{
    Ring ring(6);
    EXPECT_TRUE(plan_silhouettes(ring.model, ring.views, {}).empty());
    ring.model.obstacles.push_back(box_at(1, 0, 0));
    ring.model.views[2].camera = looking_at({9, 9, 1.2}, {0, 0, 0.2});
    const auto all = asked(plan_silhouettes(ring.model, ring.views, {}));
    EXPECT_EQ(all.size(), 5u);
    EXPECT_EQ(all.count({0, 6}), 0u);
}

std::vector<std::uint8_t> answer(const SilhouettePlan &plan, int view, int box, const oc_silhouette_t &rect,
                                 std::uint8_t label)
{
    oc_silhouette_t s = rect;
    s.view = static_cast<std::uint16_t>(view), s.key = plan.key, s.box = static_cast<std::uint8_t>(box);
    const std::vector<std::uint8_t> labels(static_cast<std::size_t>(s.n_cols) * s.n_rows, label);
    std::vector<std::uint8_t> bytes(OC_MAX_DATAGRAM_BYTES);
    std::size_t n_bytes = 0;
    const oc_packet_head_t head{};
    EXPECT_EQ(oc_packet_encode_silhouette(&head, &s, labels.data(), bytes.data(), bytes.size(), &n_bytes), OC_OK);
    bytes.resize(n_bytes);
    return bytes;
}

TEST(GatherSilhouettes, OnlyAnswersToThisQuestionCountAndOnlyInsideTheBox)
{
    Ring ring(6);
    ring.model.obstacles.push_back(box_at(1, 0, 0));
    const auto plans = plan_silhouettes(ring.model, ring.views, {});
    ASSERT_EQ(plans.size(), 1u);
    oc_silhouette_t rect{};
    rect.step_px = 4, rect.col = 40, rect.row = 20, rect.n_cols = 90, rect.n_rows = 90;
    std::map<SilhouetteKey, std::vector<std::uint8_t>> came;
    came[{0, plans[0].key, 0}] = answer(plans[0], 0, 0, rect, OC_LABEL_OBSTACLE);
    SilhouettePlan other = plans[0];
    other.key++;
    came[{3, other.key, 0}] = answer(other, 3, 0, rect, OC_LABEL_OBSTACLE);
    const auto views = gather_silhouettes(ring.model, ring.views, plans, came, 0);
    ASSERT_EQ(views.size(), 1u);
    EXPECT_EQ(views[0].id, 0);
    double x, y;
    const double middle[3] = {0, 0, 0.25};
    ASSERT_GT(oc_camera_project(&views[0].camera, middle, &x, &y), 0);
    EXPECT_EQ(views[0].labels(static_cast<int>(y), static_cast<int>(x)), OC_LABEL_OBSTACLE);
    EXPECT_NE(views[0].labels(0, 0), OC_LABEL_OBSTACLE);
    EXPECT_NE(views[0].labels(100, 170), OC_LABEL_OBSTACLE); // in the rectangle, beside the box
    EXPECT_TRUE(gather_silhouettes(ring.model, ring.views, plans, came, 1).empty());
}

TEST(Textures, AreAskedWhereSilhouettesShowSomethingAndPaintedWhereTheyBelong)
{
    Ring ring(8);
    ring.model.obstacles.push_back(box_at(1, 0, 0));
    std::vector<std::vector<CarveView>> carve(1);
    for (const RefinedView &refined : ring.model.views) {
        CarveView view;
        view.id = refined.id;
        view.camera = refined.camera;
        view.labels = cv::Mat1b(480, 640, std::uint8_t{OC_LABEL_GROUND});
        view.labels(cv::Rect(290, 200, 60, 70)).setTo(OC_LABEL_OBSTACLE);
        carve[0].push_back(view);
    }
    ShapeOptions options;
    const auto plans = plan_textures(ring.model, carve, options);
    ASSERT_EQ(plans.size(), static_cast<std::size_t>(options.texture_views));
    for (const TexturePlan &plan : plans) {
        EXPECT_GT(plan.estimate_bytes, 0);
        EXPECT_GE(plan.request.budget_bytes, plan.estimate_bytes);
        // Tiles of 128 px: columns 2 and rows 1 and 2 hold 290..350 x 200..270.
        ASSERT_EQ(plan.request.n_tiles, 2);
        EXPECT_EQ(plan.request.tiles[0], 1 * 5 + 2);
        EXPECT_EQ(plan.request.tiles[1], 2 * 5 + 2);
    }
    std::map<TextureKey, TileBlob> came;
    std::vector<std::uint8_t> png;
    cv::imencode(".png", cv::Mat3b(64, 64, cv::Vec3b(30, 20, 10)), png);
    const auto view_id = plans[0].request.view;
    came[{view_id, 2, 64, 7}] = {OC_CODEC_WEBP, png};
    came[{view_id, 2, 64, 12}] = {OC_CODEC_WEBP, {1, 2, 3}};
    came[{view_id, 2, 64, 8}] = {OC_CODEC_WEBP, png}; // nobody asked for it
    EXPECT_EQ(gather_textures(came, plans, options, &carve[0]), 1);
    for (const CarveView &view : carve[0]) {
        if (view.id != view_id) {
            EXPECT_TRUE(view.rgb.empty());
            continue;
        }
        EXPECT_EQ(view.known(210, 300), 255);
        EXPECT_EQ(view.rgb(210, 300), cv::Vec3b(10, 20, 30));
        EXPECT_EQ(view.known(150, 300), 0); // ground
        EXPECT_EQ(view.known(265, 300), 0); // the tile that could not be decoded
    }
}

} // namespace
} // namespace outcrop
