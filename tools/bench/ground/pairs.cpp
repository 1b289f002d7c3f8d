// SPDX-License-Identifier: BSD-3-Clause
// Views as the ground filter takes them.
#include "pairs.h"

#include <algorithm>
#include <stdexcept>

namespace outcrop::bench {
namespace {

GroundView make_view(const Vehicle &vehicle, const Frame &frame, unsigned n_junctions)
{
    const oc_image_t &image = frame.frame.image;
    GroundView out;
    out.grey.resize(static_cast<std::size_t>(image.width_px) * image.height_px);
    oc_image_mut_t grey = {out.grey.data(), image.width_px, image.height_px, image.width_px, 1};
    oc_push_report_t report;
    const oc_junction_t *junctions = nullptr;
    std::uint32_t n = 0;
    if (oc_image_to_grey(&image, &grey) != OC_OK || oc_vehicle_push(vehicle.get(), &frame.frame, &report) != OC_OK ||
        oc_vehicle_junctions(vehicle.get(), frame.frame.view_id, &junctions, &n) != OC_OK)
        throw std::runtime_error("a frame was refused");
    out.junctions.assign(junctions, junctions + std::min(n, n_junctions));
    return out;
}

} // namespace

std::vector<GroundView> ground_views(const Scene &scene, unsigned n_junctions)
{
    oc_vehicle_config_t config = drive_config(scene);
    config.judoca.max_junctions = std::max(config.judoca.max_junctions, n_junctions);
    const Vehicle vehicle(config);
    std::vector<GroundView> out;
    for (const Frame &frame : scene.frames) out.push_back(make_view(vehicle, frame, n_junctions));
    for (std::size_t i = 0; i < out.size(); i++) { // the vectors have found their places
        const oc_frame_t &frame = scene.frames[i].frame;
        const std::uint32_t w = frame.image.width_px, h = frame.image.height_px;
        out[i].view = {
            frame.view_id, {out[i].grey.data(), w, h, w, 1}, frame.camera,
            frame.margin,  out[i].junctions.data(),          static_cast<std::uint32_t>(out[i].junctions.size())};
    }
    return out;
}

} // namespace outcrop::bench
