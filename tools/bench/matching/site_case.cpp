// SPDX-License-Identifier: BSD-3-Clause
// A site as the base knows it after a run in which every pixel crossed.
#include "site_case.h"

#include <filesystem>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

#include "bench/ground/scene.h"
#include "site/assemble.h"

namespace outcrop::bench {
namespace {

std::string name_of(const SiteCaseOptions &options)
{
    const std::filesystem::path folder = std::filesystem::path(options.site) / "";
    const std::string site = folder.parent_path().filename().string();
    return options.images.empty() ? site : site + "/" + options.images;
}

void demand(oc_status_t status, const char *what)
{
    if (status != OC_OK) throw std::runtime_error(std::string(what) + ": " + oc_status_text(status));
}

// Every packet that the vehicle has to send.
void drain(const Vehicle &vehicle, PacketAssembler *assembler)
{
    std::vector<std::uint8_t> packet(OC_MAX_DATAGRAM_BYTES);
    for (;;) {
        std::size_t n_bytes = 0;
        demand(oc_vehicle_next(vehicle.get(), packet.data(), packet.size(), &n_bytes), "a packet");
        if (n_bytes == 0) return;
        assembler->feed(packet.data(), n_bytes);
    }
}

std::vector<View> views_of(const Scene &scene, bool finds_all)
{
    oc_vehicle_config_t config = drive_config(scene);
    if (finds_all) {
        config.max_sent_junctions = OC_MAX_JUNCTIONS;
        config.judoca.max_junctions = OC_MAX_JUNCTIONS;
    }
    const Vehicle vehicle(config);
    PacketAssembler assembler;
    for (const Frame &frame : scene.frames) {
        oc_push_report_t report;
        demand(oc_vehicle_push(vehicle.get(), &frame.frame, &report), "a frame");
        drain(vehicle, &assembler);
    }
    std::vector<View> views;
    for (const auto &[id, view] : assembler.views()) views.push_back(view);
    if (views.size() != scene.frames.size()) throw std::runtime_error("a view did not arrive whole");
    return views;
}

void add_pixels(const Frame &frame, View *view, std::vector<cv::Mat3b> *pictures)
{
    const oc_image_t &image = frame.frame.image;
    const cv::Size size(static_cast<int>(image.width_px), static_cast<int>(image.height_px));
    view->grey.create(size);
    view->known = cv::Mat1b(size, 255);
    oc_image_mut_t grey = {view->grey.data, image.width_px, image.height_px, image.width_px, 1};
    demand(oc_image_to_grey(&image, &grey), "a picture");
    if (image.channels != 3) return;
    cv::Mat3b picture(size);
    for (int y = 0; y < size.height; y++)
        std::copy_n(image.px + static_cast<std::size_t>(y) * image.stride_bytes,
                    static_cast<std::size_t>(size.width) * 3, picture.ptr<std::uint8_t>(y));
    pictures->push_back(picture);
}

} // namespace

SiteCase load_site_case(const SiteCaseOptions &options)
{
    SiteCase out;
    eval::Notes notes;
    out.name = name_of(options);
    out.poses = options.poses;
    out.truth = eval::read_truth(options.site, notes);
    if (!out.truth.has_depth()) throw std::runtime_error(options.site + ": has no true depth");

    ReportedSiteOptions reported;
    reported.site = options.site;
    reported.images = options.images;
    if (options.poses != "exact") reported.perturbation = parse_perturbation(options.poses);
    const Scene scene = load_scene(reported);
    out.views = views_of(scene, options.finds_all);
    for (std::size_t i = 0; i < out.views.size(); i++) {
        if (scene.frames[i].frame.view_id != out.views[i].id) throw std::runtime_error("views out of order");
        add_pixels(scene.frames[i], &out.views[i], &out.pictures);
    }
    const oc_area_t &area = scene.area;
    if (!area.is_set) throw std::runtime_error(options.site + ": gives no working area");
    out.area = Area{area.x_min, area.x_max, area.y_min, area.y_max, area.z_max};
    return out;
}

oc_camera_t true_camera(const SiteCase &site, int view_id)
{
    const eval::Camera &camera = site.truth.views.at(static_cast<std::size_t>(view_id));
    oc_camera_t out{};
    out.k = {camera.fx,
             camera.fy,
             camera.cx,
             camera.cy,
             static_cast<std::uint32_t>(camera.width),
             static_cast<std::uint32_t>(camera.height)};
    for (int i = 0; i < 9; i++) out.pose.R[i] = camera.rotation_cam_from_world(i / 3, i % 3);
    for (int i = 0; i < 3; i++) out.pose.t[i] = camera.translation_m[i];
    return out;
}

} // namespace outcrop::bench
