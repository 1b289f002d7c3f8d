// SPDX-License-Identifier: BSD-3-Clause
#include "scenes.h"

#include "core/junction.h"
#include "random.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace outcrop::bench {
namespace {

constexpr int kCellPx = 72;
constexpr double kCellMarginPx = 8;
constexpr double kFarPx = 200; // beyond a cell's corners
constexpr int kWidthPx = 640, kHeightPx = 480;
constexpr double kMinContrast = 25, kMaxContrast = 120, kMinLevel = 20, kMaxLevel = 235;
constexpr double kMinAngle = 25 * kDegree, kMaxAngle = 155 * kDegree;

bool is_contrast(double a, double b)
{
    return std::abs(a - b) >= kMinContrast && std::abs(a - b) <= kMaxContrast;
}

double level_beside(Random &random, double other)
{
    for (;;) {
        const double contrast = random.uniform(kMinContrast, kMaxContrast);
        const double level = other + (random.below(2) == 0 ? contrast : -contrast);
        if (level >= kMinLevel && level <= kMaxLevel) return level;
    }
}

// ---- cells

// The turns from each branch to the next, summing to 2 pi.
std::vector<double> draw_gaps(Random &random, int n_branches, bool is_t)
{
    if (n_branches == 2) {
        const double inner = random.uniform(kMinAngle, kMaxAngle);
        return {inner, 2 * kPi - inner};
    }
    if (is_t) {
        const double inner = random.uniform(kMinAngle, kMaxAngle);
        return {kPi, inner, kPi - inner};
    }
    for (;;) {
        std::vector<double> gap;
        double rest = 2 * kPi;
        for (int i = 1; i < n_branches; i++) {
            gap.push_back(random.uniform(kMinAngle, kMaxAngle));
            rest -= gap.back();
        }
        gap.push_back(rest);
        if (rest >= kMinAngle && rest <= kMaxAngle) return gap;
    }
}

// Steps of uniform contrast up or down from sector to sector, then shifted to a place within the range: a draw of
// levels would favour low contrasts.
std::vector<double> draw_levels(Random &random, int n)
{
    for (;;) {
        std::vector<double> level = {0};
        for (int i = 1; i < n; i++) {
            const double contrast = random.uniform(kMinContrast, kMaxContrast);
            level.push_back(level.back() + (random.below(2) == 0 ? contrast : -contrast));
        }
        const auto [low, high] = std::minmax_element(level.begin(), level.end());
        const double room = kMaxLevel - kMinLevel - (*high - *low);
        if (room < 0 || !is_contrast(level.front(), level.back())) continue;
        const double shift = kMinLevel - *low + random.uniform(0, room);
        for (double &grey : level) grey += shift;
        return level;
    }
}

Polygon sector(const cv::Point2d &apex, double from, double gap, double level)
{
    Polygon polygon{{apex}, level};
    const int n = 1 + static_cast<int>(gap / (kPi / 2));
    for (int i = 0; i <= n; i++) {
        const double angle = from + gap * i / n;
        polygon.vertex_px.emplace_back(apex.x + kFarPx * std::cos(angle), apex.y + kFarPx * std::sin(angle));
    }
    return polygon;
}

Scene make_cell(Random &random, int n_branches, bool is_t)
{
    const double middle = (kCellPx - 1) / 2.0;
    const cv::Point2d apex(middle + random.uniform(-1, 1), middle + random.uniform(-1, 1));
    const std::vector<double> gap = draw_gaps(random, n_branches, is_t);
    const std::vector<double> level = draw_levels(random, n_branches);
    std::vector<double> angle = {random.uniform(0, 2 * kPi)};
    for (std::size_t i = 0; i + 1 < gap.size(); i++) angle.push_back(wrapped(angle.back() + gap[i]));
    Scene scene{fan(apex, angle, level), {{apex, angle, true}}, kCellMarginPx};
    std::sort(scene.junctions[0].angle_rad.begin(), scene.junctions[0].angle_rad.end());
    return scene;
}

// ---- polygons

double inner_angle(const std::vector<cv::Point2d> &vertex, std::size_t i)
{
    const std::size_t n = vertex.size();
    const cv::Point2d next = vertex[(i + 1) % n] - vertex[i], previous = vertex[(i + n - 1) % n] - vertex[i];
    return wrapped(std::atan2(previous.y, previous.x) - std::atan2(next.y, next.x));
}

bool is_fair(const std::vector<cv::Point2d> &vertex)
{
    double sum = 0;
    for (std::size_t i = 0; i < vertex.size(); i++) {
        const double inner = inner_angle(vertex, i);
        if (cv::norm(vertex[i] - vertex[(i + 1) % vertex.size()]) < 24) return false;
        if (inner < kMinAngle || inner > 2 * kPi - kMinAngle || std::abs(inner - kPi) < kMinAngle) return false;
        sum += inner;
    }
    return std::abs(sum - (static_cast<double>(vertex.size()) - 2) * kPi) < 1e-6; // simple, turning one way
}

// Star-shaped around the middle; a quarter of the quadrangles have one corner drawn in.
std::vector<cv::Point2d> draw_vertices(Random &random, const cv::Point2d &middle, double radius)
{
    for (;;) {
        const int n = 3 + random.below(2);
        const int drawn_in = n == 4 && random.below(2) == 0 ? random.below(4) : -1;
        const double start = random.uniform(0, 2 * kPi);
        std::vector<cv::Point2d> vertex;
        for (int i = 0; i < n; i++) {
            const double angle = start + 2 * kPi * (i + random.uniform(-0.3, 0.3)) / n;
            const double r = radius * (i == drawn_in ? random.uniform(0.2, 0.35) : random.uniform(0.7, 1.0));
            vertex.emplace_back(middle.x + r * std::cos(angle), middle.y + r * std::sin(angle));
        }
        if (is_fair(vertex)) return vertex;
    }
}

void add_truth(Scene &scene, const std::vector<cv::Point2d> &vertex)
{
    for (std::size_t i = 0; i < vertex.size(); i++) {
        const cv::Point2d next = vertex[(i + 1) % vertex.size()] - vertex[i];
        const cv::Point2d previous = vertex[(i + vertex.size() - 1) % vertex.size()] - vertex[i];
        std::vector<double> angle = {wrapped(std::atan2(next.y, next.x)), wrapped(std::atan2(previous.y, previous.x))};
        std::sort(angle.begin(), angle.end());
        scene.junctions.push_back({vertex[i], angle, true});
    }
}

Scene make_polygon_scene(Random &random)
{
    constexpr double kBorderPx = 28, kGapPx = 6;
    const double background = random.uniform(110, 145);
    Scene scene{{kWidthPx, kHeightPx, background, {}}, {}, kCellMarginPx};
    std::vector<cv::Vec3d> taken;
    for (int i = 0; i < 2000 && taken.size() < 24; i++) {
        const double radius = random.uniform(30, 60), keep = kBorderPx + radius;
        const cv::Point2d middle(random.uniform(keep, kWidthPx - 1 - keep), random.uniform(keep, kHeightPx - 1 - keep));
        const bool is_free = std::none_of(taken.begin(), taken.end(), [&](const cv::Vec3d &other) {
            return std::hypot(middle.x - other[0], middle.y - other[1]) < radius + other[2] + kGapPx;
        });
        if (!is_free) continue;
        taken.emplace_back(middle.x, middle.y, radius);
        const std::vector<cv::Point2d> vertex = draw_vertices(random, middle, radius);
        scene.picture.polygons.push_back({vertex, level_beside(random, background)});
        add_truth(scene, vertex);
    }
    return scene;
}

// ---- chessboards

constexpr int kColumns = 13, kRows = 9; // squares

// Board, in squares with its middle at 0, to image: turned, tilted, `side_px` a square at its middle.
cv::Matx33d draw_board(Random &random, double side_px)
{
    const double turn = random.uniform(-0.3, 0.3);
    const double lean_x = random.uniform(-0.02, 0.02), lean_y = random.uniform(-0.02, 0.02);
    const double squash = random.uniform(0.85, 1), c = std::cos(turn), s = std::sin(turn);
    const cv::Matx33d rotated(c, -s, 0, s, c, 0, 0, 0, 1);
    const cv::Matx33d tilted(side_px, 0, 0, 0, side_px * squash, 0, lean_x, lean_y, 1);
    const double x = kWidthPx / 2.0 + random.uniform(-8, 8), y = kHeightPx / 2.0 + random.uniform(-8, 8);
    return cv::Matx33d(1, 0, x, 0, 1, y, 0, 0, 1) * rotated * tilted;
}

cv::Point2d board_corner(const cv::Matx33d &image_from_board, double column, double row)
{
    return transformed(cv::Point2d(column - kColumns / 2.0, row - kRows / 2.0), image_from_board);
}

bool is_within(const cv::Point2d &point, double margin)
{
    return point.x >= margin && point.y >= margin && point.x <= kWidthPx - 1 - margin &&
           point.y <= kHeightPx - 1 - margin;
}

// All squares' sides within 26..40 px.
bool is_fair_board(const cv::Matx33d &board)
{
    for (int row = 0; row <= kRows; row++) {
        for (int column = 0; column <= kColumns; column++) {
            const cv::Point2d here = board_corner(board, column, row);
            for (const cv::Point2d &next : {board_corner(board, column + 1, row), board_corner(board, column, row + 1)})
                if (cv::norm(next - here) < 26 || cv::norm(next - here) > 40) return false;
        }
    }
    return true;
}

TrueJunction board_junction(const cv::Matx33d &board, int column, int row)
{
    TrueJunction junction{board_corner(board, column, row), {}, true};
    for (const auto &[dx, dy] : {std::pair{1, 0}, {0, 1}, {-1, 0}, {0, -1}}) {
        const cv::Point2d ray = board_corner(board, column + dx, row + dy) - junction.at_px;
        junction.angle_rad.push_back(wrapped(std::atan2(ray.y, ray.x)));
    }
    std::sort(junction.angle_rad.begin(), junction.angle_rad.end());
    const bool is_inner = column > 0 && row > 0 && column < kColumns && row < kRows;
    junction.counts = is_inner && is_within(junction.at_px, 28);
    return junction;
}

Scene make_chessboard(Random &random)
{
    cv::Matx33d board;
    do board = draw_board(random, random.uniform(28, 38));
    while (!is_fair_board(board));
    const double dark = random.uniform(30, 70), light = dark + random.uniform(80, kMaxContrast);
    Scene scene{{kWidthPx, kHeightPx, (dark + light) / 2, {}}, {}, kCellMarginPx};
    for (int row = 0; row < kRows; row++) {
        for (int column = 0; column < kColumns; column++) {
            Polygon square{{}, (row + column) % 2 == 0 ? dark : light};
            for (const auto &[dx, dy] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}})
                square.vertex_px.push_back(board_corner(board, column + dx, row + dy));
            scene.picture.polygons.push_back(square);
        }
    }
    for (int row = 0; row <= kRows; row++) {
        for (int column = 0; column <= kColumns; column++)
            scene.junctions.push_back(board_junction(board, column, row));
    }
    return scene;
}

