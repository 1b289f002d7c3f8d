// SPDX-License-Identifier: BSD-3-Clause
// A working model that grows, shrinks and moves view by view in bounded time.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <set>
#include <vector>

#include "site/model.h"

namespace outcrop {

struct IncrementalOptions {
    BuildOptions build;
    int max_neighbours = 6;  // views that a new one is matched with
    int max_candidates = 24; // views that these are chosen from: those that look at the nearest places
    void check() const;      // throws std::invalid_argument
};

// Matches of two views of which left has the lesser id; what IncrementalSite and its tests share.
using PairMatcher = std::function<PairMatches(const PosedView &left, const PosedView &right, const Area &area,
                                              oc_angle_error_t angles)>;

// The poses that are believed stay as they are while a new view is placed against its neighbours; its corners join the
// points they are matched with, and only clusters that a changed point belongs to are made anew. So the work for a view
// depends on its neighbours, not on how many views there are. settle() is the adjustment of everything at once: it, and
// not the working model, is what a site ends with. Single thread.
class IncrementalSite {
public:
    explicit IncrementalSite(const Area &area, const IncrementalOptions &options = {}, PairMatcher matcher = {});

    // Throws std::invalid_argument when a view of this id is there already, or its camera or margin is not valid.
    void add_view(const View &view);
    // False when there is none of this id.
    bool remove_view(int id);
    // The sensor's pose of a view was wrong: as if the view came now, with another one.
    bool repose_view(int id, const oc_camera_t &camera, const oc_margin_t &margin);

    std::size_t n_views() const { return views_.size(); }
    int pairs_matched() const { return n_pairs_; }    // by the last add_view
    int points_renewed() const { return n_renewed_; } // looked at again by the last call that changed the model

    // Views, points and boxes as they stand; no pairs, no statements about quality. O(views + points).
    SiteModel model() const;

    // build_site of all views.
    SiteModel settle() const;

private:
    struct Placed {
        View view; // as reported
        oc_camera_t camera{};
        oc_margin_t margin{}; // for matching: about the camera's own axes
        RefinedView refined;
        Eigen::Vector2d gaze = Eigen::Vector2d::Zero();
        std::set<int> points;
    };
    struct Point {
        SitePoint site;
        std::map<int, int> sightings; // view -> junction
        int group = -1;
    };
    struct Group {
        std::set<int> points;
        std::vector<Obstacle> boxes, suspected;
    };
    using Cell = std::array<int, 3>;

    std::vector<int> neighbours_of(const Placed &fresh) const;
    void place(Placed *fresh, const std::vector<int> &neighbours);
    void take_tracks(const std::vector<View> &local, const std::vector<Track> &tracks, std::set<int> *touched);
    std::map<int, int> points_of(const std::map<int, int> &sightings) const;
    bool refit(int point);
    void drop_point(int point, std::set<int> *around);
    void insert_cell(int point);
    void erase_cell(int point);
    Cell cell_of(const Eigen::Vector3d &position) const;
    std::vector<int> near(const Eigen::Vector3d &position) const;
    void regroup(const std::set<int> &touched);

    Area area_;
    IncrementalOptions options_;
    PairMatcher matcher_;
    double diagonal_ = 0, t_m_ = 0;
    std::map<int, Placed> views_;
    std::map<int, Point> points_;
    std::map<int, Group> groups_;
    std::map<Cell, std::set<int>> cells_;
    int next_point_ = 0, next_group_ = 0, n_pairs_ = 0, n_renewed_ = 0;
};

} // namespace outcrop
