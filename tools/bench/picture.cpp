// SPDX-License-Identifier: BSD-3-Clause
// The coverage of a cell by a polygon is what the polygon's edges leave to their right, summed along the row.
#include "picture.h"

#include "random.h"

#include <algorithm>
#include <cmath>

namespace outcrop::bench {
namespace {

constexpr int kCells = 4; // per pixel and direction
constexpr int kPadPx = 5; // more than the blur reaches
constexpr int kReachPx = 4;

// Row-major, per cell the change of coverage times level between it and its left neighbour.
struct Coverage {
    int width, height;
    std::vector<float> change;

    float *row(int y) { return &change[static_cast<std::size_t>(y) * static_cast<std::size_t>(width + 2)]; }
};

// The part of an edge inside one row of cells: x0 to x1, `rise` of the row's height, signed.
void add_piece(float *row, double x0, double x1, double rise)
{
    if (x0 > x1) std::swap(x0, x1);
    const int first = static_cast<int>(x0);
    const int last = std::max(first, static_cast<int>(std::ceil(x1)) - 1);
    double taken = 0; // coverage so far, right of the edge
    for (int x = first; x <= last; x++) {
        double covered = rise; // at the cell's right side everything below or above the edge is covered
        double area;           // mean coverage of this cell
        if (x1 - x0 < 1e-9) {
            area = rise * (x + 1 - x0);
        } else {
            const double a = std::max(x0, static_cast<double>(x)), b = std::min(x1, x + 1.0);
            const double at_a = rise * (a - x0) / (x1 - x0), at_b = rise * (b - x0) / (x1 - x0);
            area = (at_a + at_b) / 2 * (b - a) + at_b * (x + 1 - b);
            covered = at_b;
        }
        row[x] += static_cast<float>(area - taken);
        taken = area;
        if (x == last) row[x + 1] += static_cast<float>(covered - area);
    }
}

// An edge wholly within 0 <= x <= width.
void add_inside(Coverage &coverage, cv::Point2d p, cv::Point2d q, double level)
{
    if (p.y == q.y) return;
    if (p.y > q.y) {
        std::swap(p, q);
        level = -level;
    }
    const double slope = (q.x - p.x) / (q.y - p.y);
    const double top = std::max(p.y, 0.0), bottom = std::min<double>(q.y, coverage.height);
    const auto x_at = [&](double y) {
        return std::clamp(p.x + slope * (y - p.y), 0.0, static_cast<double>(coverage.width));
    };
    for (int y = static_cast<int>(top); y < bottom; y++) {
        const double y0 = std::max<double>(y, top), y1 = std::min<double>(y + 1, bottom);
        if (y1 > y0) add_piece(coverage.row(y), x_at(y0), x_at(y1), level * (y1 - y0));
    }
}

// What is left of the image covers whole rows, what is right of it nothing: both as upright edges on the side.
void add_edge(Coverage &coverage, const cv::Point2d &p, const cv::Point2d &q, double level)
{
    for (const double side : {0.0, static_cast<double>(coverage.width)}) {
        if ((p.x < side) != (q.x < side) && p.x != side && q.x != side) {
            const double share = (side - p.x) / (q.x - p.x);
            const cv::Point2d cut(side, p.y + share * (q.y - p.y));
            add_edge(coverage, p, cut, level);
            add_edge(coverage, cut, q, level);
            return;
        }
    }
    const auto inside = [&](const cv::Point2d &point) {
        return cv::Point2d(std::clamp(point.x, 0.0, static_cast<double>(coverage.width)), point.y);
    };
    add_inside(coverage, inside(p), inside(q), level);
}

double signed_area(const std::vector<cv::Point2d> &vertex)
{
    double sum = 0;
    for (std::size_t i = 0; i < vertex.size(); i++) sum += vertex[i].cross(vertex[(i + 1) % vertex.size()]);
    return sum / 2;
}

void add_polygon(Coverage &coverage, const Polygon &polygon, double level)
{
    std::vector<cv::Point2d> cell;
    for (const cv::Point2d &point : polygon.vertex_px)
        cell.emplace_back((point.x + 0.5 + kPadPx) * kCells, (point.y + 0.5 + kPadPx) * kCells);
    // Going down an edge, the inside is to its right when the polygon turns anticlockwise as seen.
    const double sign = signed_area(cell) < 0 ? 1 : -1;
    for (std::size_t i = 0; i < cell.size(); i++)
        add_edge(coverage, cell[i], cell[(i + 1) % cell.size()], sign * level);
}

// Blur and pixel square in one, over the cells from kReachPx left of a pixel to kReachPx right of it.
std::vector<float> kernel()
{
    const int n = (2 * kReachPx + 1) * kCells;
    std::vector<double> weight(static_cast<std::size_t>(n));
    double sum = 0;
    for (int i = 0; i < n; i++) {
        for (int box = 0; box < kCells; box++) {
            const double gap_px = (i - kReachPx * kCells - box) / static_cast<double>(kCells);
            weight[static_cast<std::size_t>(i)] += std::exp(-gap_px * gap_px / (2 * kBlurPx * kBlurPx));
        }
        sum += weight[static_cast<std::size_t>(i)];
    }
    std::vector<float> scaled;
    for (const double w : weight) scaled.push_back(static_cast<float>(w / sum));
    return scaled;
}

cv::Mat blurred(Coverage &coverage, int width_px, int height_px, double background)
{
    static const std::vector<float> weight = kernel();
    const int n = static_cast<int>(weight.size()), start = (kPadPx - kReachPx) * kCells;
    cv::Mat image(height_px, width_px, CV_32F);
    std::vector<float> column(static_cast<std::size_t>(coverage.width));
    for (int y = 0; y < height_px; y++) {
        std::fill(column.begin(), column.end(), 0.0f);
        for (int k = 0; k < n; k++) {
            const float *cells = coverage.row(y * kCells + start + k);
            const float w = weight[static_cast<std::size_t>(k)];
            for (std::size_t x = 0; x < column.size(); x++) column[x] += w * cells[x];
        }
        float *out = image.ptr<float>(y);
        for (int x = 0; x < width_px; x++) {
            const float *cells = &column[static_cast<std::size_t>(x * kCells + start)];
            double sum = background;
            for (int k = 0; k < n; k++) sum += static_cast<double>(weight[static_cast<std::size_t>(k)] * cells[k]);
            out[x] = static_cast<float>(sum);
        }
    }
    return image;
}

} // namespace

cv::Mat render(const Picture &picture)
{
    Coverage coverage{(picture.width_px + 2 * kPadPx) * kCells, (picture.height_px + 2 * kPadPx) * kCells, {}};
    coverage.change.resize(static_cast<std::size_t>(coverage.width + 2) * static_cast<std::size_t>(coverage.height));
    for (const Polygon &polygon : picture.polygons) add_polygon(coverage, polygon, polygon.level - picture.background);
    for (int y = 0; y < coverage.height; y++) {
        float *row = coverage.row(y);
        double sum = 0;
        for (int x = 0; x < coverage.width; x++) row[x] = static_cast<float>(sum += static_cast<double>(row[x]));
    }
    return blurred(coverage, picture.width_px, picture.height_px, picture.background);
}

cv::Point2d transformed(const cv::Point2d &point_px, const cv::Matx33d &homography)
{
    const cv::Vec3d moved = homography * cv::Vec3d(point_px.x, point_px.y, 1);
    return {moved[0] / moved[2], moved[1] / moved[2]};
}

Picture transformed(const Picture &picture, const cv::Matx33d &homography, int width_px, int height_px)
{
    Picture moved{width_px, height_px, picture.background, picture.polygons};
    for (Polygon &polygon : moved.polygons) {
        for (cv::Point2d &point : polygon.vertex_px) point = transformed(point, homography);
    }
    return moved;
}

cv::Mat with_noise(const cv::Mat &clean, double variance, std::uint64_t seed)
{
    Random random(seed);
    const double deviation = std::sqrt(variance);
    cv::Mat noisy(clean.size(), CV_8U);
    for (int y = 0; y < clean.rows; y++) {
        const float *from = clean.ptr<float>(y);
        std::uint8_t *to = noisy.ptr<std::uint8_t>(y);
        for (int x = 0; x < clean.cols; x++) {
            const double level = static_cast<double>(from[x]) + (deviation > 0 ? deviation * random.normal() : 0.0);
            to[x] = static_cast<std::uint8_t>(std::clamp(std::floor(level + 0.5), 0.0, 255.0));
        }
    }
    return noisy;
}

} // namespace outcrop::bench
