// SPDX-License-Identifier: BSD-3-Clause
// The steps of the whole model, each on the little that a view touches.
#include "site/incremental.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "site/boxes.h"
#include "site/cluster.h"
#include "site/refine.h"
#include "site/tracks.h"
#include "site/triangulate.h"

namespace outcrop {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Middle of the bounds of an automatic t_M: what a site's own gap cannot be waited for.
constexpr double kShareOfBounds = 0.5;

PairMatcher default_matcher(const BuildOptions &options)
{
    return [options](const PosedView &left, const PosedView &right, const Area &area, oc_angle_error_t angles) {
        MatchOptions match = options.match;
        match.strip.angles = angles;
        const PreparedView a(left, match.correlate), b(right, match.correlate);
        return match_pair(a, b, area, match).pair;
    };
}

// Where the optical axis meets the ground, no farther than the area is wide.
Vector2d gaze_of(const oc_camera_t &camera, const Area &area)
{
    const Vector3d centre = camera_centre(camera);
    Vector3d ray;
    oc_camera_ray(&camera, camera.k.cx_px, camera.k.cy_px, ray.data());
    const double reach = std::hypot(area.x_max - area.x_min, area.y_max - area.y_min);
    const double down = ray.z() < 0 ? -centre.z() / ray.z() : reach;
    return (centre + std::min(down, reach) * ray).head<2>();
}

} // namespace

void IncrementalOptions::check() const
{
    build.check();
    if (max_neighbours < 1 || max_candidates < max_neighbours)
        throw std::invalid_argument("incremental: 1 <= max_neighbours <= max_candidates");
}

IncrementalSite::IncrementalSite(const Area &area, const IncrementalOptions &options, PairMatcher matcher)
    : area_(area), options_(options), matcher_(std::move(matcher))
{
    options_.check();
    if (!(area.x_max > area.x_min) || !(area.y_max > area.y_min) || !(area.z_max > 0))
        throw std::invalid_argument("incremental: the area must have x, y ascending and z_max > 0");
    if (!matcher_) matcher_ = default_matcher(options_.build);
    diagonal_ = std::hypot(area.x_max - area.x_min, area.y_max - area.y_min);
    const ClusterOptions &cluster = options_.build.cluster;
    t_m_ = cluster.t_m_m > 0
               ? cluster.t_m_m
               : diagonal_ * (cluster.min_t_m_share + kShareOfBounds * (cluster.max_t_m_share - cluster.min_t_m_share));
}

// Up to max_candidates that look at the nearest places, of these the pairs that are worth most.
std::vector<int> IncrementalSite::neighbours_of(const Placed &fresh) const
{
    std::vector<std::pair<double, int>> near;
    for (const auto &[id, placed] : views_) near.emplace_back((placed.gaze - fresh.gaze).norm(), id);
    const auto n = std::min<std::size_t>(near.size(), static_cast<std::size_t>(options_.max_candidates));
    std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(n), near.end());
    near.resize(n);
    std::vector<PosedView> posed{{&fresh.view, fresh.camera, fresh.margin}};
    for (const auto &[distance, id] : near) {
        const Placed &placed = views_.at(id);
        posed.push_back({&placed.view, placed.camera, placed.margin});
    }
    // Sampled round what the new view looks at: an area of many such places would be sampled too coarsely.
    const double reach = (camera_centre(fresh.camera).head<2>() - fresh.gaze).norm() + camera_centre(fresh.camera).z();
    Area here = area_;
    here.x_min = fresh.gaze.x() - reach, here.x_max = fresh.gaze.x() + reach;
    here.y_min = fresh.gaze.y() - reach, here.y_max = fresh.gaze.y() + reach;
    if (!(reach > 0)) here = area_;
    std::vector<ViewPair> pairs = select_pairs(posed, here, options_.build.pairs);
    pairs.erase(std::remove_if(pairs.begin(), pairs.end(), [](const ViewPair &p) { return p.left != 0; }), pairs.end());
    std::stable_sort(pairs.begin(), pairs.end(),
                     [](const ViewPair &a, const ViewPair &b) { return a.worth > b.worth; });
    std::vector<int> neighbours;
    for (const ViewPair &pair : pairs)
        if (static_cast<int>(neighbours.size()) < options_.max_neighbours)
            neighbours.push_back(near[static_cast<std::size_t>(pair.right - 1)].second);
    return neighbours;
}

