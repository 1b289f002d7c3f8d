// SPDX-License-Identifier: BSD-3-Clause
// Sky, ground, boxes.
#include "site/render.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <Eigen/Core>

#include "core/plane.h"

namespace outcrop {
namespace {

const cv::Vec3f kSkyTop(150, 178, 208), kSkyLow(222, 229, 236);
const cv::Vec3f kUnseenDark(112, 112, 116), kUnseenLight(140, 140, 144);
const cv::Vec3f kSuspected(240, 170, 30);

// Distinct on grey ground and in the sun.
const std::array<cv::Vec3f, 8> kPalette = {cv::Vec3f(214, 92, 66),  cv::Vec3f(58, 128, 196), cv::Vec3f(232, 178, 58),
                                           cv::Vec3f(92, 160, 88),  cv::Vec3f(150, 102, 178), cv::Vec3f(72, 172, 172),
                                           cv::Vec3f(204, 120, 150), cv::Vec3f(150, 130, 90)};

// Light from the upper left of a north-up map.
const Eigen::Vector3d kLight = Eigen::Vector3d(-0.45, 0.35, 0.82).normalized();

struct Ray {
    Eigen::Vector3d from, along;  // along has z-depth 1 in the camera, so t is z-depth
};

class Viewer {
public:
    explicit Viewer(const oc_camera_t &camera) : camera_(camera)
    {
        double centre[3];
        oc_pose_centre(&camera.pose, centre);
        centre_ = Eigen::Vector3d(centre[0], centre[1], centre[2]);
    }

    Ray ray(double x, double y) const
    {
        const oc_intrinsics_t &k = camera_.k;
        const double a = (x - k.cx_px) / k.fx_px, b = (y - k.cy_px) / k.fy_px;
        const double *R = camera_.pose.R;
        return {centre_, {R[0] * a + R[3] * b + R[6], R[1] * a + R[4] * b + R[7], R[2] * a + R[5] * b + R[8]}};
    }