// ---- triangles

Scene make_triangle(Random &random)
{
    constexpr int kSidePx = 160;
    const double background = random.uniform(110, 145);
    Scene scene{{kSidePx, kSidePx, background, {}}, {}, kCellMarginPx};
    for (;;) {
        std::vector<cv::Point2d> vertex;
        for (int i = 0; i < 3; i++)
            vertex.emplace_back(random.uniform(28, kSidePx - 29.0), random.uniform(28, kSidePx - 29.0));
        const double shortest = std::min(
            {cv::norm(vertex[0] - vertex[1]), cv::norm(vertex[1] - vertex[2]), cv::norm(vertex[2] - vertex[0])});
        if (shortest < 60 || !is_fair(vertex)) continue;
        scene.picture.polygons.push_back({vertex, level_beside(random, background)});
        add_truth(scene, vertex);
        return scene;
    }
}

template <typename Make>
std::vector<Scene> make_many(int count, int draw, std::uint64_t salt, Make make)
{
    std::vector<Scene> scenes;
    for (int i = 0; i < count; i++) {
        Random random(kSeed + 1000000 * salt + 100000000 * static_cast<std::uint64_t>(draw) +
                      static_cast<std::uint64_t>(i));
        scenes.push_back(make(random, i));
    }
    return scenes;
}

} // namespace

