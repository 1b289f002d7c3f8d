// SPDX-License-Identifier: BSD-3-Clause
// Requests follow from the settled model alone, so a complete link always ends with the same set of answers.
#include "site/shape_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <stdexcept>

#include <Eigen/Geometry>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "site/boxes.h"
#include "site/triangulate.h"

namespace outcrop {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;

// Of the wire: what a request takes besides, for each box and for each view (a gap of up to 14 ids apart).
constexpr std::size_t kRequestBytes = 18, kBoxBytes = 16, kViewBytes = 14;

// Texture bits for each pixel that shows something, and bytes for each tile whatever it shows.
constexpr double kTextureBits = 0.9, kTileBytes = 70;

oc_ground_box_t ground_box(const Obstacle &obstacle, bool is_subject)
{
    oc_ground_box_t box{};
    box.x_m = obstacle.obb_centre.x();
    box.y_m = obstacle.obb_centre.y();
    box.length_m = obstacle.obb_size.x();
    box.width_m = obstacle.obb_size.y();
    box.height_m = obstacle.aabb_max.z();
    // Folded so that rounding up never reaches pi.
    double yaw = std::fmod(obstacle.yaw_rad, kPi);
    if (yaw < 0) yaw += kPi;
    box.yaw_rad = yaw < kPi * (1 - 1.0 / 1024) ? yaw : 0;
    box.is_subject = is_subject;
    return box;
}

oc_pose_step_t pose_step(int id, const oc_camera_t &reported, const oc_camera_t &refined)
{
    oc_pose_step_t step{};
    step.view = static_cast<std::uint16_t>(id);
    const Vector3d move = camera_centre(refined) - camera_centre(reported);
    const Matrix3d by = camera_rotation(refined) * camera_rotation(reported).transpose();
    const Eigen::AngleAxisd turn(by);
    const Vector3d vector = turn.angle() * turn.axis();
    for (int k = 0; k < 3; k++) {
        step.move_m[k] = move[k];
        step.turn_rad[k] = vector[k];
    }
    return step;
}

bool can_travel(const oc_pose_step_t &step)
{
    for (int k = 0; k < 3; k++)
        if (!(std::abs(step.move_m[k]) < 3.27) || !(std::abs(step.turn_rad[k]) < 0.65)) return false;
    return true;
}

std::array<Vector3d, 8> corners(const Obstacle &box, double grow)
{
    const double c = std::cos(box.yaw_rad), s = std::sin(box.yaw_rad), more = grow * largest_side(box);
    std::array<Vector3d, 8> out;
    for (int i = 0; i < 8; i++) {
        const double along = ((i & 1) ? 1 : -1) * (box.obb_size.x() / 2 + more);
        const double across = ((i & 2) ? 1 : -1) * (box.obb_size.y() / 2 + more);
        out[static_cast<std::size_t>(i)] =
            Vector3d(box.obb_centre.x() + c * along - s * across, box.obb_centre.y() + s * along + c * across,
                     (i & 4) ? box.aabb_max.z() + more : 0);
    }
    return out;
}

// Bounding rectangle of a box in a view, cut by the image; empty when a corner is behind or nothing is inside.
cv::Rect box_in_view(const Obstacle &box, double grow, const oc_camera_t &camera)
{
    double low_x = 1e9, low_y = 1e9, high_x = -1e9, high_y = -1e9;
    for (const Vector3d &corner : corners(box, grow)) {
        double x, y;
        if (!(oc_camera_project(&camera, corner.data(), &x, &y) > 1e-3)) return {};
        low_x = std::min(low_x, x), high_x = std::max(high_x, x);
        low_y = std::min(low_y, y), high_y = std::max(high_y, y);
    }
    const double w = camera.k.width_px, h = camera.k.height_px;
    const int x0 = static_cast<int>(std::clamp(std::floor(low_x), 0.0, w));
    const int y0 = static_cast<int>(std::clamp(std::floor(low_y), 0.0, h));
    const int x1 = static_cast<int>(std::clamp(std::ceil(high_x) + 1, 0.0, w));
    const int y1 = static_cast<int>(std::clamp(std::ceil(high_y) + 1, 0.0, h));
    return {x0, y0, std::max(0, x1 - x0), std::max(0, y1 - y0)};
}

// A view that can be named in a request.
struct Eye {
    const RefinedView *view = nullptr;
    oc_pose_step_t step{};
    double azimuth = 0; // seen from the middle of the boxes
};

std::vector<Eye> eyes_of(const SiteModel &model, const std::map<int, View> &views, const Vector3d &middle)
{
    std::vector<Eye> eyes;
    for (const RefinedView &refined : model.views) {
        const auto view = views.find(refined.id);
        if (view == views.end()) continue;
        Eye eye;
        eye.view = &refined;
        eye.step = pose_step(refined.id, view->second.camera, refined.camera);
        const Vector3d from = camera_centre(refined.camera) - middle;
        eye.azimuth = std::atan2(from.y(), from.x());
        if (can_travel(eye.step)) eyes.push_back(eye);
    }
    return eyes;
}

// Up to n of the other eyes, from all round: the nearest to n evenly spread directions.
std::vector<const Eye *> references_of(const std::vector<Eye> &eyes, const Eye &target, std::size_t n)
{
    std::vector<const Eye *> others;
    for (const Eye &eye : eyes)
        if (&eye != &target) others.push_back(&eye);
    std::sort(others.begin(), others.end(), [](const Eye *a, const Eye *b) {
        return a->azimuth != b->azimuth ? a->azimuth < b->azimuth : a->view->id < b->view->id;
    });
    if (others.size() <= n) return others;
    std::vector<const Eye *> chosen;
    for (std::size_t i = 0; i < n; i++) chosen.push_back(others[i * others.size() / n]);
    return chosen;
}

class SilhouettePlanner {
public:
    SilhouettePlanner(const SiteModel &model, const std::map<int, View> &views, const ShapeOptions &options)
        : model_(model), views_(views), options_(options)
    {}

