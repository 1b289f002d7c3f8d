// SPDX-License-Identifier: BSD-3-Clause
// Matches of pairs merged into tracks over all views, and tracks into points.
#include "site/tracks.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <tuple>

#include <Eigen/LU>

#include "site/components.h"
#include "site/neighbours.h"

namespace outcrop {

namespace {

struct Edge {
    int a = 0, b = 0; // indices of pixels
    MatchKind kind = MatchKind::kObstacle;
    double score = 0;
    int support = 0; // third pixels matched with both ends
};

// The graph of all matches: nodes are pixels in (view, junction) order, so indices do not depend on the input's order.
struct Graph {
    std::vector<TrackPixel> pixels;
    std::vector<Edge> edges;
    std::vector<std::vector<int>> neighbours; // ascending
};

std::map<int, int> index_of_id(const std::vector<View> &views)
{
    std::map<int, int> index;
    for (std::size_t i = 0; i < views.size(); ++i) index[views[i].id] = static_cast<int>(i);
    return index;
}

struct RawEdge {
    TrackPixel a, b;
    MatchKind kind;
    double score;
};

std::vector<RawEdge> collect(const std::vector<View> &views, const std::vector<PairMatches> &pairs)
{
    const std::map<int, int> index = index_of_id(views);
    std::vector<RawEdge> raw;
    for (const PairMatches &pair : pairs) {
        const auto left = index.find(pair.left), right = index.find(pair.right);
        if (left == index.end() || right == index.end() || left == right) continue;
        const int n_left = static_cast<int>(views[static_cast<std::size_t>(left->second)].junctions.size());
        const int n_right = static_cast<int>(views[static_cast<std::size_t>(right->second)].junctions.size());
        for (const Match &m : pair.matches) {
            if (m.left_junction < 0 || m.left_junction >= n_left) continue;
            if (m.right_junction < 0 || m.right_junction >= n_right) continue;
            RawEdge edge{{left->second, m.left_junction}, {right->second, m.right_junction}, m.kind, m.score};
            if (edge.b < edge.a) std::swap(edge.a, edge.b);
            raw.push_back(edge);
        }
    }
    return raw;
}

Graph build_graph(const std::vector<View> &views, const std::vector<PairMatches> &pairs)
{
    const std::vector<RawEdge> raw = collect(views, pairs);
    Graph graph;
    for (const RawEdge &e : raw) {
        graph.pixels.push_back(e.a);
        graph.pixels.push_back(e.b);
    }
    std::sort(graph.pixels.begin(), graph.pixels.end());
    graph.pixels.erase(std::unique(graph.pixels.begin(), graph.pixels.end()), graph.pixels.end());
    const auto index = [&](const TrackPixel &p) {
        return static_cast<int>(std::lower_bound(graph.pixels.begin(), graph.pixels.end(), p) - graph.pixels.begin());
    };
    graph.neighbours.resize(graph.pixels.size());
    for (const RawEdge &e : raw) {
        const Edge edge{index(e.a), index(e.b), e.kind, e.score, 0};
        graph.edges.push_back(edge);
        graph.neighbours[static_cast<std::size_t>(edge.a)].push_back(edge.b);
        graph.neighbours[static_cast<std::size_t>(edge.b)].push_back(edge.a);
    }
    for (std::vector<int> &n : graph.neighbours) {
        std::sort(n.begin(), n.end());
        n.erase(std::unique(n.begin(), n.end()), n.end());
    }
    return graph;
}

int common(const std::vector<int> &a, const std::vector<int> &b)
{
    int n = 0;
    for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();) {
        if (*i == *j) ++n;
        if (*i < *j) {
            ++i;
        } else if (*j < *i) {
            ++j;
        } else {
            ++i, ++j;
        }
    }
    return n;
}

void rank_edges(Graph *graph)
{
    for (Edge &e : graph->edges) {
        e.support =
            common(graph->neighbours[static_cast<std::size_t>(e.a)], graph->neighbours[static_cast<std::size_t>(e.b)]);
    }
    std::sort(graph->edges.begin(), graph->edges.end(), [](const Edge &x, const Edge &y) {
        return std::tuple(-x.support, -x.score, x.a, x.b, static_cast<int>(x.kind)) <
               std::tuple(-y.support, -y.score, y.a, y.b, static_cast<int>(y.kind));
    });
}

} // namespace

