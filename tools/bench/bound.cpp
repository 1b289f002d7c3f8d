// SPDX-License-Identifier: BSD-3-Clause
#include "bound.h"

#include <Eigen/Dense>
#include <cmath>

namespace outcrop::bench {
namespace {

// Unknowns of a cell: apex x, y, then a direction and a grey level for each sector.
Eigen::VectorXd unknowns_of(const Scene &cell)
{
    const std::size_t n = cell.picture.polygons.size();
    Eigen::VectorXd unknowns(2 + 2 * static_cast<Eigen::Index>(n));
    const cv::Point2d apex = cell.junctions.at(0).at_px;
    unknowns(0) = apex.x;
    unknowns(1) = apex.y;
    for (std::size_t i = 0; i < n; i++) {
        const cv::Point2d ray = cell.picture.polygons[i].vertex_px.at(1) - apex;
        unknowns(2 + 2 * static_cast<Eigen::Index>(i)) = std::atan2(ray.y, ray.x);
        unknowns(3 + 2 * static_cast<Eigen::Index>(i)) = cell.picture.polygons[i].level;
    }
    return unknowns;
}

cv::Mat image_of(const Eigen::VectorXd &unknowns, const Picture &like)
{
    std::vector<double> angle, level;
    for (Eigen::Index i = 2; i < unknowns.size(); i += 2) {
        angle.push_back(unknowns(i));
        level.push_back(unknowns(i + 1));
    }
    Picture picture = fan({unknowns(0), unknowns(1)}, angle, level);
    picture.width_px = like.width_px;
    picture.height_px = like.height_px;
    return render(picture);
}

// How the image changes with each unknown, by central differences.
std::vector<cv::Mat> slopes_of(const Scene &cell, const Eigen::VectorXd &unknowns)
{
    std::vector<cv::Mat> slope;
    for (Eigen::Index i = 0; i < unknowns.size(); i++) {
        const bool is_level = i >= 2 && i % 2 == 1;
        const double step = is_level ? 1 : i < 2 ? 0.05 : 0.005;
        Eigen::VectorXd more = unknowns, less = unknowns;
        more(i) += step;
        less(i) -= step;
        slope.push_back((image_of(more, cell.picture) - image_of(less, cell.picture)) / (2 * step));
    }
    return slope;
}

// Of the best estimate of the unknowns.
Eigen::MatrixXd covariance(const std::vector<cv::Mat> &slope, const Eigen::VectorXd &unknowns, double radius_px)
{
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(unknowns.size(), unknowns.size());
    Eigen::VectorXd here(unknowns.size());
    for (int y = 0; y < slope[0].rows; y++) {
        for (int x = 0; x < slope[0].cols; x++) {
            if (std::hypot(x - unknowns(0), y - unknowns(1)) > radius_px) continue;
            for (Eigen::Index i = 0; i < here.size(); i++)
                here(i) = static_cast<double>(slope[static_cast<std::size_t>(i)].at<float>(y, x));
            information += here * here.transpose();
        }
    }
    return information.inverse();
}

} // namespace

std::vector<std::map<std::string, double>> information_bounds(const std::vector<Scene> &cells,
                                                              const std::vector<int> &radii_px)
{
    std::vector<double> place(radii_px.size()), turn(radii_px.size());
    double n_branches = 0;
    for (const Scene &cell : cells) {
        const Eigen::VectorXd unknowns = unknowns_of(cell);
        const std::vector<cv::Mat> slope = slopes_of(cell, unknowns);
        n_branches += static_cast<double>(cell.picture.polygons.size());
        for (std::size_t r = 0; r < radii_px.size(); r++) {
            const Eigen::MatrixXd spread = covariance(slope, unknowns, radii_px[r]);
            place[r] += spread(0, 0) + spread(1, 1);
            for (Eigen::Index i = 2; i < spread.rows(); i += 2) turn[r] += spread(i, i);
        }
    }
    std::vector<std::map<std::string, double>> bounds;
    for (std::size_t r = 0; r < radii_px.size(); r++) {
        bounds.push_back({{"rmse_px", std::sqrt(place[r] / static_cast<double>(cells.size()))},
                          {"angle_rmse_deg", std::sqrt(turn[r] / n_branches) / kDegree}});
    }
    return bounds;
}

} // namespace outcrop::bench
