// SPDX-License-Identifier: BSD-3-Clause
// View to outcrop.view_t.
#include "republish.h"

#include <stdexcept>
#include <utility>

#include <lcm/lcm-cpp.hpp>

#include "link_lcm.h"
#include "outcrop/view_t.hpp"

namespace outcrop {
namespace {

junction_t readable(const oc_junction_t &junction)
{
    junction_t out;
    out.x = junction.x_px;
    out.y = junction.y_px;
    out.label = static_cast<std::int8_t>(junction.label);
    out.n_branches = static_cast<std::int8_t>(junction.n_branches);
    out.branches.resize(junction.n_branches);
    for (std::size_t i = 0; i < junction.n_branches; i++) out.branches[i].angle = junction.branch[i].angle_rad;
    return out;
}

view_t readable(int vehicle, const View &view)
{
    view_t out;
    out.utime = view.utime_us;
    out.vehicle = vehicle;
    out.view = view.id;
    out.camera = view.camera_index;
    const oc_intrinsics_t &k = view.camera.k;
    out.width = static_cast<std::int32_t>(k.width_px);
    out.height = static_cast<std::int32_t>(k.height_px);
    out.fx = k.fx_px;
    out.fy = k.fy_px;
    out.cx = k.cx_px;
    out.cy = k.cy_px;
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++)
            out.cam_from_world[row][column] = view.camera.pose.R[3 * row + column];
        out.cam_from_world[row][3] = view.camera.pose.t[row];
    }
    for (int i = 0; i < 6; i++) out.margin[i] = view.margin.v[i];
    out.n_junctions = static_cast<std::int32_t>(view.junctions.size());
    for (const oc_junction_t &junction : view.junctions) out.junctions.push_back(readable(junction));
    return out;
}

} // namespace

Republisher::Republisher(const std::string &url)
{
    char error[512];
    if (!oc_link_has_route(url.c_str(), error, sizeof error)) throw std::runtime_error(error);
    lcm_ = std::make_shared<lcm::LCM>(url);
    if (!lcm_->good()) throw std::runtime_error("cannot open " + url + ": is the URL right?");
}

Republisher::Republisher(std::shared_ptr<lcm::LCM> lcm) : lcm_(std::move(lcm)) {}

Republisher::~Republisher() = default;

void Republisher::publish(int vehicle, const View &view)
{
    if (!published_.insert(view.id).second) return;
    const view_t message = readable(vehicle, view);
    lcm_->publish("OUTCROP_VIEW", &message);
}

} // namespace outcrop