void TrackOptions::check() const
{
    triangulate.check();
    const double least[] = {max_reprojection_px, chi, height_share, max_sigma_share};
    for (const double value : least)
        if (!(value > 0)) throw std::invalid_argument("tracks: limits must be > 0");
    if (!(ground_height_m >= 0) || !(area_slack >= 0) || !(ground_sigmas >= 0) || !(obstacle_sigmas >= 0) ||
        !(max_ground_height_share >= 0))
        throw std::invalid_argument("tracks: heights and slack must be >= 0");
    if (!(max_unit_px >= 0)) throw std::invalid_argument("tracks: max_unit_px must be >= 0");
}

std::vector<Track> merge_tracks(const std::vector<View> &views, const std::vector<PairMatches> &pairs,
                                std::map<std::string, double> *counts)
{
    Graph graph = build_graph(views, pairs);
    rank_edges(&graph);
    std::vector<int> view_of;
    for (const TrackPixel &p : graph.pixels) view_of.push_back(p.view);
    ViewComponents components(view_of);
    std::vector<char> is_used(graph.edges.size(), 0);
    double n_conflicts = 0;
    for (std::size_t i = 0; i < graph.edges.size(); ++i) {
        is_used[i] = components.join(graph.edges[i].a, graph.edges[i].b);
        if (!is_used[i]) ++n_conflicts;
    }

    std::map<int, Track> by_root; // roots are least members, so tracks come out in the order of their first pixel
    for (std::size_t i = 0; i < graph.pixels.size(); ++i)
        by_root[components.root(static_cast<int>(i))].pixels.push_back(graph.pixels[i]);
    std::map<int, int> ground_votes;
    for (std::size_t i = 0; i < graph.edges.size(); ++i) {
        if (!is_used[i]) continue;
        const int root = components.root(graph.edges[i].a);
        Track &track = by_root[root];
        track.score = std::max(track.score, graph.edges[i].score);
        ground_votes[root] += graph.edges[i].kind == MatchKind::kGround ? 1 : -1;
    }
    std::vector<Track> tracks;
    for (auto &[root, track] : by_root) {
        if (track.pixels.size() < 2) continue;
        track.kind = ground_votes[root] >= 0 ? MatchKind::kGround : MatchKind::kObstacle;
        tracks.push_back(std::move(track));
    }
    if (counts) {
        (*counts)["match_conflicts"] = n_conflicts;
        (*counts)["tracks_merged"] = static_cast<double>(tracks.size());
    }
    return tracks;
}

double ground_height(const std::vector<oc_camera_t> &cameras, const TrackOptions &options)
{
    if (options.ground_height_m > 0 || cameras.empty()) return options.ground_height_m;
    double sum = 0;
    for (const oc_camera_t &camera : cameras) sum += std::abs(camera_centre(camera).z());
    return options.height_share * sum / static_cast<double>(cameras.size());
}

namespace {

struct Settler {
    const std::vector<View> &views;
    const std::vector<oc_camera_t> &cameras;
    const std::vector<Matrix6d> &covariances;
    const Area &area;
    const TrackOptions &options;
    double t_h = 0, highest_ground = 0, diagonal = 0;
    std::map<std::string, double> drops;

    Sighting sighting(const TrackPixel &p) const
    {
        const std::size_t view = static_cast<std::size_t>(p.view);
        const oc_junction_t &j = views[view].junctions[static_cast<std::size_t>(p.junction)];
        Sighting s;
        s.camera = &cameras[view];
        s.x_px = static_cast<double>(j.x_px);
        s.y_px = static_cast<double>(j.y_px);
        if (!covariances.empty()) s.pose_covariance = &covariances[view];
        return s;
    }

