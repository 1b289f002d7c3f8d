/* SPDX-License-Identifier: BSD-3-Clause
 * Scenes whose junctions are known exactly. */
#ifndef OUTCROP_BENCH_SCENES_H
#define OUTCROP_BENCH_SCENES_H

#include "picture.h"

#include <string>
#include <vector>

namespace outcrop::bench {

struct TrueJunction {
    cv::Point2d at_px;
    std::vector<double> angle_rad; /* of its branches, ascending in [0, 2 pi), y down */
    bool counts;                   /* false: what is found near it is neither right nor wrong */
};

struct Scene {
    Picture picture;
    std::vector<TrueJunction> junctions;
    double margin_px; /* what is found nearer to the border does not count */
};

/* What one junction per image looks like: two to four sectors of grey that meet at a random sub-pixel point near the
 * middle and run out of the image on all sides. A third each of two, three and four branches; half of the three
 * are T. Neighbouring sectors differ by 25..120 grey levels, neighbouring branches by 25..155 degrees, but for the
 * bar of a T. */
std::vector<Scene> make_cells(int count, int draw = 0);

/* Sectors of grey round an apex, each from its angle to the next one's, that reach beyond an image of that size. */
Picture fan(const cv::Point2d &apex_px, const std::vector<double> &angle_rad, const std::vector<double> &level);

/* 640x480, triangles and quadrangles of one grey each, some concave, that do not touch; sides of 24 px and more,
 * inner angles of 25 to 155 degrees or beyond 205, contrast 25..120. */
std::vector<Scene> make_polygons(int count, int draw = 0);

/* 640x480, chessboards under homographies, squares of 26..40 px; the inner corners count. */
std::vector<Scene> make_chessboards(int count, int draw = 0);

/* 160x160, one triangle of angles of 25 degrees and more, sides of 60 px and more. */
std::vector<Scene> make_triangles(int count, int draw = 0);

/* Names that make_set knows: the four above, and the cells of one kind. */
extern const std::vector<std::string> kSets, kCellSets;

/* "cells", "polys", "chess", "triangles", or "cells-L", "-T", "-Y", "-X"; whole or a part for a quick run. Another
 * `draw` gives other scenes of the same kind. std::invalid_argument for other names. */
std::vector<Scene> make_set(const std::string &name, bool is_quick, int draw = 0);

/* oc_junction_kind_t of the true branches. */
int kind_of(const TrueJunction &junction);

/* In [0, 2 pi). */
double wrapped(double angle_rad);

/* Smallest turn between two directions, 0..pi. */
double turn_between(double a_rad, double b_rad);

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180;

} // namespace outcrop::bench
#endif