// Finds the pose of a new view with its neighbours held, and takes its matches with them.
void IncrementalSite::place(Placed *fresh, const std::vector<int> &neighbours)
{
    std::vector<View> local{fresh->view};
    for (const int id : neighbours) {
        View held = views_.at(id).view;
        held.camera = views_.at(id).camera;
        held.margin = oc_margin_t{};
        local.push_back(std::move(held));
    }
    std::sort(local.begin(), local.end(), [](const View &a, const View &b) { return a.id < b.id; });
    const auto own = static_cast<std::size_t>(
        std::find_if(local.begin(), local.end(), [&](const View &v) { return v.id == fresh->view.id; }) -
        local.begin());
    const bool is_exact = std::all_of(std::begin(fresh->view.margin.v), std::end(fresh->view.margin.v),
                                      [&](double a) { return a < options_.build.refine.exact_sigma; });
    oc_angle_error_t angles = options_.build.match.strip.angles;
    std::vector<Matrix6d> covariances;
    const auto refine = [&](const std::vector<Track> &tracks) {
        const RefineResult result = refine_poses(local, tracks, options_.build.refine);
        fresh->camera = result.views[own].camera;
        fresh->refined = result.views[own];
        fresh->margin = result.matching_margins[own];
        covariances = result.relative_covariances;
        angles = OC_ANGLE_ERROR_LOCAL;
    };
    const auto match = [&] {
        std::vector<PairMatches> pairs;
        for (const View &other : local) {
            if (other.id == fresh->view.id) continue;
            const Placed &placed = views_.at(other.id);
            const PosedView mine{&fresh->view, fresh->camera, fresh->margin};
            const PosedView theirs{&placed.view, placed.camera, placed.margin};
            const bool is_left = fresh->view.id < other.id;
            pairs.push_back(matcher_(is_left ? mine : theirs, is_left ? theirs : mine, area_, angles));
            n_pairs_++;
        }
        std::vector<oc_camera_t> cameras;
        for (const View &view : local) cameras.push_back(view.id == fresh->view.id ? fresh->camera : view.camera);
        return settle_tracks(local, cameras, is_exact ? std::vector<Matrix6d>() : covariances,
                             merge_tracks(local, pairs), area_, options_.build.tracks);
    };
    if (!is_exact) refine({});
    std::vector<Track> tracks = match();
    if (!is_exact) {
        refine(tracks);
        tracks = match();
    }
    const int id = fresh->view.id;
    fresh->gaze = gaze_of(fresh->camera, area_);
    views_[id] = std::move(*fresh);
    std::set<int> touched;
    take_tracks(local, tracks, &touched);
    regroup(touched);
}

void IncrementalSite::add_view(const View &view)
{
    const std::string name = "incremental: view " + std::to_string(view.id);
    if (views_.count(view.id) > 0) throw std::invalid_argument(name + " is there already");
    if (!oc_intrinsics_is_valid(&view.camera.k) || !oc_pose_is_valid(&view.camera.pose))
        throw std::invalid_argument(name + " has a camera that is not valid");
    for (const double half_width : view.margin.v)
        if (!(half_width >= 0) || !std::isfinite(half_width))
            throw std::invalid_argument(name + " has a margin that is negative or not a number");
    n_pairs_ = n_renewed_ = 0;
    Placed fresh;
    fresh.view = view;
    fresh.camera = view.camera;
    fresh.margin = view.margin;
    fresh.refined.id = view.id;
    fresh.refined.camera = view.camera;
    for (int k = 0; k < 6; ++k) fresh.refined.posterior.v[k] = view.margin.v[k] / std::sqrt(3.0);
    fresh.gaze = gaze_of(view.camera, area_);
    place(&fresh, neighbours_of(fresh));
}