    // Obstacles in runs of neighbours, each with the boxes nearest to the run in the way.
    std::vector<SilhouettePlan> plan()
    {
        const std::size_t room = options_.datagram_bytes > kRequestBytes ? options_.datagram_bytes - kRequestBytes : 0;
        // A third of a small datagram may go to boxes; in the usual one all 32 fit.
        const std::size_t most =
            std::clamp<std::size_t>(std::min(room / 2, room * 2 / 5) / kBoxBytes, 1, OC_MAX_SILHOUETTE_BOXES);
        std::vector<bool> is_done(model_.obstacles.size(), false);
        for (std::size_t first = 0; first < model_.obstacles.size(); first++) {
            if (is_done[first]) continue;
            add_requests(nearest_boxes(first, most), &is_done);
        }
        return std::move(plans_);
    }

private:
    struct Near {
        double distance;
        bool is_suspected;
        std::size_t index;
        bool operator<(const Near &o) const
        {
            return std::tie(distance, is_suspected, index) < std::tie(o.distance, o.is_suspected, o.index);
        }
    };

    std::vector<Near> nearest_boxes(std::size_t first, std::size_t most) const
    {
        std::vector<Near> near;
        const auto add = [&](const std::vector<Obstacle> &boxes, bool is_suspected) {
            for (std::size_t i = 0; i < boxes.size(); i++) {
                const Vector3d off = boxes[i].obb_centre - model_.obstacles[first].obb_centre;
                near.push_back({off.head<2>().norm(), is_suspected, i});
            }
        };
        add(model_.obstacles, false);
        add(model_.suspected, true);
        std::sort(near.begin(), near.end());
        if (near.size() > most) near.resize(most);
        return near;
    }

    // Subjects: of the boxes those not done whose own neighbours are here too (the nearer half), the first always.
    void add_requests(const std::vector<Near> &near, std::vector<bool> *is_done)
    {
        SilhouettePlan base;
        const bool is_all = near.size() == model_.obstacles.size() + model_.suspected.size();
        Vector3d middle = Vector3d::Zero();
        std::vector<const Obstacle *> subjects;
        for (std::size_t i = 0; i < near.size(); i++) {
            const Near &one = near[i];
            const Obstacle &box = one.is_suspected ? model_.suspected[one.index] : model_.obstacles[one.index];
            const bool is_subject = !one.is_suspected && !(*is_done)[one.index] && (is_all || i <= near.size() / 2);
            base.request.boxes[base.request.n_boxes++] = ground_box(box, is_subject);
            base.obstacle.push_back(is_subject ? static_cast<int>(one.index) : -1);
            if (!is_subject) continue;
            (*is_done)[one.index] = true;
            subjects.push_back(&box);
            middle += box.obb_centre;
        }
        middle /= static_cast<double>(subjects.size());
        base.request.step_px = static_cast<std::uint8_t>(options_.step_px);
        base.request.grow_percent = static_cast<std::uint8_t>(std::lround(options_.grow_share * 100));
        base.request.is_thesis = options_.is_thesis;
        add_views(base, subjects, eyes_of(model_, views_, middle));
    }

