// SPDX-License-Identifier: BSD-3-Clause
// Photographed chessboards: junctions against given corners and against the board's straight lines.
#include "detector.h"
#include "eval/image_file.h"
#include "scenes.h"
#include "score.h"
#include "thesis.h"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>

namespace outcrop::bench {
namespace {

using nlohmann::json;

struct Lens {
    cv::Matx33d camera;
    std::vector<double> distortion;
};

// Where the lens makes a board line straight: normalised coordinates without distortion.
std::vector<cv::Point2d> straightened(const std::vector<cv::Point2d> &points, const Lens &lens)
{
    std::vector<cv::Point2d> plane;
    const cv::TermCriteria until(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 50, 1e-12);
    cv::undistortPoints(points, plane, lens.camera, lens.distortion, cv::noArray(), cv::noArray(), until);
    return plane;
}

cv::Point2d seen(const cv::Point2d &plane, const Lens &lens)
{
    std::vector<cv::Point2d> image;
    cv::projectPoints(std::vector<cv::Point3d>{{plane.x, plane.y, 1}}, cv::Vec3d(), cv::Vec3d(), lens.camera,
                      lens.distortion, image);
    return image.at(0);
}

struct Line {
    cv::Point2d point, direction; // a unit vector

    double gap(const cv::Point2d &other) const { return std::abs(direction.cross(other - point)); }
};

Line fit(const std::vector<cv::Point2d> &points)
{
    cv::Point2d middle(0, 0);
    for (const cv::Point2d &point : points) middle += point / static_cast<double>(points.size());
    double xx = 0, xy = 0, yy = 0;
    for (const cv::Point2d &point : points) {
        const cv::Point2d d = point - middle;
        xx += d.x * d.x;
        xy += d.x * d.y;
        yy += d.y * d.y;
    }
    const double angle = std::atan2(2 * xy, xx - yy) / 2;
    return {middle, {std::cos(angle), std::sin(angle)}};
}

cv::Point2d crossing(const Line &a, const Line &b)
{
    return a.point + a.direction * ((b.point - a.point).cross(b.direction) / a.direction.cross(b.direction));
}

struct Board {
    int columns, rows;
    std::vector<Line> along, up; // lines of the rows and of the columns, straightened
};

Board fit_board(const std::vector<cv::Point2d> &plane, int columns, int rows)
{
    Board board{columns, rows, {}, {}};
    const auto at = [&](int column, int row) { return plane[static_cast<std::size_t>(row * columns + column)]; };
    for (int row = 0; row < rows; row++) {
        std::vector<cv::Point2d> points;
        for (int column = 0; column < columns; column++) points.push_back(at(column, row));
        board.along.push_back(fit(points));
    }
    for (int column = 0; column < columns; column++) {
        std::vector<cv::Point2d> points;
        for (int row = 0; row < rows; row++) points.push_back(at(column, row));
        board.up.push_back(fit(points));
    }
    return board;
}

// Distances of corners from their two lines, px; a line bends with the lens but the scale there is the camera's.
void add_gaps(const Board &board, const std::vector<cv::Point2d> &plane, double focal_px, std::vector<double> &gaps)
{
    for (std::size_t i = 0; i < plane.size(); i++) {
        const std::size_t column = i % static_cast<std::size_t>(board.columns);
        const std::size_t row = i / static_cast<std::size_t>(board.columns);
        gaps.push_back(board.along[row].gap(plane[i]) * focal_px);
        gaps.push_back(board.up[column].gap(plane[i]) * focal_px);
    }
}

// The four directions in the image in which the board's lines leave their crossing.
TrueJunction true_junction(const Board &board, int column, int row, const Lens &lens)
{
    const Line &along = board.along[static_cast<std::size_t>(row)], &up = board.up[static_cast<std::size_t>(column)];
    const cv::Point2d plane = crossing(along, up);
    TrueJunction junction{seen(plane, lens), {}, true};
    const double step = 1 / lens.camera(0, 0); // a pixel
    for (const cv::Point2d &direction : {along.direction, -along.direction, up.direction, -up.direction}) {
        const cv::Point2d ray = seen(plane + step * direction, lens) - junction.at_px;
        junction.angle_rad.push_back(wrapped(std::atan2(ray.y, ray.x)));
    }
    return junction;
}

struct Sums {
    int n_corners = 0, n_found = 0;
    std::vector<double> to_given_px, to_lines_px, given_to_lines_px, own_gap_px, given_gap_px, angle_rad;
};

void add_view(const cv::Mat &grey, const std::vector<cv::Point2d> &given, int columns, int rows, const Lens &lens,
              Judoca &judoca, Sums &sums)
{
    const std::vector<Found> found = judoca.find(grey);
    std::vector<cv::Point2d> places;
    for (const Found &one : found) places.push_back(one.at_px);
    const std::vector<cv::Point2d> plane = straightened(given, lens);
    const Board board = fit_board(plane, columns, rows);
    std::vector<cv::Point2d> ours = given;
    const std::vector<Pairing> pairs = pair_points(given, places, kMatchPx);
    for (const Pairing &pair : pairs) {
        const Found &one = found[static_cast<std::size_t>(pair.found)];
        const TrueJunction truth = true_junction(board, pair.truth % columns, pair.truth / columns, lens);
        ours[static_cast<std::size_t>(pair.truth)] = one.at_px;
        sums.to_given_px.push_back(pair.distance);
        sums.to_lines_px.push_back(cv::norm(one.at_px - truth.at_px));
        sums.given_to_lines_px.push_back(cv::norm(given[static_cast<std::size_t>(pair.truth)] - truth.at_px));
        for (const Pairing &branch : pair_angles(truth.angle_rad, one.angle_rad, kMatchAngle))
            sums.angle_rad.push_back(branch.distance);
    }
    sums.n_corners += static_cast<int>(given.size());
    sums.n_found += static_cast<int>(pairs.size());
    if (pairs.size() != given.size()) return; // straightness only where nothing is filled in
    const std::vector<cv::Point2d> own_plane = straightened(ours, lens);
    add_gaps(fit_board(own_plane, columns, rows), own_plane, lens.camera(0, 0), sums.own_gap_px);
    add_gaps(board, plane, lens.camera(0, 0), sums.given_gap_px);
}

Lens lens_of(const json &view)
{
    return {{view.at("fx"), 0, view.at("cx"), 0, view.at("fy"), view.at("cy"), 0, 0, 1}, view.at("dist")};
}

json row_of(const std::string &method, int lambda, const Sums &sums, std::string &text)
{
    const auto rms = [](const std::vector<double> &values) { return values.empty() ? std::nan("") : rms_of(values); };
    const auto median = [](const std::vector<double> &v) { return v.empty() ? std::nan("") : median_of(v); };
    char line[200];
    std::snprintf(line, sizeof line, "%-7s %3d %6.3f  %6.3f %6.3f  %6.3f %6.3f  %6.3f  %6.3f %6.3f  %5.2f\n",
                  method.c_str(), lambda, static_cast<double>(sums.n_found) / sums.n_corners, rms(sums.to_given_px),
                  median(sums.to_given_px), rms(sums.to_lines_px), median(sums.to_lines_px),
                  rms(sums.given_to_lines_px), rms(sums.own_gap_px), rms(sums.given_gap_px),
                  rms(sums.angle_rad) / kDegree);
    text += line;
    return {{"method", method},
            {"lambda_px", lambda},
            {"corners", sums.n_corners},
            {"found", sums.n_found},
            {"to_given_rms_px", rms(sums.to_given_px)},
            {"to_given_median_px", median(sums.to_given_px)},
            {"to_lines_rms_px", rms(sums.to_lines_px)},
            {"to_lines_median_px", median(sums.to_lines_px)},
            {"given_to_lines_rms_px", rms(sums.given_to_lines_px)},
            {"own_gap_rms_px", rms(sums.own_gap_px)},
            {"given_gap_rms_px", rms(sums.given_gap_px)},
            {"angle_rms_deg", rms(sums.angle_rad) / kDegree}};
}

struct Photograph {
    cv::Mat grey;
    std::vector<cv::Point2d> given;
    Lens lens;
};

std::vector<Photograph> read_photographs(const std::filesystem::path &folder, const json &root)
{
    std::vector<Photograph> photographs;
    for (const json &view : root.at("views")) {
        const std::string image = view.at("image");
        Photograph one{eval::read_image(folder / "images" / image, cv::IMREAD_GRAYSCALE), {}, lens_of(view)};
        for (const json &corner : root.at("corners").at(image)) one.given.emplace_back(corner.at(0), corner.at(1));
        photographs.push_back(one);
    }
    return photographs;
}

} // namespace

json chess_stereo(const std::filesystem::path &folder)
{
    std::ifstream file(folder / "cameras.json");
    if (!file) return {{"skipped", true}, {"text", "photographed chessboards: SKIPPED, they are not there\n"}};
    const json root = json::parse(file);
    const int columns = root.at("pattern").at(0), rows = root.at("pattern").at(1);
    const std::vector<Photograph> photographs = read_photographs(folder, root);
    std::string text = "photographed chessboards: " + std::to_string(photographs.size()) +
                       " images; px to the given corners, to the crossings of lines fitted to these, from lines\n"
                       "fitted to the own corners (ours, given); angle to the lines\n"
                       "method  lam recall  given: rms, med  lines: rms, med (given)  straight: own, given  angle\n";
    json list = json::array();
    for (const int lambda : {0, 10, 15, 20}) {
        oc_judoca_params_t params = oc_judoca_defaults();
        if (lambda > 0) params.lambda_px = params.lambda_min_px = lambda;
        params.max_junctions = OC_MAX_JUNCTIONS;
        Judoca judoca(params);
        Sums sums;
        for (const Photograph &one : photographs) add_view(one.grey, one.given, columns, rows, one.lens, judoca, sums);
        list.push_back(row_of(lambda > 0 ? "fixed" : "grown", params.lambda_px, sums, text));
    }
    return {{"rows", list}, {"images", photographs.size()}, {"skipped", false}, {"text", text}};
}

} // namespace outcrop::bench