bool IncrementalSite::remove_view(int id)
{
    const auto found = views_.find(id);
    if (found == views_.end()) return false;
    n_pairs_ = n_renewed_ = 0;
    std::set<int> touched;
    const std::set<int> seen = found->second.points;
    for (const int p : seen) {
        Point &point = points_.at(p);
        point.sightings.erase(id);
        erase_cell(p);
        if (point.sightings.size() >= 2 && refit(p)) {
            insert_cell(p);
            touched.insert(p);
        } else {
            drop_point(p, &touched);
        }
    }
    views_.erase(id);
    regroup(touched);
    return true;
}

bool IncrementalSite::repose_view(int id, const oc_camera_t &camera, const oc_margin_t &margin)
{
    const auto found = views_.find(id);
    if (found == views_.end()) return false;
    View view = found->second.view;
    view.camera = camera;
    view.margin = margin;
    remove_view(id);
    add_view(view);
    return true;
}

// ---- points ----

// Each track of obstacles joins the point that one of its older sightings belongs to, or is a new one.
void IncrementalSite::take_tracks(const std::vector<View> &local, const std::vector<Track> &tracks,
                                  std::set<int> *touched)
{
    for (const Track &track : tracks) {
        if (track.kind == MatchKind::kGround) continue;
        std::map<int, int> sightings;
        for (const TrackPixel &pixel : track.pixels)
            sightings[local[static_cast<std::size_t>(pixel.view)].id] = pixel.junction;
        int known = -1;
        for (const auto &[id, point] : points_of(sightings)) {
            (void)id;
            known = known < 0 ? point : std::min(known, point);
        }
        if (known < 0) {
            known = next_point_++;
            Point &point = points_[known];
            point.site.position = track.fit.point;
            point.site.covariance = track.fit.covariance;
        } else {
            erase_cell(known);
        }
        Point &point = points_.at(known);
        const std::map<int, int> before = point.sightings;
        for (const auto &[id, junction] : sightings) point.sightings.emplace(id, junction);
        if (!refit(known)) { // does not fit what is there: it stays as it was
            point.sightings = before;
            if (before.empty()) {
                points_.erase(known);
                continue;
            }
            refit(known);
        }
        point.site.score = std::max(point.site.score, track.score);
        point.site.is_doubtful = track.is_doubtful && point.sightings.size() == 2;
        for (const auto &[id, junction] : point.sightings) views_.at(id).points.insert(known);
        insert_cell(known);
        touched->insert(known);
    }
}

// The points that these sightings belong to already.
std::map<int, int> IncrementalSite::points_of(const std::map<int, int> &sightings) const
{
    std::map<int, int> found;
    for (const auto &[id, junction] : sightings)
        for (const int p : views_.at(id).points)
            if (points_.at(p).sightings.at(id) == junction) found[id] = p;
    return found;
}

bool IncrementalSite::refit(int index)
{
    Point &point = points_.at(index);
    std::vector<Sighting> sightings;
    for (const auto &[id, junction] : point.sightings) {
        const Placed &placed = views_.at(id);
        const oc_junction_t &j = placed.view.junctions[static_cast<std::size_t>(junction)];
        sightings.push_back({&placed.camera, static_cast<double>(j.x_px), static_cast<double>(j.y_px), nullptr});
    }
    const std::optional<Triangulated> fit = triangulate(sightings, options_.build.tracks.triangulate);
    n_renewed_++;
    if (!fit) return false;
    point.site.position = fit->point;
    point.site.covariance = fit->covariance;
    point.site.n_views = static_cast<int>(point.sightings.size());
    return true;
}

// The points of its group are looked at again without it.
void IncrementalSite::drop_point(int index, std::set<int> *around)
{
    const Point &point = points_.at(index);
    for (const auto &[id, junction] : point.sightings) views_.at(id).points.erase(index);
    const auto group = groups_.find(point.group);
    if (group != groups_.end()) {
        group->second.points.erase(index);
        around->insert(group->second.points.begin(), group->second.points.end());
        if (group->second.points.empty()) groups_.erase(group);
    }
    points_.erase(index);
    around->erase(index);
}