    // Squared misfit over what is allowed; > 1: does not fit.
    double misfit(const Sighting &s, const Eigen::Vector3d &point) const
    {
        Eigen::Vector2d pixel;
        Matrix26d by_pose;
        if (!project_with_derivatives(*s.camera, point, &pixel, nullptr, &by_pose)) return 1e30;
        const Eigen::Vector2d off = Eigen::Vector2d(s.x_px, s.y_px) - pixel;
        Eigen::Matrix2d allowed =
            options.max_reprojection_px * options.max_reprojection_px * Eigen::Matrix2d::Identity();
        if (s.pose_covariance)
            allowed += options.chi * options.chi * (by_pose * *s.pose_covariance * by_pose.transpose());
        return off.dot(allowed.inverse() * off);
    }

    std::optional<Triangulated> triangulate_of(const std::vector<Sighting> &all,
                                               const std::vector<std::size_t> &use) const
    {
        std::vector<Sighting> some;
        for (const std::size_t i : use) some.push_back(all[i]);
        return triangulate(some, options.triangulate);
    }

    // Indices of the sightings that fit the point, and the sum of their misfits.
    std::vector<std::size_t> fitting(const std::vector<Sighting> &all, const Eigen::Vector3d &point, double *sum) const
    {
        std::vector<std::size_t> good;
        *sum = 0;
        for (std::size_t i = 0; i < all.size(); ++i) {
            const double m = misfit(all[i], point);
            if (!(m <= 1)) continue;
            good.push_back(i);
            *sum += m;
        }
        return good;
    }

    // The largest set of sightings that one pair of them explains; of equal ones the best fitting.
    std::vector<std::size_t> consensus(const std::vector<Sighting> &all) const
    {
        std::vector<std::size_t> best;
        double best_sum = 0;
        for (std::size_t i = 0; i < all.size(); ++i) {
            for (std::size_t j = i + 1; j < all.size(); ++j) {
                const std::optional<Triangulated> pair = triangulate_of(all, {i, j});
                if (!pair) continue;
                double sum = 0;
                const std::vector<std::size_t> good = fitting(all, pair->point, &sum);
                if (good.size() < 2 || good.size() < best.size()) continue;
                if (good.size() == best.size() && !(sum < best_sum)) continue;
                best = good, best_sum = sum;
            }
        }
        return best;
    }

    // Do the residuals together fit what the track has to spare?
    bool is_tight(double sum, std::size_t n) const
    {
        if (!(options.max_unit_px > 0)) return true;
        const double spare = 2.0 * static_cast<double>(n) - 3.0;
        const double square = sum * options.max_reprojection_px * options.max_reprojection_px / spare;
        return square <= options.max_unit_px * options.max_unit_px;
    }

    void drop_worst(const std::vector<Sighting> &all, const Eigen::Vector3d &point, std::vector<std::size_t> *use) const
    {
        const auto fits_better = [&](std::size_t a, std::size_t b) {
            return misfit(all[a], point) < misfit(all[b], point);
        };
        use->erase(std::max_element(use->begin(), use->end(), fits_better));
    }

    // Triangulates; when not all sightings fit, those that do not are left out.
    bool fit(Track *track) const
    {
        std::vector<Sighting> all;
        for (const TrackPixel &p : track->pixels) all.push_back(sighting(p));
        std::vector<std::size_t> use(all.size());
        std::iota(use.begin(), use.end(), 0u);
        for (int round = 0; round < 3 && use.size() >= 2; ++round) {
            const std::optional<Triangulated> result = triangulate_of(all, use);
            double sum = 0;
            const std::vector<std::size_t> good =
                result ? fitting(all, result->point, &sum) : std::vector<std::size_t>();
            if (std::includes(good.begin(), good.end(), use.begin(), use.end())) {
                track->fit = *result;
                tighten(all, &use, track);
                keep(use, track);
                return true;
            }
            if (all.size() == 2) return false;
            use = round == 0 ? consensus(all) : good;
        }
        return false;
    }