    bool shows(const Eye &eye, const std::vector<const Obstacle *> &subjects) const
    {
        return std::any_of(subjects.begin(), subjects.end(), [&](const Obstacle *box) {
            return box_in_view(*box, options_.grow_share, eye.view->camera).area() > 0;
        });
    }

    void add_views(const SilhouettePlan &base, const std::vector<const Obstacle *> &subjects,
                   const std::vector<Eye> &eyes)
    {
        const std::size_t taken = kRequestBytes + kBoxBytes * base.request.n_boxes;
        const std::size_t room = options_.datagram_bytes > taken ? options_.datagram_bytes - taken : 0;
        const std::size_t fit = std::min<std::size_t>(room / kViewBytes, OC_MAX_SILHOUETTE_VIEWS);
        if (fit < 2) return;
        if (eyes.size() <= fit) {
            std::vector<const Eye *> all;
            std::set<int> wanted;
            for (const Eye &eye : eyes) {
                all.push_back(&eye);
                if (shows(eye, subjects)) wanted.insert(eye.view->id);
            }
            add(base, all, wanted);
            return;
        }
        for (const Eye &eye : eyes) {
            if (!shows(eye, subjects)) continue;
            std::vector<const Eye *> some = references_of(eyes, eye, fit - 1);
            some.push_back(&eye);
            add(base, some, {eye.view->id});
        }
    }

    void add(const SilhouettePlan &base, std::vector<const Eye *> eyes, const std::set<int> &wanted)
    {
        if (wanted.empty()) return;
        SilhouettePlan plan = base;
        std::sort(eyes.begin(), eyes.end(), [](const Eye *a, const Eye *b) { return a->view->id < b->view->id; });
        for (const Eye *eye : eyes) {
            oc_pose_step_t step = eye->step;
            step.is_wanted = wanted.count(eye->view->id) > 0;
            plan.request.views[plan.request.n_views++] = step;
        }
        // The key is of the coded request.
        std::uint8_t buf[OC_MAX_DATAGRAM_BYTES];
        std::size_t n_bytes = 0;
        const oc_packet_head_t head{};
        if (oc_packet_encode_silhouette_request(&head, &plan.request, buf, options_.datagram_bytes, &n_bytes,
                                                &plan.key) == OC_OK)
            plans_.push_back(std::move(plan));
    }

    const SiteModel &model_;
    const std::map<int, View> &views_;
    const ShapeOptions &options_;
    std::vector<SilhouettePlan> plans_;
};

// Cells into the pixels of a whole view.
void paint_cells(const oc_silhouette_t &s, const std::vector<std::uint8_t> &cells, cv::Mat1b *labels)
{
    for (int r = 0; r < s.n_rows; r++) {
        for (int c = 0; c < s.n_cols; c++) {
            const cv::Rect place((s.col + c) * s.step_px, (s.row + r) * s.step_px, s.step_px, s.step_px);
            const cv::Rect inside = place & cv::Rect(0, 0, labels->cols, labels->rows);
            const auto cell = static_cast<std::size_t>(r) * s.n_cols + static_cast<std::size_t>(c);
            if (inside.area() > 0) (*labels)(inside).setTo(cells[cell]);
        }
    }
}

// 255 inside the projection of the box that was asked about. The labels beside it mean nothing; whatever is there is not
// of this obstacle, which for its volume is the same as ground.
cv::Mat1b projection_of(const oc_ground_box_t &asked, double grow, const oc_camera_t &camera, const cv::Size &size)
{
    Obstacle box;
    box.obb_centre = Vector3d(asked.x_m, asked.y_m, asked.height_m / 2);
    box.obb_size = Vector3d(asked.length_m, asked.width_m, asked.height_m);
    box.aabb_max.z() = asked.height_m;
    box.yaw_rad = asked.yaw_rad;
    cv::Mat1b inside = cv::Mat1b::zeros(size);
    constexpr int kShift = 4;
    std::vector<cv::Point> points, hull;
    for (const Vector3d &corner : corners(box, grow)) {
        double x, y;
        if (!(oc_camera_project(&camera, corner.data(), &x, &y) > 1e-3)) return inside;
        const auto fixed = [](double v) { return static_cast<int>(std::lround(std::clamp(v, -8e3, 8e3) * 16)); };
        points.emplace_back(fixed(x), fixed(y));
    }
    cv::convexHull(points, hull);
    cv::fillConvexPoly(inside, hull, cv::Scalar(255), cv::LINE_8, kShift);
    return inside;
}

} // namespace

