// SPDX-License-Identifier: BSD-3-Clause
// Planning and composing the overhead map against a ground texture that is known.
#include "site/overhead.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "core/plane.h"
#include "site/box_shadow.h"
#include "textured_scene.h"

namespace outcrop {
namespace {

using Tiles = std::map<TileKey, TileBlob>;

cv::Vec3d texture(double x, double y)
{
    return {128 + 80 * std::sin(9 * x) * std::cos(7 * y), 128 + 70 * std::sin(5 * x + 6 * y),
            120 + 60 * std::cos(8 * y - 3 * x)};
}

SiteModel site(int n_views, bool with_box)
{
    SiteModel model;
    model.area = scene::area();
    for (int i = 0; i < n_views; i++) {
        RefinedView view;
        view.id = 10 + i;
        view.camera = scene::on_ring(360.0 * i / n_views);
        model.views.push_back(view);
    }
    if (!with_box) return model;
    Obstacle o;
    o.index = 1;
    o.obb_centre = {0.1, 0.05, 0.2};
    o.obb_size = {0.5, 0.4, 0.4};
    o.yaw_rad = 0.3;
    o.aabb_min = o.obb_centre - 0.5 * o.obb_size; // not used here
    o.aabb_max = o.obb_centre + 0.5 * o.obb_size;
    model.obstacles.push_back(o);
    return model;
}

// What an exact vehicle would send: the texture where the view shows ground, magenta where the box stands before it.
Tiles tiles_of(const SiteModel &model, const std::vector<TileRequest> &plan, double gain_of_first = 1)
{
    Tiles out;
    const std::vector<Blocker> blockers = blockers_of(model, 0);
    for (const TileRequest &request : plan) {
        const auto view = std::find_if(model.views.begin(), model.views.end(),
                                       [&](const RefinedView &v) { return v.id == request.view; });
        double c[3];
        oc_pose_centre(&view->camera.pose, c);
        for (const oc_tile_id_t tile : request.tiles) {
            cv::Mat3b bgr(request.tile_px, request.tile_px, cv::Vec3b(128, 128, 128));
            for (int r = 0; r < bgr.rows; r++) {
                for (int k = 0; k < bgr.cols; k++) {
                    const double x = (tile.ix * request.tile_px + k + 0.5) * request.metres_per_pixel;
                    const double y = ((tile.iy + 1) * request.tile_px - r - 0.5) * request.metres_per_pixel;
                    const double *H = request.image_from_ground.data();
                    const double w = H[6] * x + H[7] * y + H[8];
                    const double u = (H[0] * x + H[1] * y + H[2]) / w, v = (H[3] * x + H[4] * y + H[5]) / w;
                    if (!(w > 0 && u >= 0 && v >= 0 && u < scene::kWidth - 1 && v < scene::kHeight - 1)) continue;
                    const double gain = request.view == plan.front().view ? gain_of_first : 1;
                    const cv::Vec3d t = texture(x, y) * gain;
                    bgr(r, k) = is_hidden(blockers, {c[0], c[1], c[2]}, {x, y, 0})
                                    ? cv::Vec3b(255, 0, 255)
                                    : cv::Vec3b(cv::Vec3d(t[2], t[1], t[0]));
                }
            }
            TileKey key;
            key.view = static_cast<std::uint16_t>(request.view);
            key.ix = tile.ix;
            key.iy = tile.iy;
            key.tile_px = static_cast<std::uint16_t>(request.tile_px);
            key.metres_per_pixel = request.metres_per_pixel;
            out[key].codec = OC_CODEC_WEBP;
            cv::imencode(".webp", bgr, out[key].bytes, {cv::IMWRITE_WEBP_QUALITY, 101});
        }
    }
    return out;
}

template <typename Visit>
void for_each_cell(const OverheadMap &map, Visit visit)
{
    for (int r = 0; r < map.rgb.rows; r++) {
        for (int c = 0; c < map.rgb.cols; c++)
            visit(map.x_min + (c + 0.5) * map.metres_per_pixel, map.y_max - (r + 0.5) * map.metres_per_pixel, r, c);
    }
}

double psnr_of(const OverheadMap &map)
{
    double error = 0;
    long n = 0;
    for_each_cell(map, [&](double x, double y, int r, int c) {
        if (!map.seen(r, c)) return;
        const cv::Vec3d want = texture(x, y);
        for (int k = 0; k < 3; k++) error += std::pow(map.rgb(r, c)[k] - want[k], 2);
        n += 3;
    });
    return n == 0 ? 0 : 10 * std::log10(255.0 * 255.0 * static_cast<double>(n) / std::max(error, 1e-9));
}

TEST(Overhead, TilesOfAKnownGroundGiveItBack)
{
    for (const bool with_box : {false, true}) {
        const SiteModel model = site(6, with_box);
        const OverheadMap map = compose_overhead(model, tiles_of(model, plan_overhead(model)));
        EXPECT_GT(psnr_of(map), 45) << with_box;
        EXPECT_GT(cv::countNonZero(map.seen), 0.7 * static_cast<double>(map.seen.total()));
    }
}

TEST(Overhead, MapCoversTheAreaAndPixelsAreWhereItSays)
{
    const SiteModel model = site(4, false);
    const OverheadMap map = compose_overhead(model, {});
    EXPECT_LE(map.x_min, -1);
    EXPECT_GE(map.y_max, 1);
    EXPECT_GE(map.x_min + map.rgb.cols * map.metres_per_pixel, 1);
    EXPECT_LE(map.y_max - map.rgb.rows * map.metres_per_pixel, -1);
    EXPECT_EQ(cv::countNonZero(map.seen), 0);
}

TEST(Overhead, GroundThatABoxCoversOrHidesInEveryViewStaysUnseen)
{
    SiteModel model = site(2, true);
    model.views[1].camera = scene::on_ring(8); // both from the east: the ground west of the box is hidden in both
    const OverheadMap map = compose_overhead(model, tiles_of(model, plan_overhead(model)));
    const std::vector<Blocker> blockers = blockers_of(model, 0);
    int n_hidden = 0;
    for_each_cell(map, [&](double x, double y, int r, int c) {
        bool is_seen = false;
        for (const RefinedView &view : model.views) {
            double o[3];
            oc_pose_centre(&view.camera.pose, o);
            is_seen = is_seen || !is_hidden(blockers, {o[0], o[1], o[2]}, {x, y, 0});
        }
        if (is_seen) return;
        n_hidden++;
        ASSERT_EQ(map.seen(r, c), 0) << x << ' ' << y;
        ASSERT_EQ(map.rgb(r, c), cv::Vec3b(0, 0, 0));
    });
    EXPECT_GT(n_hidden, 1000);
    EXPECT_GT(psnr_of(map), 45);
}

TEST(Overhead, SuspectedBoxesHideGroundToo)
{
    SiteModel model = site(6, true);
    const Tiles tiles = tiles_of(model, plan_overhead(model));
    const OverheadMap firm = compose_overhead(model, tiles);
    model.suspected.swap(model.obstacles);
    EXPECT_EQ(cv::norm(firm.seen, compose_overhead(model, tiles).seen, cv::NORM_INF), 0);
}

TEST(Overhead, PlanCoversNearlyAllThatAnyViewSees)
{
    const SiteModel model = site(8, true);
    OverheadOptions all;
    all.max_views_per_tile = 8;
    all.min_gain = 1e-6;
    const OverheadMap most = compose_overhead(model, tiles_of(model, plan_overhead(model, all)), all);
    const OverheadMap map = compose_overhead(model, tiles_of(model, plan_overhead(model)));
    const double share = cv::countNonZero(map.seen) / static_cast<double>(cv::countNonZero(most.seen));
    EXPECT_GT(share, 0.95);
    // And each tile of ground that anybody sees is asked for at least once, none more often than allowed.
    std::map<std::pair<int, int>, int> asked;
    for (const TileRequest &request : plan_overhead(model)) {
        for (const oc_tile_id_t tile : request.tiles) asked[{tile.ix, tile.iy}]++;
    }
    std::map<std::pair<int, int>, int> wanted;
    for (const TileRequest &request : plan_overhead(model, all)) {
        for (const oc_tile_id_t tile : request.tiles) wanted[{tile.ix, tile.iy}]++;
    }
    EXPECT_EQ(asked.size(), wanted.size());
    for (const auto &[tile, n] : asked) EXPECT_LE(n, OverheadOptions().max_views_per_tile);
}

TEST(Overhead, ADifferentExposureIsEvenedOut)
{
    const SiteModel model = site(5, true);
    const std::vector<TileRequest> plan = plan_overhead(model);
    const OverheadMap even = compose_overhead(model, tiles_of(model, plan)),
                      odd = compose_overhead(model, tiles_of(model, plan, 0.75));
    // Up to one factor for the whole map.
    std::vector<double> ratios;
    for_each_cell(even, [&](double, double, int r, int c) {
        if (even.seen(r, c) && even.rgb(r, c)[0] > 60)
            ratios.push_back(odd.rgb(r, c)[0] / static_cast<double>(even.rgb(r, c)[0]));
    });
    std::sort(ratios.begin(), ratios.end());
    EXPECT_GT(ratios[ratios.size() / 50], 0.9 * ratios[ratios.size() / 2]);
    EXPECT_LT(ratios[ratios.size() * 49 / 50], 1.1 * ratios[ratios.size() / 2]);
}

TEST(Overhead, BadTilesAreSkippedAndCounted)
{
    const SiteModel model = site(4, false);
    const Tiles good = tiles_of(model, plan_overhead(model));
    const OverheadMap want = compose_overhead(model, good);
    Tiles tiles = good;
    const auto add = [&](std::int16_t ix, double scale, std::vector<std::uint8_t> bytes) {
        TileKey key = good.begin()->first;
        key.ix = ix;
        key.metres_per_pixel = scale;
        tiles[key] = TileBlob{OC_CODEC_WEBP, std::move(bytes)};
    };
    const double scale = good.begin()->first.metres_per_pixel;
    const std::vector<std::uint8_t> whole = good.begin()->second.bytes;
    add(100, scale, {});
    add(101, scale, {1, 2, 3});
    add(102, scale, {whole.begin(), whole.begin() + 40});
    add(103, 1e-12, whole); // would make a map of 10^12 pixels
    add(104, NAN, whole);
    add(105, -1, whole);
    cv::Mat3b small(20, 20, cv::Vec3b(1, 2, 3));
    std::vector<std::uint8_t> of_other_size;
    cv::imencode(".webp", small, of_other_size);
    add(106, scale, of_other_size);
    int n_bad = -1;
    const OverheadMap map = compose_overhead(model, tiles, {}, &n_bad);
    EXPECT_EQ(n_bad, 7);
    EXPECT_EQ(cv::norm(map.rgb, want.rgb, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(map.seen, want.seen, cv::NORM_INF), 0);
}

TEST(Overhead, TilesOfStrangeViewsPlacesAndScalesDoNoHarm)
{
    const SiteModel model = site(4, false);
    Tiles tiles = tiles_of(model, plan_overhead(model));
    const OverheadMap want = compose_overhead(model, tiles);
    TileKey key = tiles.begin()->first;
    const TileBlob blob = tiles.begin()->second;
    key.view = 999;
    tiles[key] = blob;
    key = tiles.begin()->first;
    key.metres_per_pixel *= 2;
    tiles[key] = blob;
    key = tiles.begin()->first;
    key.ix = 32767;
    key.iy = -32768;
    tiles[key] = blob;
    EXPECT_EQ(cv::norm(compose_overhead(model, tiles).rgb, want.rgb, cv::NORM_INF), 0);
}

TEST(Overhead, SameInputsGiveTheSamePlanAndMap)
{
    const SiteModel model = site(7, true);
    const std::vector<TileRequest> a = plan_overhead(model), b = plan_overhead(model);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); i++) {
        ASSERT_EQ(a[i].view, b[i].view);
        ASSERT_EQ(a[i].tiles.size(), b[i].tiles.size());
        for (std::size_t k = 0; k < a[i].tiles.size(); k++)
            EXPECT_TRUE(a[i].tiles[k].ix == b[i].tiles[k].ix && a[i].tiles[k].iy == b[i].tiles[k].iy);
    }
    const Tiles tiles = tiles_of(model, a);
    EXPECT_EQ(cv::norm(compose_overhead(model, tiles).rgb, compose_overhead(model, tiles).rgb, cv::NORM_INF), 0);
}

TEST(Overhead, NothingToSeeAndNowhereToLookGiveEmptyPlans)
{
    EXPECT_TRUE(plan_overhead(site(0, true)).empty());
    SiteModel model = site(3, false);
    model.area = {};
    EXPECT_TRUE(plan_overhead(model).empty());
    EXPECT_EQ(cv::countNonZero(compose_overhead(model, {}).seen), 0);
    model.area = {1e7, 1e7 + 2, 0, 2, 1}; // too far away for 16-bit tile numbers
    EXPECT_TRUE(plan_overhead(model).empty());
    model.area = {5000, 5002, 0, 2, 1};
    EXPECT_TRUE(plan_overhead(model).empty());
}

TEST(Overhead, OptionsOutOfRangeAreRefused)
{
    const SiteModel model = site(2, false);
    const auto refuses = [&](auto change) {
        OverheadOptions options;
        change(&options);
        EXPECT_THROW(plan_overhead(model, options), std::invalid_argument);
        EXPECT_THROW(compose_overhead(model, {}, options), std::invalid_argument);
    };
    refuses([](OverheadOptions *o) { o->metres_per_pixel = NAN; });
    refuses([](OverheadOptions *o) { o->pixels_per_side = 8; });
    refuses([](OverheadOptions *o) { o->tile_px = 300; });
    refuses([](OverheadOptions *o) { o->quality = 0; });
    refuses([](OverheadOptions *o) { o->max_views_per_tile = 0; });
    refuses([](OverheadOptions *o) { o->min_gain = NAN; });
}

TEST(BoxShadow, SegmentTestAgreesWithSteppingAlongIt)
{
    const SiteModel model = site(0, true);
    const Blocker blocker(model.obstacles[0], 0.02);
    const Obstacle &o = model.obstacles[0];
    int n_met = 0, n_missed = 0;
    for (int i = 0; i < 400; i++) {
        const Eigen::Vector3d from(1.6 * std::cos(i), 1.6 * std::sin(i), 0.9),
            to(std::sin(3.7 * i), std::cos(2.3 * i), 0);
        double deepest = -1; // how far inside the grown box the segment gets
        for (int k = 0; k <= 4000; k++) {
            const Eigen::Vector3d p = from + (to - from) * (k / 4000.0) - o.obb_centre;
            const double x = std::cos(o.yaw_rad) * p.x() + std::sin(o.yaw_rad) * p.y();
            const double y = -std::sin(o.yaw_rad) * p.x() + std::cos(o.yaw_rad) * p.y();
            deepest = std::max(deepest, std::min({0.27 - std::abs(x), 0.22 - std::abs(y), 0.22 - p.z(), p.z() + 0.2}));
        }
        if (std::abs(deepest) < 2e-3) continue; // grazes
        EXPECT_EQ(blocker.meets(from, to), deepest > 0) << i;
        (deepest > 0 ? n_met : n_missed)++;
    }
    EXPECT_GT(n_met, 50);
    EXPECT_GT(n_missed, 50);
}

} // namespace
} // namespace outcrop
