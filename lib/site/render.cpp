// SPDX-License-Identifier: BSD-3-Clause
// Boxes first, ground where no box covers it, then the outlines of the boxes with several samples a pixel.
#include "site/render.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/plane.h"
#include "site/render_box.h"

namespace outcrop {
namespace {

const cv::Vec3f kSkyTop(150, 178, 208), kSkyLow(222, 229, 236);

// Unseen ground fades into the sky's edge over this share of the image's height.
constexpr double kHazeShare = 0.04;

cv::Vec3f sky(double y, double horizon_y, double height)
{
    const auto t = static_cast<float>(std::clamp((horizon_y - y) / (0.6 * height), 0.0, 1.0));
    return (1 - t) * kSkyLow + t * kSkyTop;
}

// Ground and sky, pixel by pixel.
class Backdrop {
public:
    Backdrop(const GroundTexture &ground, const oc_camera_t &camera, int max_anisotropy)
        : ground_(ground), height_(camera.k.height_px), max_anisotropy_(max_anisotropy)
    {
        if (oc_plane_ground_from_image(&camera, G_) != OC_OK)
            throw std::invalid_argument("the virtual camera does not stand above the ground");
        oc_plane_horizon(G_, line_);
        slope_ = std::hypot(line_[0], line_[1]);
    }

    // False for sky.
    bool is_ground(double x, double y) const { return G_[6] * x + G_[7] * y + G_[8] > 0; }

    cv::Vec3f colour(double x, double y) const
    {
        const double w = G_[6] * x + G_[7] * y + G_[8];
        if (!(w > 0)) return sky(y, horizon_at(x), height_);
        const double inverse = 1 / w;
        const double gx = (G_[0] * x + G_[1] * y + G_[2]) * inverse, gy = (G_[3] * x + G_[4] * y + G_[5]) * inverse;
        // Derivatives of the ground point: one pixel right, one pixel down.
        const cv::Vec2d du((G_[0] - gx * G_[6]) * inverse, (G_[3] - gy * G_[6]) * inverse);
        const cv::Vec2d dv((G_[1] - gx * G_[7]) * inverse, (G_[4] - gy * G_[7]) * inverse);
        const cv::Vec4f seen = ground_.sample(gx, gy, du, dv, max_anisotropy_);
        const cv::Vec3f shown(seen[0], seen[1], seen[2]);
        if (seen[3] >= 1) return shown;
        const double footprint = std::sqrt(std::max(du.dot(du), dv.dot(dv)));
        const double below_px = slope_ > 0 ? w / slope_ : height_;
        const auto haze = static_cast<float>(std::clamp(1 - below_px / (kHazeShare * height_), 0.0, 1.0));
        const cv::Vec3f unseen = (1 - haze) * ground_.hatch(gx, gy, footprint) + haze * kSkyLow;
        return seen[3] * shown + (1 - seen[3]) * unseen;
    }

private:
    // Row where the horizon crosses a column, or far below when the camera only looks down or up.
    double horizon_at(double x) const
    {
        if (std::abs(line_[1]) < 1e-15) return height_;
        return std::clamp(-(line_[0] * x + line_[2]) / line_[1], -4 * height_, 4 * height_);
    }

    const GroundTexture &ground_;
    double G_[9], line_[3], slope_ = 0, height_;
    int max_anisotropy_;
};

// What stands along a ray: the nearest firm box, and whether a suspected one is before it.
struct Sight {
    const BoxView *firm = nullptr;
    BoxHit hit;
    bool has_suspected = false;
};

class Painter {
public:
    Painter(const SiteModel &model, const Backdrop &backdrop, const oc_camera_t &camera, const RenderOptions &options)
        : backdrop_(backdrop), options_(options), boxes_(see_boxes(model, camera, options.near_m)),
          faces_(static_cast<int>(camera.k.height_px), static_cast<int>(camera.k.width_px), 0)
    {}

    void draw(Frame *frame)
    {
        for (int y = 0; y < faces_.rows; y++) draw_centres(y, frame);
        for (int y = 0; y < faces_.rows; y++) {
            for (int x = 0; x < faces_.cols; x++) {
                if (is_uniform(x, y, kFirstFace)) continue;
                frame->rgb(y, x) = cv::Vec3b(is_uniform(x, y, kNone) ? backdrop_.colour(x, y) : blended(x, y));
            }
        }
    }

private:
    // Values of faces_: the backdrop, a suspected box; from kFirstFace on: one face of one firm box.
    static constexpr int kNone = 0, kSuspectedFace = 1, kFirstFace = 2;

