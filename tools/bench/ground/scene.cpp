// SPDX-License-Identifier: BSD-3-Clause
// A site as the vehicle meets it.
#include "scene.h"

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <stdexcept>

extern "C" {
#include "daemon/vehicle/capture.h"
}
#include "vehicle/arena.h"

namespace outcrop::bench {
namespace {

namespace fs = std::filesystem;

// A file name of our own that goes when it is no longer needed.
class ScratchFile {
public:
    ScratchFile()
    {
        std::string name = (fs::temp_directory_path() / "outcrop-bench-XXXXXX.json").string();
        const int fd = mkstemps(name.data(), 5);
        if (fd < 0) throw std::runtime_error(name + ": cannot be made");
        close(fd);
        path = name;
    }
    ~ScratchFile()
    {
        std::error_code ignored;
        fs::remove(path, ignored);
    }
    ScratchFile(const ScratchFile &) = delete;
    ScratchFile &operator=(const ScratchFile &) = delete;

    std::string path;
};

Frame copy_of(const oc_captured_t &captured)
{
    if (captured.has_distortion) throw std::runtime_error("a site with lens distortion: not for this bench");
    const oc_image_t image = oc_image_from_raw(&captured.raw);
    Frame out;
    out.px.assign(image.px, image.px + image.stride_bytes * image.height_px);
    out.frame = oc_frame_t{};
    out.frame.image = image;
    out.frame.image.px = out.px.data();
    out.frame.camera = captured.camera;
    out.frame.margin = captured.margin;
    out.frame.utime_us = captured.utime_us;
    out.frame.camera_index = captured.camera_index;
    out.frame.has_view_id = captured.has_view_id;
    out.frame.view_id = captured.view_id;
    out.frame.is_forced = captured.is_forced;
    return out;
}

} // namespace

Scene load_scene(const ReportedSiteOptions &options)
{
    const ScratchFile cameras;
    write_reported_site(options, cameras.path);
    char error[512] = "";
    const oc_margin_option_t from_file = {NAN, NAN};
    oc_margin_t used;
    const oc_site_option_t at_once{};
    oc_capture_t *capture =
        oc_capture_open_site(cameras.path.c_str(), &at_once, &from_file, &used, error, sizeof error);
    if (!capture) throw std::runtime_error(error);

    Scene scene;
    scene.max_width_px = capture->max_width_px;
    scene.max_height_px = capture->max_height_px;
    scene.area = capture->area;
    oc_captured_t captured;
    oc_capture_result_t got;
    while ((got = capture->next(capture, 1, &captured, error, sizeof error)) == OC_CAPTURE_FRAME)
        scene.frames.push_back(copy_of(captured));
    capture->close(capture);
    if (got == OC_CAPTURE_ERROR) throw std::runtime_error(error);
    return scene;
}

oc_vehicle_config_t drive_config(const Scene &scene)
{
    oc_vehicle_config_t config = oc_vehicle_defaults();
    config.max_width_px = scene.max_width_px;
    config.max_height_px = scene.max_height_px;
    config.stored_views = 256;
    config.keep_colour = false;
    config.area = scene.area;
    return config;
}

Vehicle::Vehicle(const oc_vehicle_config_t &config)
{
    const std::size_t n_bytes = oc_vehicle_size(&config);
    if (n_bytes == 0) throw std::runtime_error("the vehicle's configuration is out of range");
    block_.resize(n_bytes + OC_ARENA_ALIGN);
    const auto address = reinterpret_cast<std::uintptr_t>(block_.data());
    std::uint8_t *aligned = block_.data() + (OC_ARENA_ALIGN - address % OC_ARENA_ALIGN) % OC_ARENA_ALIGN;
    if (oc_vehicle_init(&config, aligned, n_bytes, &vehicle_) != OC_OK)
        throw std::runtime_error("the vehicle was refused");
}

} // namespace outcrop::bench
