// SPDX-License-Identifier: BSD-3-Clause
// Render, write, pipe.
#include "site/sequence.h"

#include <cstdio>
#include <filesystem>
#include <set>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

#include "site/atomic_file.h"
#include "site/render_box.h"
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

// Boxes, and voxels before them or behind: those obstacles that were carved are no boxes here.
class VoxelFrames {
public:
    VoxelFrames(const SiteModel &model, const std::vector<Shape> &shapes)
    {
        std::set<int> carved;
        for (const Shape &shape : shapes) {
            if (shape.index < 1 || shape.index > 254) continue;
            cloud_.add(shape.index, shape.voxels);
            carved.insert(shape.index);
        }
        for (const Obstacle &box : model.obstacles)
            if (carved.count(box.index) == 0) boxes_.obstacles.push_back(box);
        boxes_.suspected = model.suspected;
    }

    Frame frame(const GroundTexture &ground, const oc_camera_t &camera, const RenderOptions &options) const
    {
        Frame frame = render_boxes(boxes_, ground, camera, options);
        if (cloud_.size() == 0) return frame;
        const VoxelImage drawn = render_voxels(cloud_, camera, options.near_m);
        const std::vector<BoxView> boxes = see_boxes(boxes_, camera, options.near_m);
        for (int y = 0; y < drawn.mask.rows; y++) {
            for (int x = 0; x < drawn.mask.cols; x++) {
                if (drawn.mask(y, x) == 0 || is_hidden(boxes, x, y, static_cast<double>(drawn.depth(y, x)))) continue;
                frame.rgb(y, x) = drawn.rgb(y, x);
                frame.mask(y, x) = drawn.mask(y, x);
            }
        }
        return frame;
    }

private:
    static bool is_hidden(const std::vector<BoxView> &boxes, int x, int y, double depth_m)
    {
        for (const BoxView &box : boxes) {
            if (!box.reach().contains({x, y})) continue;
            const BoxHit hit = box.hit(x, y);
            if (hit.is_hit && hit.depth_m < depth_m) return true;
        }
        return false;
    }

    SiteModel boxes_;
    VoxelCloud cloud_;
};

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
    const VoxelFrames voxels(model, as == "voxels" ? shapes : std::vector<Shape>());
    const oc_intrinsics_t &first = path.frames.front().k;
    VideoWriter video(video_path.string(),
                      cv::Size(static_cast<int>(first.width_px), static_cast<int>(first.height_px)),
                      options.frames_per_s);
    const std::size_t n = path.frames.size();
    for (std::size_t i = 0; i < n; i++) {
        const Frame frame = voxels.frame(ground, path.frames[i], options.render);
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