double wrapped(double angle_rad)
{
    const double turned = std::fmod(angle_rad, 2 * kPi);
    return turned < 0 ? turned + 2 * kPi : turned;
}

double turn_between(double a_rad, double b_rad)
{
    const double turn = wrapped(a_rad - b_rad);
    return std::min(turn, 2 * kPi - turn);
}

Picture fan(const cv::Point2d &apex_px, const std::vector<double> &angle_rad, const std::vector<double> &level)
{
    Picture picture{kCellPx, kCellPx, 128, {}};
    for (std::size_t i = 0; i < angle_rad.size(); i++) {
        const double gap = wrapped(angle_rad[(i + 1) % angle_rad.size()] - angle_rad[i]);
        picture.polygons.push_back(sector(apex_px, angle_rad[i], gap, level[i]));
    }
    return picture;
}

std::vector<Scene> make_cells(int count, int draw)
{
    return make_many(count, draw, 1, [](Random &random, int i) { return make_cell(random, 2 + i % 3, i % 6 == 1); });
}

std::vector<Scene> make_polygons(int count, int draw)
{
    return make_many(count, draw, 2, [](Random &random, int) { return make_polygon_scene(random); });
}

std::vector<Scene> make_chessboards(int count, int draw)
{
    return make_many(count, draw, 3, [](Random &random, int) { return make_chessboard(random); });
}