    // Leaves out the worst sightings until the rest is tight; a track that never is keeps them all and is in doubt.
    void tighten(const std::vector<Sighting> &all, std::vector<std::size_t> *use, Track *track) const
    {
        std::vector<std::size_t> rest = *use;
        std::optional<Triangulated> result = track->fit;
        while (result) {
            double sum = 0;
            for (const std::size_t i : rest) sum += misfit(all[i], result->point);
            if (is_tight(sum, rest.size())) {
                *use = rest;
                track->fit = *result;
                return;
            }
            if (rest.size() == 2) break;
            drop_worst(all, result->point, &rest);
            result = triangulate_of(all, rest);
        }
        track->is_doubtful = true;
    }

    static void keep(const std::vector<std::size_t> &use, Track *track)
    {
        std::vector<TrackPixel> pixels;
        for (const std::size_t i : use) pixels.push_back(track->pixels[i]);
        track->pixels = std::move(pixels);
    }

    bool is_inside(const Eigen::Vector3d &p) const
    {
        const double slack = options.area_slack * diagonal;
        return p.x() >= area.x_min - slack && p.x() <= area.x_max + slack && p.y() >= area.y_min - slack &&
               p.y() <= area.y_max + slack && p.z() <= area.z_max + slack;
    }

    bool settle(Track *track)
    {
        if (!fit(track)) return ++drops["tracks_inconsistent"], false;
        const double sigma_z = std::sqrt(track->fit.covariance(2, 2));
        const double z = track->fit.point.z();
        if (!is_inside(track->fit.point)) return ++drops["tracks_outside"], false;
        if (z < -std::max(t_h, options.ground_sigmas * sigma_z)) return ++drops["tracks_below_ground"], false;
        if (!(std::sqrt(track->fit.covariance.trace()) <= options.max_sigma_share * diagonal))
            return ++drops["tracks_uncertain"], false;
        const bool is_low = std::abs(z) <= t_h;
        const double sigmas = track->kind == MatchKind::kGround ? options.ground_sigmas : options.obstacle_sigmas;
        const bool may_be_low = z < 0 || (z <= highest_ground && z < sigmas * sigma_z);
        track->kind = is_low || may_be_low ? MatchKind::kGround : MatchKind::kObstacle;
        return true;
    }
};

} // namespace

namespace {

// What two views alone say of a point that no other point is near to may be an accident.
void doubt_lonely(double reach, std::vector<Track> *tracks)
{
    std::vector<Eigen::Vector3d> points;
    for (const Track &track : *tracks) points.push_back(track.fit.point);
    const std::vector<char> has_company = has_neighbour(points, reach);
    for (std::size_t i = 0; i < tracks->size(); ++i) {
        Track &track = (*tracks)[i];
        const bool is_weak = track.kind == MatchKind::kObstacle && track.pixels.size() == 2;
        track.is_doubtful = track.is_doubtful || (is_weak && !has_company[i]);
    }
}

} // namespace

std::vector<Track> settle_tracks(const std::vector<View> &views, const std::vector<oc_camera_t> &cameras,
                                 const std::vector<Matrix6d> &pose_covariances, const std::vector<Track> &tracks,
                                 const Area &area, const TrackOptions &options, std::map<std::string, double> *counts)
{
    Settler settler{views, cameras, pose_covariances, area, options, 0, 0, 0, {}};
    settler.t_h = ground_height(cameras, options);
    TrackOptions share = options;
    share.ground_height_m = 0;
    share.height_share = options.max_ground_height_share;
    settler.highest_ground = ground_height(cameras, share);
    settler.diagonal = std::hypot(area.x_max - area.x_min, area.y_max - area.y_min);
    settler.drops = {
        {"tracks_inconsistent", 0}, {"tracks_outside", 0}, {"tracks_below_ground", 0}, {"tracks_uncertain", 0}};
    std::vector<Track> settled;
    for (Track track : tracks)
        if (settler.settle(&track)) settled.push_back(std::move(track));
    doubt_lonely(options.lonely_share * settler.diagonal, &settled);
    if (!counts) return settled;
    for (const auto &[name, n] : settler.drops) (*counts)[name] = n;
    const auto is_doubtful = [](const Track &track) { return track.is_doubtful; };
    (*counts)["tracks_doubtful"] = static_cast<double>(std::count_if(settled.begin(), settled.end(), is_doubtful));
    return settled;
}

} // namespace outcrop