void ShapeOptions::check() const
{
    if (step_px != 1 && step_px != 2 && step_px != 4) throw std::invalid_argument("shapes: step_px must be 1, 2 or 4");
    if (texture_step_px != 1 && texture_step_px != 2 && texture_step_px != 4)
        throw std::invalid_argument("shapes: texture_step_px must be 1, 2 or 4");
    if (!(grow_share >= 0) || !(grow_share <= 1)) throw std::invalid_argument("shapes: grow_share must be 0..1");
    if (texture_tile_px < 16 || texture_tile_px > 128 || texture_quality < 1 || texture_quality > 100 ||
        texture_views < 1)
        throw std::invalid_argument("shapes: texture tiles 16..128 px, quality 1..100, at least one view");
}

std::vector<SilhouettePlan> plan_silhouettes(const SiteModel &model, const std::map<int, View> &views,
                                             const ShapeOptions &options)
{
    options.check();
    return SilhouettePlanner(model, views, options).plan();
}

std::vector<CarveView> gather_silhouettes(const SiteModel &model, const std::map<int, View> &views,
                                          const std::vector<SilhouettePlan> &plans,
                                          const std::map<SilhouetteKey, std::vector<std::uint8_t>> &silhouettes,
                                          int obstacle)
{
    std::vector<CarveView> out;
    std::vector<std::uint8_t> cells(OC_MAX_SILHOUETTE_CELLS);
    for (const RefinedView &refined : model.views) {
        if (views.count(refined.id) == 0) continue;
        CarveView view;
        view.id = refined.id;
        view.camera = refined.camera;
        for (const SilhouettePlan &plan : plans) {
            for (std::size_t box = 0; box < plan.obstacle.size(); box++) {
                if (plan.obstacle[box] != obstacle) continue;
                const auto found = silhouettes.find(
                    {static_cast<std::uint16_t>(refined.id), plan.key, static_cast<std::uint8_t>(box)});
                if (found == silhouettes.end()) continue;
                oc_silhouette_t head;
                if (oc_packet_decode_silhouette(found->second.data(), found->second.size(), &head, cells.data(),
                                                cells.size()) != OC_OK)
                    continue;
                if (view.labels.empty())
                    view.labels = cv::Mat1b(static_cast<int>(view.camera.k.height_px),
                                            static_cast<int>(view.camera.k.width_px), std::uint8_t{OC_LABEL_UNKNOWN});
                const double grow = plan.request.grow_percent * 0.01;
                paint_cells(head, cells, &view.labels);
                view.labels.setTo(OC_LABEL_GROUND,
                                  projection_of(plan.request.boxes[box], grow, view.camera, view.labels.size()) == 0);
            }
        }
        if (!view.labels.empty()) out.push_back(std::move(view));
    }
    return out;
}

