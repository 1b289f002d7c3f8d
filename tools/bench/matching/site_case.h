/* SPDX-License-Identifier: BSD-3-Clause
 * A site as the base knows it after a run in which every pixel crossed, with the truth beside it. */
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "eval/truth.h"
#include "site/site_model.h"
#include "site/view.h"

namespace outcrop::bench {

struct SiteCaseOptions {
    std::string site;
    std::string images;          /* folder name instead of the views' own, or "" */
    std::string poses = "exact"; /* "exact", or as --perturb of outcrop-drive: "1", "2:drift" */
    bool finds_all = false;      /* every junction the detector's limits let through, not only what a link bears */
};

struct SiteCase {
    std::string name; /* depot, depot/images_light */
    std::string poses;
    eval::Truth truth;
    std::vector<View> views;         /* ascending id, which is the index in the site's file; all pixels known */
    std::vector<cv::Mat3b> pictures; /* of the views, red, green, blue; empty when the source is grey */
    Area area;
};

/* Takes the frames through the vehicle's own code and its packets, as they would arrive, to views; then adds the
 * pixels. Exact poses come with the site's margins like any others. Throws std::runtime_error, or EvalError for bad truth. */
SiteCase load_site_case(const SiteCaseOptions &options);

/* The pose that the site's file gives a view: what is true of a perturbed case. */
oc_camera_t true_camera(const SiteCase &site, int view_id);

} // namespace outcrop::bench
