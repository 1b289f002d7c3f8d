// SPDX-License-Identifier: BSD-3-Clause
#include "images.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

namespace outcrop::bench {

namespace {

// Scan lines per pixel row of a drawn polygon; along a scan line coverage is exact. (cv::fillPoly paints its outline as
// well, which makes every shape a tenth of a pixel too large.)
constexpr int kScanLines = 8;

// What a lens adds to a drawn picture.
constexpr double kOpticalBlurPx = 0.7;

// One polygon per so many pixels, whatever the size: as many corners per area at 640x480 as at 1920x1080.
constexpr int kAreaPerPolygonPx = 7500;

// Adds the span [from, to) of one scan line to a row of coverage, ends in part.
void add_span(cv::Mat &coverage, int y, double from, double to)
{
    from = std::max(from, 0.0);
    to = std::min(to, static_cast<double>(coverage.cols));
    for (int x = static_cast<int>(from); x < to; x++) {
        const double part = std::min(to, x + 1.0) - std::max(from, static_cast<double>(x));
        coverage.at<float>(y, x) += static_cast<float>(part / kScanLines);
    }
}

// Share of every pixel inside the polygon (even-odd); pixel (x, y) is the square from (x, y) to (x + 1, y + 1).
cv::Mat coverage_of(const std::vector<cv::Point2d> &polygon, cv::Size size)
{
    cv::Mat coverage = cv::Mat::zeros(size, CV_32F);
    std::vector<double> crossings;
    for (int line = 0; line < size.height * kScanLines; line++) {
        const double y = (line + 0.5) / kScanLines;
        crossings.clear();
        for (std::size_t i = 0; i < polygon.size(); i++) {
            const cv::Point2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
            if ((a.y <= y) != (b.y <= y)) crossings.push_back(a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x));
        }
        std::sort(crossings.begin(), crossings.end());
        for (std::size_t i = 0; i + 1 < crossings.size(); i += 2)
            add_span(coverage, line / kScanLines, crossings[i], crossings[i + 1]);
    }
    return coverage;
}

void paint(cv::Mat &picture, const std::vector<cv::Point2d> &polygon, float level)
{
    const cv::Rect all(0, 0, picture.cols, picture.rows);
    std::vector<cv::Point2f> outline(polygon.begin(), polygon.end());
    cv::Rect box = cv::boundingRect(outline);
    box = (box + cv::Size(2, 2)) & all;
    if (box.empty()) return;

    std::vector<cv::Point2d> moved;
    for (const cv::Point2d &p : polygon) moved.emplace_back(p.x - box.x, p.y - box.y);
    const cv::Mat share = coverage_of(moved, box.size());
    cv::Mat part = picture(box);
    part += share.mul(level - part);
}

cv::Mat finish(const cv::Mat &picture, double noise, std::mt19937 &random)
{
    cv::Mat blurred, grey;
    cv::GaussianBlur(picture, blurred, {}, kOpticalBlurPx);
    if (noise > 0) {
        std::normal_distribution<float> normal(0.0f, static_cast<float>(noise));
        for (int y = 0; y < blurred.rows; y++)
            for (int x = 0; x < blurred.cols; x++) blurred.at<float>(y, x) += normal(random);
    }
    blurred.convertTo(grey, CV_8U);
    return grey;
}

// Triangles to pentagons, star-shaped round their middle, of any grey, one over the other.
cv::Mat draw_polygons(cv::Size size, double noise)
{
    std::mt19937 random(1);
    std::uniform_real_distribution<double> part(0.0, 1.0);
    cv::Mat picture(size, CV_32F, cv::Scalar(128));
    for (int i = 0; i < size.area() / kAreaPerPolygonPx; i++) {
        const cv::Point2d middle(part(random) * size.width, part(random) * size.height);
        const int n = 3 + static_cast<int>(part(random) * 3);
        const double turn = part(random) * 2 * CV_PI;
        std::vector<cv::Point2d> polygon;
        for (int k = 0; k < n; k++) {
            const double angle = turn + (k + 0.6 * part(random)) * 2 * CV_PI / n;
            const double radius = 20 + 70 * part(random);
            polygon.emplace_back(middle.x + radius * std::cos(angle), middle.y + radius * std::sin(angle));
        }
        paint(picture, polygon, static_cast<float>(20 + 215 * part(random)));
    }
    return finish(picture, noise, random);
}

// A board of 12 by 9 squares seen at an angle; its squares grow with the picture.
cv::Mat draw_chessboard(cv::Size size)
{
    const double w = size.width, h = size.height;
    const cv::Point2f board[4] = {{0, 0}, {12, 0}, {12, 9}, {0, 9}};
    const cv::Point2f seen[4] = {{static_cast<float>(.10 * w), static_cast<float>(.12 * h)},
                                 {static_cast<float>(.92 * w), static_cast<float>(.06 * h)},
                                 {static_cast<float>(.84 * w), static_cast<float>(.94 * h)},
                                 {static_cast<float>(.05 * w), static_cast<float>(.82 * h)}};
    const cv::Mat image_from_board = cv::getPerspectiveTransform(board, seen);
    cv::Mat picture(size, CV_32F, cv::Scalar(200));
    for (int row = 0; row < 9; row++) {
        for (int col = row % 2; col < 12; col += 2) {
            const double x = col, y = row;
            std::vector<cv::Point2d> corners = {{x, y}, {x + 1, y}, {x + 1, y + 1}, {x, y + 1}};
            cv::perspectiveTransform(corners, corners, image_from_board);
            paint(picture, corners, 40);
        }
    }
    std::mt19937 random(2);
    return finish(picture, 0, random);
}

// Every pixel by itself: everything is an edge.
cv::Mat draw_noise(cv::Size size)
{
    std::mt19937 random(3);
    cv::Mat grey(size, CV_8U);
    for (int y = 0; y < size.height; y++)
        for (int x = 0; x < size.width; x++) grey.at<uchar>(y, x) = static_cast<uchar>(random() >> 24);
    return grey;
}

// The largest part of the size's shape about the middle, resized.
cv::Mat fit(const cv::Mat &photograph, cv::Size size)
{
    const double scale =
        std::max(static_cast<double>(size.width) / photograph.cols, static_cast<double>(size.height) / photograph.rows);
    const int width = std::min(photograph.cols, static_cast<int>(std::lround(size.width / scale)));
    const int height = std::min(photograph.rows, static_cast<int>(std::lround(size.height / scale)));
    const cv::Mat part =
        photograph(cv::Rect((photograph.cols - width) / 2, (photograph.rows - height) / 2, width, height));
    cv::Mat fitted;
    cv::resize(part, fitted, size, 0, 0, scale > 1 ? cv::INTER_CUBIC : cv::INTER_AREA);
    return fitted;
}

cv::Mat find_photograph(const std::string &site, const std::string &name, const std::vector<std::string> &sites)
{
    for (const std::string &directory : sites) {
        for (const char *suffix : {".png", ".jpg"}) {
            const auto path = std::filesystem::path(directory) / site / "images" / (name + suffix);
            if (!std::filesystem::exists(path)) continue;
            cv::Mat grey = cv::imread(path.string(), cv::IMREAD_GRAYSCALE);
            if (!grey.empty()) return grey;
        }
    }
    return {};
}

const std::pair<const char *, const char *> kPhotographs[] = {
    {"real_fountain", "0000"},       {"real_fountain", "0006"}, {"real_banana", "DSC_0431"},
    {"real_temple", "templeSR0001"}, {"depot", "view_00"},      {"two_obstacles", "view_03"},
};

// The photographs side by side at their own scale, as often as it takes: detail as fine as in the originals.
cv::Mat make_mosaic(const std::vector<cv::Mat> &photographs, cv::Size size)
{
    cv::Mat mosaic(size, CV_8U, cv::Scalar(0));
    std::size_t next = 0;
    for (int y = 0; y < size.height; y += 480) {
        for (int x = 0; x < size.width; x += 640) {
            const cv::Rect place = cv::Rect(x, y, 640, 480) & cv::Rect({0, 0}, size);
            const cv::Mat tile = fit(photographs[next++ % photographs.size()], {640, 480});
            tile(cv::Rect({0, 0}, place.size())).copyTo(mosaic(place));
        }
    }
    return mosaic;
}

} // namespace