std::vector<TexturePlan> plan_textures(const SiteModel &model, const std::vector<std::vector<CarveView>> &carve,
                                       const ShapeOptions &options)
{
    options.check();
    const int reach = options.texture_tile_px * options.texture_step_px;
    std::map<int, std::map<int, double>> tiles; // view -> tile -> share of it that shows something
    for (std::size_t i = 0; i < carve.size(); i++) {
        std::vector<std::pair<const CarveView *, cv::Mat1b>> seen;
        for (const CarveView &view : carve[i]) {
            const cv::Rect rect = box_in_view(model.obstacles[i], options.grow_share, view.camera);
            if (rect.area() == 0) continue;
            cv::Mat1b solid = cv::Mat1b::zeros(view.labels.size());
            cv::Mat(view.labels(rect) == OC_LABEL_OBSTACLE).copyTo(solid(rect));
            if (cv::countNonZero(solid) > 0) seen.emplace_back(&view, solid);
        }
        // Greedily: many pixels of it, and a direction that none chosen has.
        std::vector<std::pair<double, std::size_t>> chosen; // azimuth, index in seen
        std::set<std::size_t> is_taken;
        while (chosen.size() < static_cast<std::size_t>(options.texture_views) && is_taken.size() < seen.size()) {
            double best = -1, best_azimuth = 0;
            std::size_t best_index = 0;
            for (std::size_t k = 0; k < seen.size(); k++) {
                if (is_taken.count(k)) continue;
                const Vector3d from = camera_centre(seen[k].first->camera) - model.obstacles[i].obb_centre;
                const double azimuth = std::atan2(from.y(), from.x());
                double apart = kPi;
                for (const auto &[other, index] : chosen)
                    apart = std::min(apart, std::abs(std::remainder(azimuth - other, 2 * kPi)));
                const double worth = std::sqrt(static_cast<double>(cv::countNonZero(seen[k].second))) *
                                     std::min(1.0, apart * options.texture_views / (2 * kPi));
                if (worth > best) best = worth, best_azimuth = azimuth, best_index = k;
            }
            chosen.emplace_back(best_azimuth, best_index);
            is_taken.insert(best_index);
        }
        for (const auto &[azimuth, index] : chosen) {
            const cv::Mat1b &solid = seen[index].second;
            const int across = (solid.cols + reach - 1) / reach;
            for (int y = 0; y < solid.rows; y += reach) {
                for (int x = 0; x < solid.cols; x += reach) {
                    const cv::Rect tile = cv::Rect(x, y, reach, reach) & cv::Rect(0, 0, solid.cols, solid.rows);
                    const int n = cv::countNonZero(solid(tile));
                    if (n > 0) tiles[seen[index].first->id][y / reach * across + x / reach] += n;
                }
            }
        }
    }
    std::vector<TexturePlan> plans;
    const double px_per_texel = options.texture_step_px * options.texture_step_px;
    for (const auto &[id, of_view] : tiles) {
        TexturePlan plan;
        plan.request.view = static_cast<std::uint16_t>(id);
        plan.request.step_px = static_cast<std::uint8_t>(options.texture_step_px);
        plan.request.tile_px = static_cast<std::uint8_t>(options.texture_tile_px);
        plan.request.quality = static_cast<std::uint8_t>(options.texture_quality);
        plan.request.is_masked = true;
        for (const auto &[tile, n] : of_view) {
            if (plan.request.n_tiles == OC_MAX_TEXTURE_TILES) break;
            plan.request.tiles[plan.request.n_tiles++] = static_cast<std::uint16_t>(tile);
            plan.estimate_bytes += kTileBytes + n / px_per_texel * kTextureBits / 8;
        }
        plan.request.budget_bytes =
            static_cast<std::uint32_t>(std::min(2 * plan.estimate_bytes + 2000, static_cast<double>((1u << 24) - 1)));
        plans.push_back(plan);
    }
    return plans;
}

namespace {

// Full size, RGB; nothing when the bytes are no picture of that size.
cv::Mat decode_texture(const TileBlob &blob, int side, int reach)
{
    const cv::Mat bgr = cv::imdecode(blob.bytes, cv::IMREAD_COLOR);
    if (bgr.empty() || bgr.cols != side || bgr.rows != side) return {};
    cv::Mat rgb, large;
    cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
    cv::resize(rgb, large, cv::Size(reach, reach), 0, 0, cv::INTER_LINEAR);
    return large;
}

} // namespace

int gather_textures(const std::map<TextureKey, TileBlob> &textures, const std::vector<TexturePlan> &plans,
                    const ShapeOptions &options, std::vector<CarveView> *views)
{
    int n_bad = 0;
    const int reach = options.texture_tile_px * options.texture_step_px;
    for (CarveView &view : *views) {
        const int width = static_cast<int>(view.camera.k.width_px), height = static_cast<int>(view.camera.k.height_px);
        const int across = (width + reach - 1) / reach;
        for (const TexturePlan &plan : plans) {
            if (plan.request.view != view.id) continue;
            for (std::size_t i = 0; i < plan.request.n_tiles; i++) {
                const int tile = plan.request.tiles[i];
                const auto blob = textures.find(
                    {plan.request.view, plan.request.step_px, plan.request.tile_px, plan.request.tiles[i]});
                const cv::Rect inside = cv::Rect(tile % across * reach, tile / across * reach, reach, reach) &
                                        cv::Rect(0, 0, width, height);
                if (blob == textures.end() || inside.area() == 0) continue;
                const cv::Mat pixels = decode_texture(blob->second, options.texture_tile_px, reach);
                if (pixels.empty()) {
                    n_bad++;
                    continue;
                }
                if (view.rgb.empty()) {
                    view.rgb = cv::Mat3b(height, width, cv::Vec3b(0, 0, 0));
                    view.known = cv::Mat1b::zeros(height, width);
                }
                pixels(cv::Rect(0, 0, inside.width, inside.height)).copyTo(view.rgb(inside));
                view.known(inside).setTo(255);
            }
        }
        // What was flattened is no colour of anything.
        if (!view.known.empty()) view.known.setTo(0, view.labels == OC_LABEL_GROUND);
    }
    return n_bad;
}

} // namespace outcrop
