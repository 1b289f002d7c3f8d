// SPDX-License-Identifier: BSD-3-Clause
#include "thesis.h"

#include "detector.h"
#include "eval/image_file.h"
#include "random.h"
#include "scenes.h"
#include "score.h"
#include "warp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>

namespace outcrop::bench {
namespace {

using nlohmann::json;

template <typename... Values>
std::string line(const char *format, Values... values)
{
    char text[200];
    std::snprintf(text, sizeof text, format, values...);
    return text;
}

const std::array<std::pair<const char *, oc_judoca_method_t>, 2> kMethods = {
    {{"thesis", OC_JUDOCA_THESIS}, {"ours", OC_JUDOCA_REFINED}}};

// The thesis' four, branches of one length, and room for all that is found.
oc_judoca_params_t params_of(oc_judoca_method_t method, double sigma_px, double t_b, int lambda_px, double s_j)
{
    oc_judoca_params_t params = oc_judoca_defaults();
    params.method = method;
    params.sigma_px = static_cast<float>(sigma_px);
    params.t_b = static_cast<float>(t_b);
    params.lambda_px = params.lambda_min_px = lambda_px;
    params.s_j = static_cast<float>(s_j);
    params.max_junctions = OC_MAX_JUNCTIONS;
    return params;
}

// ---- noise

constexpr double kLowContrast = 42; // its edges peak at 10 grey levels per px under sigma 1.5

// Upright and turned squares; the last one is the one of low contrast.
Scene noise_scene()
{
    Scene scene{{256, 256, 128, {}}, {}, 8};
    const struct {
        double x, y, half, turn_deg, contrast;
    } squares[] = {{70.3, 66.8, 34, 0, 100},
                   {182.6, 70.2, 30, 30, -80},
                   {72.1, 184.4, 32, 12, 60},
                   {184.2, 182.7, 34, 5, kLowContrast}};
    for (const auto &square : squares) {
        Polygon polygon{{}, 128 + square.contrast};
        for (int i = 0; i < 4; i++) {
            const double angle = (square.turn_deg + 45 + 90 * i) * kDegree, r = square.half * std::sqrt(2.0);
            polygon.vertex_px.emplace_back(square.x + r * std::cos(angle), square.y + r * std::sin(angle));
            scene.junctions.push_back({polygon.vertex_px.back(), {0, kPi / 2}, true});
        }
        scene.picture.polygons.push_back(polygon);
    }
    return scene;
}

struct NoiseCount {
    double n_found = 0, n_false = 0, n_true = 0, n_low = 0; // means over the seeds
};

NoiseCount count_under_noise(const Scene &scene, double variance, const oc_judoca_params_t &params)
{
    constexpr int kSeeds = 20;
    const cv::Mat clean = render(scene.picture);
    std::vector<cv::Point2d> truth;
    for (const TrueJunction &junction : scene.junctions) truth.push_back(junction.at_px);
    Judoca judoca(params);
    NoiseCount count;
    for (int i = 0; i < kSeeds; i++) {
        std::vector<cv::Point2d> found;
        for (const Found &one : judoca.find(with_noise(clean, variance, kSeed + static_cast<std::uint64_t>(i))))
            found.push_back(one.at_px);
        const std::vector<Pairing> pairs = pair_points(truth, found, 3);
        count.n_found += static_cast<double>(found.size()) / kSeeds;
        count.n_true += static_cast<double>(pairs.size()) / kSeeds;
        count.n_false += static_cast<double>(found.size() - pairs.size()) / kSeeds;
        for (const Pairing &pair : pairs) count.n_low += pair.truth >= 12 ? 1.0 / kSeeds : 0;
    }
    return count;
}

} // namespace

json thesis_noise()
{
    const struct {
        const char *figure;
        double variance, sigma_px, t_b;
    } cases[] = {{"3.2", 400, 1.0, 10}, {"3.2", 400, 1.5, 10}, {"3.3", 1000, 1.5, 10}, {"3.3", 1000, 1.5, 8}};
    json rows = json::array();
    std::string text = "figures 3.2 and 3.3: 4 squares, 16 corners, 4 of them of low contrast; lambda 10, s_j 0.5\n"
                       "figure method  var  sigma t_b   found   false corners low-contrast corners\n";
    const Scene scene = noise_scene();
    for (const auto &[name, method] : kMethods) {
        for (const auto &one : cases) {
            const NoiseCount count =
                count_under_noise(scene, one.variance, params_of(method, one.sigma_px, one.t_b, 10, 0.5));
            text += line("%-6s %-6s %5.0f %5.1f %4.0f %7.1f %7.1f %7.2f %7.2f\n", one.figure, name, one.variance,
                         one.sigma_px, one.t_b, count.n_found, count.n_false, count.n_true, count.n_low);
            rows.push_back({{"figure", one.figure},
                            {"method", name},
                            {"variance", one.variance},
                            {"sigma_px", one.sigma_px},
                            {"t_b", one.t_b},
                            {"found", count.n_found},
                            {"false", count.n_false},
                            {"corners", count.n_true},
                            {"low_corners", count.n_low}});
        }
    }
    return {{"rows", rows}, {"low_contrast", kLowContrast}, {"text", text}};
}

// ---- triangle

namespace {

// Views of one triangle from all round, leant by up to 55 degrees, all of it in the image and no angle below 25.
std::vector<Scene> triangle_views()
{
    constexpr int kViews = 28, kSidePx = 220;
    const std::vector<cv::Point2d> triangle = {{-62, 48}, {70, 40}, {-8, -72}};
    Random random(kSeed + 35);
    std::vector<Scene> views;
    while (views.size() < kViews) {
        const cv::Matx33d view = about_middle(rotation_deg(random.uniform(0, 360)) *
                                                  tilt_deg(random.uniform(0, 55), random.uniform(0, 360)) *
                                                  scaling(random.uniform(0.85, 1.15)),
                                              kSidePx, kSidePx);
        Scene scene{{kSidePx, kSidePx, 190, {{{}, 70}}}, {}, 8};
        std::vector<cv::Point2d> &vertex = scene.picture.polygons[0].vertex_px;
        const cv::Point2d middle((kSidePx - 1) / 2.0, (kSidePx - 1) / 2.0);
        for (const cv::Point2d &corner : triangle) vertex.push_back(transformed(corner + middle, view));
        bool is_good = true;
        for (std::size_t i = 0; i < 3; i++) {
            const cv::Point2d a = vertex[(i + 1) % 3] - vertex[i], b = vertex[(i + 2) % 3] - vertex[i];
            const double angle = turn_between(std::atan2(a.y, a.x), std::atan2(b.y, b.x));
            is_good = is_good && angle > 25 * kDegree && cv::norm(a) > 60 && std::min(vertex[i].x, vertex[i].y) > 28 &&
                      std::max(vertex[i].x, vertex[i].y) < kSidePx - 29;
            scene.junctions.push_back({vertex[i], {std::atan2(a.y, a.x), std::atan2(b.y, b.x)}, true});
        }
        if (is_good) views.push_back(scene);
    }
    return views;
}

} // namespace

json thesis_triangle()
{
    constexpr double kVariance = 25; // of a good camera
    const std::vector<Scene> views = triangle_views();
    std::vector<cv::Mat> images;
    for (const Scene &view : views)
        images.push_back(with_noise(render(view.picture), kVariance, kSeed + images.size()));
    json rows = json::array();
    std::string text = "figure 3.5: sum of a triangle's angles in 28 views, noise variance 25, sigma 1.2, t_b 6\n"
                       "method lambda    mean     sd  views with all three corners\n";
    for (const auto &[name, method] : kMethods) {
        for (int lambda = 8; lambda <= OC_JUDOCA_MAX_LAMBDA_PX; lambda++) {
            Judoca judoca(params_of(method, 1.2, 6, lambda, 0.6));
            std::vector<double> sums_deg;
            for (std::size_t i = 0; i < views.size(); i++) {
                double sum_deg;
                if (sum_of_angles(views[i], judoca.find(images[i]), &sum_deg)) sums_deg.push_back(sum_deg);
            }
            if (sums_deg.empty()) continue;
            text += line("%-6s %6d %7.2f %6.2f %3zu\n", name, lambda, mean_of(sums_deg), deviation_of(sums_deg),
                         sums_deg.size());
            rows.push_back({{"method", name},
                            {"lambda_px", lambda},
                            {"mean_deg", mean_of(sums_deg)},
                            {"sd_deg", deviation_of(sums_deg)},
                            {"n", sums_deg.size()}});
        }
    }
    return {{"rows", rows}, {"variance", kVariance}, {"text", text}};
}

// ---- chessboard

namespace {

constexpr int kBins = 19; // 5 degrees each, middles -45..45 and 45..135
constexpr double kBinDeg = 5;

// Rows of squares run towards -5 degrees, columns towards 90; perspective turns both by a few degrees.
Scene histogram_scene()
{
    constexpr int kSquares = 9;
    constexpr double kSquarePx = 34;
    const double c = std::cos(-5 * kDegree), s = std::sin(-5 * kDegree);
    const cv::Matx33d view = cv::Matx33d(1, 0, 200, 0, 1, 200, 0, 0, 1) *
                             cv::Matx33d(kSquarePx * c, 0, 0, kSquarePx * s, kSquarePx, 0, 0.004, 0.004, 1);
    Scene scene{{400, 400, 120, {}}, {}, 8};
    const auto corner = [&](int column, int row) {
        return transformed(cv::Point2d(column - kSquares / 2.0, row - kSquares / 2.0), view);
    };
    for (int row = 0; row < kSquares; row++) {
        for (int column = 0; column < kSquares; column++) {
            scene.picture.polygons.push_back(
                {{corner(column, row), corner(column + 1, row), corner(column + 1, row + 1), corner(column, row + 1)},
                 (row + column) % 2 == 0 ? 60.0 : 180.0});
        }
    }
    return scene;
}

// Bin of a direction, of which 180 degrees more is the same, on an axis that begins at low_deg; -1 outside.
int bin_of(double angle_rad, double low_deg)
{
    const double from_low = std::fmod(angle_rad / kDegree - low_deg + 360 + kBinDeg / 2, 180);
    const int bin = static_cast<int>(from_low / kBinDeg);
    return bin < kBins ? bin : -1;
}

json histogram(const std::vector<Found> &found)
{
    std::vector<std::vector<int>> count(kBins, std::vector<int>(kBins));
    int n_near = 0, n_all = 0;
    for (const Found &junction : found) {
        for (const double level : junction.angle_rad) {
            for (const double upright : junction.angle_rad) {
                const int across = bin_of(level, -45), up = bin_of(upright, 45);
                if (across < 0 || up < 0 || turn_between(level, upright) < 0.1) continue;
                count[static_cast<std::size_t>(up)][static_cast<std::size_t>(across)]++;
                n_all++;
                // Bins 8 and 9 are those of -5 and 90 degrees.
                if (std::abs(across - 8) <= 1 && std::abs(up - 9) <= 1) n_near++;
            }
        }
    }
    int best = 0, best_across = 0, best_up = 0;
    for (int up = 0; up < kBins; up++) {
        for (int across = 0; across < kBins; across++) {
            const int here = count[static_cast<std::size_t>(up)][static_cast<std::size_t>(across)];
            if (here > best) {
                best = here;
                best_across = across;
                best_up = up;
            }
        }
    }
    return {{"count", count},
            {"peak_deg", {-45 + kBinDeg * best_across, 45 + kBinDeg * best_up}},
            {"peak", best},
            {"pairs", n_all},
            {"near", n_all > 0 ? static_cast<double>(n_near) / n_all : 0.0},
            {"junctions", found.size()}};
}

} // namespace

json thesis_chess()
{
    const cv::Mat image = with_noise(render(histogram_scene().picture), 25, kSeed);
    json result;
    std::string text = "figure 3.6: chessboard, sigma 1.0, t_b 10, lambda 15, s_j 0.5; thesis: peak at (-5, 90)\n";
    for (const auto &[name, method] : kMethods) {
        const json one = histogram(Judoca(params_of(method, 1.0, 10, 15, 0.5)).find(image));
        text += line("%-6s peak at (%.0f, %.0f) with %d of %d pairs, %.3f within a bin of it, %d junctions\n", name,
                     one.at("peak_deg").at(0).get<double>(), one.at("peak_deg").at(1).get<double>(),
                     one.at("peak").get<int>(), one.at("pairs").get<int>(), one.at("near").get<double>(),
                     one.at("junctions").get<int>());
        result[name] = one;
    }
    result["bin_deg"] = kBinDeg;
    result["text"] = text;
    return result;
}

// ---- straight lines

namespace {

// How far from straight: of each junction of three or more branches the pair nearest to 180 degrees, within 20.
std::vector<double> bends_deg(const std::vector<Found> &found)
{
    std::vector<double> bends;
    for (const Found &junction : found) {
        if (junction.angle_rad.size() < 3) continue;
        double least = 20;
        for (const double a : junction.angle_rad) {
            for (const double b : junction.angle_rad)
                least = std::min(least, std::abs(180 - turn_between(a, b) / kDegree));
        }
        if (least < 20) bends.push_back(least);
    }
    return bends;
}

} // namespace

json thesis_lines(const std::vector<std::filesystem::path> &sites)
{
    std::optional<std::filesystem::path> folder;
    for (const std::filesystem::path &parent : sites) {
        if (!folder && std::filesystem::is_directory(parent / "cubes" / "images")) folder = parent / "cubes" / "images";
    }
    if (!folder) return {{"skipped", true}, {"text", "figure 3.10: SKIPPED, the site cubes is not there\n"}};
    json rows = json::array();
    std::string text = "figure 3.10: site cubes, sigma 1.2, t_b 8, lambda 10, s_j 0.5; thesis: views e and f, 322 and "
                       "301 junctions,\nfour lines of junctions 1 and 2 off by 5.09, 5.39, 0 and 7.26 degrees\n"
                       "method view junctions lines  off: median   mean    rms deg\n";
    for (const auto &[name, method] : kMethods) {
        Judoca judoca(params_of(method, 1.2, 8, 10, 0.5));
        for (int view = 0; view < 8; view++) {
            const auto file = eval::find_image(*folder / eval::numbered("view_", static_cast<std::size_t>(view)));
            if (!file) continue;
            const std::vector<Found> found = judoca.find(eval::read_image(*file, cv::IMREAD_GRAYSCALE));
            const std::vector<double> bends = bends_deg(found);
            if (bends.empty()) continue;
            text += line("%-6s    %c %9zu %5zu %12.2f %6.2f %6.2f\n", name, 'a' + view, found.size(), bends.size(),
                         median_of(bends), mean_of(bends), rms_of(bends));
            rows.push_back({{"method", name},
                            {"view", std::string(1, static_cast<char>('a' + view))},
                            {"junctions", found.size()},
                            {"lines", bends.size()},
                            {"median_deg", median_of(bends)},
                            {"mean_deg", mean_of(bends)},
                            {"rms_deg", rms_of(bends)}});
        }
    }
    return {{"rows", rows}, {"skipped", false}, {"text", text}};
}

} // namespace outcrop::bench