const char *name_of(Kind kind)
{
    switch (kind) {
    case Kind::kStructured: return "structured";
    case Kind::kNatural: return "natural";
    case Kind::kNoise: return "noise";
    }
    return "";
}

std::vector<Picture> make_pictures(cv::Size size, const std::vector<std::string> &sites,
                                   std::vector<std::string> &missing)
{
    std::vector<Picture> pictures = {
        {"polygons", Kind::kStructured, draw_polygons(size, 0)},
        {"polygons_sd5", Kind::kStructured, draw_polygons(size, 5)},
        {"chessboard", Kind::kStructured, draw_chessboard(size)},
    };
    std::vector<cv::Mat> photographs;
    for (const auto &[site, name] : kPhotographs) {
        const cv::Mat photograph = find_photograph(site, name, sites);
        const std::string label = std::string(site) + "/" + name;
        if (photograph.empty()) {
            missing.push_back(label);
            continue;
        }
        photographs.push_back(photograph);
        pictures.push_back({label, Kind::kNatural, fit(photograph, size)});
    }
    if (size.width > 640 && !photographs.empty())
        pictures.push_back({"mosaic", Kind::kNatural, make_mosaic(photographs, size)});
    pictures.push_back({"noise", Kind::kNoise, draw_noise(size)});
    return pictures;
}

} // namespace outcrop::bench
