// SPDX-License-Identifier: BSD-3-Clause
// Poses: the sensors', fundamental matrices by sampling, and ours, against true points.
#include "poses.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>

#include "core/epipolar.h"
#include "core/homography.h"
#include "core/plane.h"
#include "site/fundamental.h"
#include "site/model.h"

namespace outcrop::bench {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;
using Matrix3rm = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

constexpr int kStepPx = 12;
constexpr const char *kSources[] = {"sensor",    "F, seven points",     "F, seven points with ties",
                                    "F, MAGSAC", "F, MAGSAC with ties", "ours"};

double ms_since(Clock::time_point begin)
{
    return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

struct TruePoints {
    std::vector<PixelPair> all, ground;
};

TruePoints true_points(const eval::Truth &truth, std::size_t l, std::size_t r)
{
    const eval::Camera &left = truth.views[l], &right = truth.views[r];
    TruePoints out;
    for (int y = kStepPx / 2; y < left.height; y += kStepPx) {
        for (int x = kStepPx / 2; x < left.width; x += kStepPx) {
            const double depth = static_cast<double>(truth.depth[l]->depth_m.at<float>(y, x));
            if (!(depth > 0)) continue;
            const Eigen::Vector2d px(x, y);
            const auto at = right.project(left.centre_m() + depth * left.ray(px));
            if (!at || !right.inside(at->pixel) || !eval::is_visible(*truth.depth[r], *at)) continue;
            out.all.push_back({px, at->pixel});
            if (truth.depth[l]->mask.at<std::uint8_t>(y, x) == eval::kMaskGround) out.ground.push_back({px, at->pixel});
        }
    }
    return out;
}

void add_epipolar(const Eigen::Matrix3d &F, const std::vector<PixelPair> &points, PoseErrors *errors)
{
    errors->n_pairs++;
    for (const PixelPair &point : points) {
        const double off = std::abs(epipolar_distance_px(F, point));
        if (std::isfinite(off)) errors->epipolar_px.push_back(off);
    }
}

void add_cameras(const oc_camera_t &left, const oc_camera_t &right, const TruePoints &points, PoseErrors *errors)
{
    Matrix3rm F;
    double H[9];
    if (oc_epipolar_fundamental(&left, &right, F.data()) == OC_OK) add_epipolar(F, points.all, errors);
    if (oc_plane_ground_homography(&left, &right, H) != OC_OK) return;
    for (const PixelPair &point : points.ground) {
        double x = 0, y = 0;
        if (!(oc_homography_apply(H, point.left_px.x(), point.left_px.y(), &x, &y) > 0)) continue;
        errors->ground_transfer_px.push_back((Eigen::Vector2d(x, y) - point.right_px).norm());
    }
}

// Matches of a pair with the sensors' poses.
std::vector<PixelPair> matches_of(const PreparedView &left, const PreparedView &right, const Area &area)
{
    std::vector<PixelPair> out;
    for (const Match &m : match_pair(left, right, area).pair.matches) {
        const oc_junction_t &a = left.junction(m.left_junction), &b = right.junction(m.right_junction);
        out.push_back({{a.x_px, a.y_px}, {b.x_px, b.y_px}});
    }
    return out;
}

// The vehicle's ground ties between the two views.
void add_ties(const View &left, const View &right, std::vector<PixelPair> *out)
{
    for (const oc_tie_t &tie : right.ties)
        if (tie.ref_view == left.id) out->push_back({{tie.ref_x_px, tie.ref_y_px}, {tie.x_px, tie.y_px}});
    for (const oc_tie_t &tie : left.ties)
        if (tie.ref_view == right.id) out->push_back({{tie.x_px, tie.y_px}, {tie.ref_x_px, tie.ref_y_px}});
}

// Both ways to an F of these matches, into the errors of their names.
void add_sampled(const std::vector<PixelPair> &matches, const std::string &with, const TruePoints &points,
                 std::map<std::string, PoseErrors> *by_source)
{
    PoseErrors &seven = (*by_source)["F, seven points" + with], &magsac = (*by_source)["F, MAGSAC" + with];
    auto start = Clock::now();
    if (const auto fit = fundamental_by_seven_points(matches)) add_epipolar(fit->F, points.all, &seven);
    seven.ms += ms_since(start);
    start = Clock::now();
    if (const auto fit = fundamental_by_magsac(matches)) add_epipolar(fit->F, points.all, &magsac);
    magsac.ms += ms_since(start);
}

double turn_between(const oc_camera_t &a, const oc_camera_t &b)
{
    const Eigen::Matrix3d turn = camera_rotation(a) * camera_rotation(b).transpose();
    return Eigen::AngleAxisd(turn).angle();
}

Json source_json(const std::string &name, const PoseErrors &errors)
{
    const auto value = [](const std::vector<double> &values, double share) {
        return values.empty() ? Json(nullptr) : Json(quantile(values, share));
    };
    return {{"source", name},
            {"pairs", errors.n_pairs},
            {"epipolar_median_px", value(errors.epipolar_px, 0.5)},
            {"epipolar_p90_px", value(errors.epipolar_px, 0.9)},
            {"ground_median_px", value(errors.ground_transfer_px, 0.5)},
            {"ground_p90_px", value(errors.ground_transfer_px, 0.9)},
            {"ms", errors.ms}};
}

void append(std::vector<double> *to, const std::vector<double> &values)
{
    to->insert(to->end(), values.begin(), values.end());
}

// What is left of the centres' errors when all of them together move over the plane and turn about the vertical: that
// changes no picture, so no picture can mend it.
std::vector<double> aligned_errors(const std::vector<Eigen::Vector3d> &found, const std::vector<Eigen::Vector3d> &truth)
{
    Eigen::Vector3d mean_f = Eigen::Vector3d::Zero(), mean_t = mean_f;
    for (std::size_t i = 0; i < found.size(); i++) {
        mean_f += found[i] / static_cast<double>(found.size());
        mean_t += truth[i] / static_cast<double>(found.size());
    }
    double cross = 0, dot = 0;
    for (std::size_t i = 0; i < found.size(); i++) {
        const Eigen::Vector3d f = found[i] - mean_f, t = truth[i] - mean_t;
        cross += f.x() * t.y() - f.y() * t.x();
        dot += f.x() * t.x() + f.y() * t.y();
    }
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(std::atan2(cross, dot), Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const Eigen::Vector3d mean_off(mean_t.x() - mean_f.x(), mean_t.y() - mean_f.y(), 0);
    std::vector<double> out;
    for (std::size_t i = 0; i < found.size(); i++)
        out.push_back((turn * (found[i] - mean_f) + mean_f + mean_off - truth[i]).norm());
    return out;
}

double rmse(const std::vector<double> &values)
{
    double sum = 0;
    for (const double v : values) sum += v * v;
    return values.empty() ? NAN : std::sqrt(sum / static_cast<double>(values.size()));
}

} // namespace

double quantile(std::vector<double> values, double share)
{
    if (values.empty()) return NAN;
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1) + 0.5);
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

PoseCase measure_poses(const SiteCase &site)
{
    PoseCase out;
    const auto begin = Clock::now();
    const SiteModel model = build_site(site.views, site.area);
    out.by_source["ours"].ms = ms_since(begin);

    std::vector<PosedView> posed;
    std::vector<std::unique_ptr<PreparedView>> prepared;
    for (const View &view : site.views) posed.push_back(as_reported(view));
    for (const PosedView &view : posed) prepared.push_back(std::make_unique<PreparedView>(view, CorrelateOptions()));
    for (const ViewPair &pair : select_pairs(posed, site.area)) {
        const auto l = static_cast<std::size_t>(pair.left), r = static_cast<std::size_t>(pair.right);
        const TruePoints points = true_points(site.truth, static_cast<std::size_t>(site.views[l].id),
                                              static_cast<std::size_t>(site.views[r].id));
        add_cameras(site.views[l].camera, site.views[r].camera, points, &out.by_source["sensor"]);
        add_cameras(model.views[l].camera, model.views[r].camera, points, &out.by_source["ours"]);
        std::vector<PixelPair> matches = matches_of(*prepared[l], *prepared[r], site.area);
        add_sampled(matches, "", points, &out.by_source);
        add_ties(site.views[l], site.views[r], &matches);
        add_sampled(matches, " with ties", points, &out.by_source);
    }
    std::vector<Eigen::Vector3d> sensor, ours, truly;
    for (std::size_t i = 0; i < site.views.size(); i++) {
        const oc_camera_t truth = true_camera(site, site.views[i].id);
        sensor.push_back(camera_centre(site.views[i].camera));
        ours.push_back(camera_centre(model.views[i].camera));
        truly.push_back(camera_centre(truth));
        out.sensor_m.push_back((sensor.back() - truly.back()).norm());
        out.ours_m.push_back((ours.back() - truly.back()).norm());
        out.sensor_rad.push_back(turn_between(site.views[i].camera, truth));
        out.ours_rad.push_back(turn_between(model.views[i].camera, truth));
    }
    out.sensor_aligned_m = aligned_errors(sensor, truly);
    out.ours_aligned_m = aligned_errors(ours, truly);
    return out;
}

Json summary_of(const std::string &site, const std::vector<std::string> &poses, const std::vector<PoseCase> &cases)
{
    PoseCase all;
    for (const PoseCase &one : cases) {
        for (const auto &[name, errors] : one.by_source) {
            PoseErrors &sum = all.by_source[name];
            append(&sum.epipolar_px, errors.epipolar_px);
            append(&sum.ground_transfer_px, errors.ground_transfer_px);
            sum.n_pairs += errors.n_pairs;
            sum.ms += errors.ms / static_cast<double>(cases.size());
        }
        append(&all.sensor_m, one.sensor_m);
        append(&all.ours_m, one.ours_m);
        append(&all.sensor_aligned_m, one.sensor_aligned_m);
        append(&all.ours_aligned_m, one.ours_aligned_m);
        append(&all.sensor_rad, one.sensor_rad);
        append(&all.ours_rad, one.ours_rad);
    }
    Json sources = Json::array();
    for (const char *name : kSources) {
        sources.push_back(source_json(name, all.by_source[name]));
        const Json &row = sources.back();
        std::printf("  %-26s epipolar %s / %s px, ground %s px\n", name, row["epipolar_median_px"].dump().c_str(),
                    row["epipolar_p90_px"].dump().c_str(), row["ground_median_px"].dump().c_str());
    }
    const double before = rmse(all.sensor_m), after = rmse(all.ours_m);
    const double before_aligned = rmse(all.sensor_aligned_m), after_aligned = rmse(all.ours_aligned_m);
    std::printf("  %s: centres %.2f mm to %.2f mm; but for a common shift and turn %.2f mm to %.2f mm\n", site.c_str(),
                before * 1e3, after * 1e3, before_aligned * 1e3, after_aligned * 1e3);
    constexpr double kDegrees = 180 / 3.14159265358979323846;
    return {{"site", site},
            {"poses", poses},
            {"sources", sources},
            {"position_rmse_m", {before, after}},
            {"position_cut", before / after},
            {"position_aligned_rmse_m", {before_aligned, after_aligned}},
            {"position_aligned_cut", before_aligned / after_aligned},
            {"angle_rmse_deg", {rmse(all.sensor_rad) * kDegrees, rmse(all.ours_rad) * kDegrees}}};
}

} // namespace outcrop::bench