    Sight look(double x, double y, int pixel_x, int pixel_y) const
    {
        Sight sight;
        for (const BoxView &box : boxes_) {
            if (!box.reach().contains({pixel_x, pixel_y})) continue;
            const BoxHit hit = box.hit(x, y);
            if (!hit.is_hit || (sight.firm && hit.depth_m >= sight.hit.depth_m)) continue;
            if (box.is_suspected()) {
                sight.has_suspected = true;
                continue;
            }
            sight.firm = &box;
            sight.hit = hit;
        }
        return sight;
    }

    int face_of(const Sight &sight) const
    {
        if (sight.has_suspected) return kSuspectedFace;
        if (!sight.firm) return kNone;
        const int box = static_cast<int>(sight.firm - boxes_.data());
        return kFirstFace + 8 * box + 2 * (sight.hit.axis + 1) + (sight.hit.sign > 0 ? 1 : 0);
    }

    // Mask and faces at the pixels' centres, and the faces' colour there.
    void draw_centres(int y, Frame *frame)
    {
        int from = faces_.cols, to = 0;
        for (const BoxView &box : boxes_) {
            if (y < box.reach().y || y >= box.reach().br().y) continue;
            from = std::min(from, box.reach().x);
            to = std::max(to, box.reach().br().x);
        }
        for (int x = 0; x < faces_.cols; x++) frame->mask(y, x) = backdrop_.is_ground(x, y) ? kMaskGround : kMaskSky;
        for (int x = from; x < to; x++) {
            const Sight sight = look(x, y, x, y);
            faces_(y, x) = face_of(sight);
            if (!sight.firm) continue;
            frame->mask(y, x) = static_cast<unsigned char>(std::clamp(sight.firm->index(), 1, 253));
            if (!sight.has_suspected) frame->rgb(y, x) = cv::Vec3b(sight.firm->shade(sight.hit));
        }
    }

    // Are this pixel and its neighbours all on one face? least kFirstFace: of a firm box, so what draw_centres drew
    // stays; least kNone: of one or of the backdrop.
    bool is_uniform(int x, int y, int least) const
    {
        const int face = faces_(y, x);
        if (face < least || face == kSuspectedFace) return false;
        return (x == 0 || faces_(y, x - 1) == face) && (x + 1 == faces_.cols || faces_(y, x + 1) == face) &&
               (y == 0 || faces_(y - 1, x) == face) && (y + 1 == faces_.rows || faces_(y + 1, x) == face);
    }

    cv::Vec3f through(double x, double y, int pixel_x, int pixel_y, const cv::Vec3f &behind) const
    {
        const Sight sight = look(x, y, pixel_x, pixel_y);
        cv::Vec3f colour = sight.firm ? sight.firm->shade(sight.hit) : behind;
        if (!sight.has_suspected) return colour;
        for (const BoxView &box : boxes_) {
            if (!box.is_suspected() || !box.reach().contains({pixel_x, pixel_y})) continue;
            const BoxHit hit = box.hit(x, y);
            if (!hit.is_hit || (sight.firm && hit.depth_m >= sight.hit.depth_m)) continue;
            colour = 0.45f * colour + 0.55f * box.shade(hit);
        }
        return colour;
    }

    cv::Vec3f blended(int x, int y) const
    {
        const cv::Vec3f behind = backdrop_.colour(x, y);
        const int n = options_.supersample;
        cv::Vec3f sum(0, 0, 0);
        for (int i = 0; i < n * n; i++)
            sum += through(x + (i % n + 0.5) / n - 0.5, y + (i / n + 0.5) / n - 0.5, x, y, behind);
        return sum * (1.f / static_cast<float>(n * n));
    }

    const Backdrop &backdrop_;
    const RenderOptions &options_;
    std::vector<BoxView> boxes_;
    cv::Mat1i faces_;
};

} // namespace

Frame render_boxes(const SiteModel &model, const GroundTexture &ground, const oc_camera_t &camera,
                   const RenderOptions &options)
{
    double centre[3];
    oc_pose_centre(&camera.pose, centre);
    if (!oc_intrinsics_is_valid(&camera.k) || !oc_pose_is_valid(&camera.pose) || !(centre[2] > 0))
        throw std::invalid_argument("the virtual camera is not valid or not above the ground");
    if (options.supersample < 1 || options.supersample > 4 || options.max_anisotropy < 1 ||
        options.max_anisotropy > 16 || !(options.near_m > 0))
        throw std::invalid_argument("render options are out of range");
    const int width = static_cast<int>(camera.k.width_px), height = static_cast<int>(camera.k.height_px);
    Frame frame{cv::Mat3b(height, width), cv::Mat1b(height, width)};
    const Backdrop backdrop(ground, camera, options.max_anisotropy);
    Painter(model, backdrop, camera, options).draw(&frame);
    return frame;
}

} // namespace outcrop
