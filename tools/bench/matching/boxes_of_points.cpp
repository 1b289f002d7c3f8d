// SPDX-License-Identifier: BSD-3-Clause
// Points of another program into obstacles.
#include "boxes_of_points.h"

#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "eval/metrics_box.h"
#include "site/boxes.h"
#include "site/cluster.h"
#include "site/tracks.h"
#include "site_case.h"

namespace outcrop::bench {
namespace {

using Json = nlohmann::ordered_json;

std::vector<SitePoint> read_points(const std::string &file)
{
    std::ifstream in(file);
    if (!in) throw std::runtime_error(file + ": cannot be read");
    std::vector<SitePoint> out;
    std::string line;
    while (std::getline(in, line)) {
        if (line.empty()) continue;
        std::istringstream words(line);
        SitePoint point;
        if (!(words >> point.position.x() >> point.position.y() >> point.position.z()) || !point.position.allFinite())
            throw std::runtime_error(file + ": a line that is no point: " + line);
        words >> point.n_views;
        point.covariance.setZero(); // the file says nothing of doubt
        out.push_back(point);
    }
    return out;
}

std::vector<SitePoint> above_ground(const std::vector<SitePoint> &points, const Area &area, double t_h_m)
{
    std::vector<SitePoint> out;
    for (const SitePoint &point : points) {
        const Eigen::Vector3d &p = point.position;
        const bool is_inside = p.x() >= area.x_min && p.x() <= area.x_max && p.y() >= area.y_min &&
                               p.y() <= area.y_max && p.z() <= area.z_max;
        if (is_inside && p.z() > t_h_m) out.push_back(point);
    }
    return out;
}

} // namespace

Json judge_points(const std::string &site, const std::string &points_file)
{
    const SiteCase known = load_site_case({site, "", "exact"});
    std::vector<oc_camera_t> cameras;
    for (const View &view : known.views) cameras.push_back(view.camera);
    const std::vector<SitePoint> all = read_points(points_file);
    std::vector<SitePoint> points = above_ground(all, known.area, ground_height(cameras, {}));
    const double diagonal = std::hypot(known.area.x_max - known.area.x_min, known.area.y_max - known.area.y_min);
    const Clusters clusters = cluster_points(points, diagonal);
    std::vector<Obstacle> obstacles, suspected;
    make_boxes(clusters, diagonal, {}, &points, &obstacles, &suspected);

    eval::Run run;
    run.obstacles.emplace();
    for (const Obstacle &o : obstacles) {
        eval::FoundObstacle found;
        found.index = o.index;
        found.aabb = {o.aabb_min, o.aabb_max};
        found.obb = {o.obb_centre, o.obb_size, o.yaw_rad};
        run.obstacles->push_back(found);
    }
    Json boxes = Json::array();
    const auto judged = eval::evaluate_boxes(known.truth, run);
    if (!judged) throw std::runtime_error(site + ": has no true obstacles");
    for (const eval::BoxMetric &box : judged->boxes)
        boxes.push_back({{"name", box.name}, {"iou", box.iou}, {"obb_iou", box.obb_iou}});
    return {{"points", all.size()},
            {"points_above_ground", points.size()},
            {"found", obstacles.size()},
            {"suspected", suspected.size()},
            {"missed", judged->missed.size()},
            {"false", judged->false_boxes.size()},
            {"boxes", boxes}};
}

} // namespace outcrop::bench