std::vector<Scene> make_triangles(int count, int draw)
{
    return make_many(count, draw, 4, [](Random &random, int) { return make_triangle(random); });
}

const std::vector<std::string> kSets = {"cells", "polys", "chess", "triangles"};
const std::vector<std::string> kCellSets = {"cells-L", "cells-T", "cells-Y", "cells-X"};

std::vector<Scene> make_set(const std::string &name, bool is_quick, int draw)
{
    if (name == "cells") return make_cells(is_quick ? 120 : 300, draw);
    if (name == "polys") return make_polygons(is_quick ? 1 : 4, draw);
    if (name == "chess") return make_chessboards(is_quick ? 1 : 4, draw);
    if (name == "triangles") return make_triangles(is_quick ? 20 : 60, draw);
    const auto cells = std::find(kCellSets.begin(), kCellSets.end(), name);
    if (cells == kCellSets.end()) throw std::invalid_argument("no set is called " + name);
    const int kind = OC_KIND_L + static_cast<int>(cells - kCellSets.begin());
    std::vector<Scene> some;
    for (const Scene &scene : make_set("cells", is_quick, draw)) {
        if (kind_of(scene.junctions.at(0)) == kind) some.push_back(scene);
    }
    return some;
}

int kind_of(const TrueJunction &junction)
{
    std::vector<oc_branch_t> branches;
    for (const double angle : junction.angle_rad) branches.push_back({static_cast<float>(angle), 0, 0});
    return oc_junction_kind_of(branches.data(), static_cast<unsigned>(branches.size()));
}

} // namespace outcrop::bench
