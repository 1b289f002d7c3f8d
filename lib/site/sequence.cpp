// SPDX-License-Identifier: BSD-3-Clause
// Render, write, pipe.
#include "site/sequence.h"

#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

#include "site/atomic_file.h"
#include "site/render_voxels.h"
#include "site/video.h"

namespace outcrop {
namespace {

namespace fs = std::filesystem;

std::string numbered(const std::string &stem, std::size_t i, std::size_t n)
{
    int digits = 2;
    for (std::size_t limit = 100; n > limit; limit *= 10) digits++;
    char text[64];
    std::snprintf(text, sizeof text, "%s_%0*zu.png", stem.c_str(), digits, i);
    return text;
}

void remove_old_frames(const fs::path &folder)
{
    for (const auto &entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        const bool is_ours = name.rfind("frame_", 0) == 0 || name.rfind("mask_", 0) == 0;
        if (is_ours && entry.path().extension() == ".png") fs::remove(entry.path());
    }
}

} // namespace

SequenceReport write_sequence(const std::string &dir, const std::string &as, const SiteModel &model,
                              const std::vector<Shape> &shapes, const OverheadMap &overhead, const Path &path,
                              const SequenceOptions &options, const std::function<void(int, int)> &progress)
{
    if (as != "boxes" && as != "voxels") throw std::invalid_argument("obstacles cannot be shown as " + as);
    if (path.frames.empty()) throw std::invalid_argument("the path has no frame");
    const fs::path folder = fs::path(dir) / as;
    fs::create_directories(folder);
    remove_old_frames(folder);
    const fs::path video_path = fs::path(dir) / (as + ".mp4");
    fs::remove(video_path);

    const GroundTexture ground(overhead);
    const VoxelCloud voxels(as == "voxels" ? shapes : std::vector<Shape>());
    const oc_intrinsics_t &first = path.frames.front().k;
    VideoWriter video(video_path.string(),
                      cv::Size(static_cast<int>(first.width_px), static_cast<int>(first.height_px)),
                      options.frames_per_s);
    const std::size_t n = path.frames.size();
    for (std::size_t i = 0; i < n; i++) {
        const Frame frame = render_voxels(model, voxels, ground, path.frames[i], options.render);
        cv::Mat bgr;
        cv::cvtColor(frame.rgb, bgr, cv::COLOR_RGB2BGR);
        write_png((folder / numbered("frame", i, n)).string(), bgr);
        write_png((folder / numbered("mask", i, n)).string(), frame.mask);
        video.add(frame.rgb);
        if (progress) progress(static_cast<int>(i) + 1, static_cast<int>(n));
    }
    SequenceReport report;
    report.has_video = video.close();
    report.note = video.note();
    return report;
}

} // namespace outcrop