// ---- places ----

IncrementalSite::Cell IncrementalSite::cell_of(const Vector3d &position) const
{
    const double side = options_.build.cluster.group_reach * t_m_;
    const double z = options_.build.cluster.z_weight * position.z();
    return {static_cast<int>(std::floor(position.x() / side)), static_cast<int>(std::floor(position.y() / side)),
            static_cast<int>(std::floor(z / side))};
}

void IncrementalSite::insert_cell(int point)
{
    cells_[cell_of(points_.at(point).site.position)].insert(point);
}

void IncrementalSite::erase_cell(int point)
{
    const auto cell = cells_.find(cell_of(points_.at(point).site.position));
    if (cell == cells_.end()) return;
    cell->second.erase(point);
    if (cell->second.empty()) cells_.erase(cell);
}

// Points in this cell and the 26 round it.
std::vector<int> IncrementalSite::near(const Vector3d &position) const
{
    std::vector<int> found;
    const Cell at = cell_of(position);
    for (int dz = -1; dz <= 1; dz++)
        for (int dy = -1; dy <= 1; dy++)
            for (int dx = -1; dx <= 1; dx++) {
                const auto cell = cells_.find({at[0] + dx, at[1] + dy, at[2] + dz});
                if (cell != cells_.end()) found.insert(found.end(), cell->second.begin(), cell->second.end());
            }
    return found;
}

// ---- groups ----

// Everything that hangs together with a touched point, through neighbouring cells and through groups it belonged to, is
// clustered and boxed anew.
void IncrementalSite::regroup(const std::set<int> &touched)
{
    std::set<int> all;
    std::vector<int> open(touched.begin(), touched.end());
    while (!open.empty()) {
        const int index = open.back();
        open.pop_back();
        if (points_.count(index) == 0 || !all.insert(index).second) continue;
        const Point &point = points_.at(index);
        for (const int other : near(point.site.position)) open.push_back(other);
        const auto group = groups_.find(point.group);
        if (group != groups_.end()) open.insert(open.end(), group->second.points.begin(), group->second.points.end());
    }
    std::vector<SitePoint> points;
    std::vector<int> indices(all.begin(), all.end());
    for (const int index : indices) {
        groups_.erase(points_.at(index).group);
        points.push_back(points_.at(index).site);
    }
    n_renewed_ += static_cast<int>(indices.size());
    if (indices.empty()) return;
    ClusterOptions cluster = options_.build.cluster;
    cluster.t_m_m = t_m_;
    Group made;
    const Clusters clusters = cluster_points(points, diagonal_, cluster);
    make_boxes(clusters, diagonal_, options_.build.boxes, &points, &made.boxes, &made.suspected);
    const int number = next_group_++;
    for (std::size_t i = 0; i < indices.size(); i++) {
        Point &point = points_.at(indices[i]);
        point.group = number;
        point.site.obstacle = points[i].obstacle;
        made.points.insert(indices[i]);
    }
    groups_[number] = std::move(made);
}

// ---- what is told ----

SiteModel IncrementalSite::model() const
{
    SiteModel model;
    model.area = area_;
    for (const auto &[id, placed] : views_) model.views.push_back(placed.refined);
    for (const auto &[number, group] : groups_) {
        const int first = static_cast<int>(model.obstacles.size());
        for (const int index : group.points) {
            SitePoint point = points_.at(index).site;
            if (point.obstacle >= 0) point.obstacle += first;
            model.points.push_back(point);
        }
        model.obstacles.insert(model.obstacles.end(), group.boxes.begin(), group.boxes.end());
        model.suspected.insert(model.suspected.end(), group.suspected.begin(), group.suspected.end());
    }
    int index = 1;
    for (Obstacle &box : model.obstacles) box.index = index++;
    index = 1;
    for (Obstacle &box : model.suspected) box.index = index++;
    return model;
}

SiteModel IncrementalSite::settle() const
{
    std::vector<View> views;
    for (const auto &[id, placed] : views_) views.push_back(placed.view);
    return build_site(views, area_, options_.build);
}

} // namespace outcrop