    const Eigen::Vector3d &centre() const { return centre_; }

private:
    oc_camera_t camera_;
    Eigen::Vector3d centre_;
};

// A box made ready for rays.
struct Box {
    int index = 0;
    bool is_suspected = false;
    double c = 1, s = 0;
    Eigen::Vector3d centre, half;
    cv::Vec3f colour;
    cv::Rect reach;  // pixels that may show it
};

struct Hit {
    bool is_hit = false;
    double depth = 0;
    int axis = 0;
    double sign = 1;
    Eigen::Vector3d at;  // in the box's frame
};

Eigen::Vector3d into_box(const Box &box, const Eigen::Vector3d &v)
{
    return {box.c * v.x() + box.s * v.y(), -box.s * v.x() + box.c * v.y(), v.z()};
}

Hit intersect(const Box &box, const Ray &ray, double near_m)
{
    const Eigen::Vector3d from = into_box(box, ray.from - box.centre), along = into_box(box, ray.along);
    double enter = near_m, leave = std::numeric_limits<double>::infinity();
    int axis = -1;
    double sign = 1;
    for (int i = 0; i < 3; i++) {
        if (along[i] == 0) {
            if (std::abs(from[i]) > box.half[i]) return {};
            continue;
        }
        const double side = along[i] > 0 ? -1 : 1;  // of the face that is entered
        const double t_in = (side * box.half[i] - from[i]) / along[i], t_out = (-side * box.half[i] - from[i]) / along[i];
        if (t_in > enter) {
            enter = t_in;
            axis = i;
            sign = side;
        }
        leave = std::min(leave, t_out);
    }
    if (enter > leave) return {};
    Hit hit;
    hit.is_hit = true;
    hit.depth = enter;
    hit.axis = axis;  // -1: the camera is inside
    hit.sign = sign;
    hit.at = from + enter * along;
    return hit;
}

cv::Vec3f shade(const Box &box, const Hit &hit, double pixel_m)
{
    if (hit.axis < 0) return 0.35f * box.colour;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    normal[hit.axis] = hit.sign;
    const Eigen::Vector3d in_world(box.c * normal.x() - box.s * normal.y(), box.s * normal.x() + box.c * normal.y(),
                                   normal.z());
    const double light = 0.55 + 0.45 * std::max(0.0, in_world.dot(kLight)) + 0.08 * in_world.y();
    double edge = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; i++) {
        if (i != hit.axis) edge = std::min(edge, box.half[i] - std::abs(hit.at[i]));
    }
    // Lines of about a pixel and a half along the edges.
    const double line = 0.55 + 0.45 * std::clamp((edge / pixel_m - 0.8) / 1.0, 0.0, 1.0);
    return static_cast<float>(light * line) * box.colour;
}

cv::Rect reach_of(const Box &box, const oc_camera_t &camera, double near_m)
{
    const int width = static_cast<int>(camera.k.width_px), height = static_cast<int>(camera.k.height_px);
    double x0 = 1e9, y0 = 1e9, x1 = -1e9, y1 = -1e9;
    for (int corner = 0; corner < 8; corner++) {
        const double a = (corner & 1 ? 1 : -1) * box.half.x(), b = (corner & 2 ? 1 : -1) * box.half.y();
        const double p[3] = {box.centre.x() + box.c * a - box.s * b, box.centre.y() + box.s * a + box.c * b,
                             box.centre.z() + (corner & 4 ? 1 : -1) * box.half.z()};
        double u = 0, v = 0;
        if (!(oc_camera_project(&camera, p, &u, &v) > near_m)) return {0, 0, width, height};
        x0 = std::min(x0, u);
        x1 = std::max(x1, u);
        y0 = std::min(y0, v);
        y1 = std::max(y1, v);
    }
    const auto clip = [](double v, int side) { return static_cast<int>(std::clamp(v, -1.0, side + 1.0)); };
    const cv::Point low(clip(std::floor(x0) - 1, width), clip(std::floor(y0) - 1, height));
    const cv::Point high(clip(std::ceil(x1) + 2, width), clip(std::ceil(y1) + 2, height));
    return cv::Rect(low, high) & cv::Rect(0, 0, width, height);
}

std::vector<Box> boxes_of(const SiteModel &model, const oc_camera_t &camera, double near_m)
{
    std::vector<Box> out;
    for (const auto *list : {&model.obstacles, &model.suspected}) {
        for (const Obstacle &o : *list) {
            Box box;
            box.index = o.index;
            box.is_suspected = list == &model.suspected;
            box.c = std::cos(o.yaw_rad);
            box.s = std::sin(o.yaw_rad);
            box.centre = o.obb_centre;
            box.half = 0.5 * o.obb_size;
            box.colour = box.is_suspected ? kSuspected : kPalette[static_cast<std::size_t>(o.index - 1) % kPalette.size()];
            box.reach = reach_of(box, camera, near_m);
            out.push_back(box);
        }
    }
    return out;
}

// Stripes fixed to the ground; they melt into their mean where a pixel covers more than a stripe.
cv::Vec3f hatch(double x, double y, double period_m, double footprint_m)
{
    const double phase = (x + y) / (period_m * std::sqrt(2.0));
    const double wave = std::sin(2 * 3.14159265358979323846 * phase);
    const double contrast = std::clamp(1.5 - 2 * footprint_m / period_m, 0.0, 1.0);
    const double stripe = std::clamp(wave * period_m / (4 * std::max(footprint_m, 1e-9)), -1.0, 1.0);
    const auto mix = static_cast<float>(0.5 + 0.5 * contrast * stripe);
    return (1 - mix) * kUnseenDark + mix * kUnseenLight;
}

cv::Vec3f sky(double y, double horizon_y, double height)
{
    const auto t = static_cast<float>(std::clamp((horizon_y - y) / (0.6 * height), 0.0, 1.0));
    return (1 - t) * kSkyLow + t * kSkyTop;
}

// Where the horizon crosses a column, or far below when the camera only looks down.
double horizon_at(const double line[3], double x, double height)
{
    if (std::abs(line[1]) < 1e-15) return height;
    return std::clamp(-(line[0] * x + line[2]) / line[1], -4 * height, 4 * height);
}

void draw_ground(const GroundTexture &ground, const oc_camera_t &camera, const RenderOptions &options, Frame *frame)
{
    double G[9], line[3];
    if (oc_plane_ground_from_image(&camera, G) != OC_OK)
        throw std::invalid_argument("the virtual camera does not stand above the ground");
    oc_plane_horizon(G, line);
    const double height = camera.k.height_px;
    for (int y = 0; y < frame->rgb.rows; y++) {
        for (int x = 0; x < frame->rgb.cols; x++) {
            const double w = G[6] * x + G[7] * y + G[8];
            if (!(w > 0)) {
                const cv::Vec3f c = sky(y, horizon_at(line, x, height), height);
                frame->rgb(y, x) = cv::Vec3b(c);
                frame->mask(y, x) = kMaskSky;
                continue;
            }
            const double gx = (G[0] * x + G[1] * y + G[2]) / w, gy = (G[3] * x + G[4] * y + G[5]) / w;
            // Derivatives of the ground point: one pixel right, one pixel down.
            const cv::Vec2d du((G[0] - gx * G[6]) / w, (G[3] - gy * G[6]) / w);
            const cv::Vec2d dv((G[1] - gx * G[7]) / w, (G[4] - gy * G[7]) / w);
            const cv::Vec4f seen = ground.sample(gx, gy, du, dv, options.max_anisotropy);
            cv::Vec3f c(seen[0], seen[1], seen[2]);
            if (seen[3] < 1) {
                const double footprint = std::max(cv::norm(du), cv::norm(dv));
                c = seen[3] * c + (1 - seen[3]) * hatch(gx, gy, ground.hatch_period_m(), footprint);
            }
            frame->rgb(y, x) = cv::Vec3b(c);
        }
    }
}

// The colour that boxes give a sample, over what is behind; index is that of the nearest firm box.
cv::Vec3f through_boxes(const std::vector<const Box *> &boxes, const Ray &ray, double pixel_per_depth, double near_m,
                        const cv::Vec3f &behind, int *index)
{
    const Box *nearest = nullptr;
    Hit nearest_hit;
    for (const Box *box : boxes) {
        if (box->is_suspected) continue;
        const Hit hit = intersect(*box, ray, near_m);
        if (!hit.is_hit || (nearest && hit.depth >= nearest_hit.depth)) continue;
        nearest = box;
        nearest_hit = hit;
    }
    cv::Vec3f colour = behind;
    *index = 0;
    if (nearest) {
        colour = shade(*nearest, nearest_hit, nearest_hit.depth * pixel_per_depth);
        *index = nearest->index;
    }
    for (const Box *box : boxes) {
        if (!box->is_suspected) continue;
        const Hit hit = intersect(*box, ray, near_m);
        if (!hit.is_hit || (nearest && hit.depth >= nearest_hit.depth)) continue;
        colour = 0.45f * colour + 0.55f * shade(*box, hit, hit.depth * pixel_per_depth);
    }
    return colour;
}

void draw_boxes(const SiteModel &model, const oc_camera_t &camera, const RenderOptions &options, Frame *frame)
{
    const std::vector<Box> boxes = boxes_of(model, camera, options.near_m);
    cv::Mat1b touched(frame->mask.size(), static_cast<unsigned char>(0));
    for (const Box &box : boxes) touched(box.reach).setTo(255);
    const Viewer viewer(camera);
    const double pixel_per_depth = 1 / camera.k.fx_px;
    const int n = options.supersample;
    std::vector<const Box *> here;
    for (int y = 0; y < touched.rows; y++) {
        for (int x = 0; x < touched.cols; x++) {
            if (!touched(y, x)) continue;
            here.clear();
            for (const Box &box : boxes) {
                if (box.reach.contains({x, y})) here.push_back(&box);
            }
            const cv::Vec3f behind(frame->rgb(y, x));
            cv::Vec3f sum(0, 0, 0);
            int index = 0;
            for (int i = 0; i < n * n; i++) {
                const double sx = x + (i % n + 0.5) / n - 0.5, sy = y + (i / n + 0.5) / n - 0.5;
                sum += through_boxes(here, viewer.ray(sx, sy), pixel_per_depth, options.near_m, behind, &index);
            }
            frame->rgb(y, x) = cv::Vec3b(sum * (1.f / static_cast<float>(n * n)));
            through_boxes(here, viewer.ray(x, y), pixel_per_depth, options.near_m, behind, &index);
            if (index > 0) frame->mask(y, x) = cv::saturate_cast<unsigned char>(std::min(index, 253));
        }
    }
}

}  // namespace

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
    Frame frame{cv::Mat3b(height, width), cv::Mat1b(height, width, kMaskGround)};
    draw_ground(ground, camera, options, &frame);
    draw_boxes(model, camera, options, &frame);
    return frame;
}

}  // namespace outcrop
