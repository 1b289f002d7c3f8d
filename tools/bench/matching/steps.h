/* SPDX-License-Identifier: BSD-3-Clause
 * The thesis' own form of each step in the place of ours, one at a time and all together. */
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "site/model.h"
#include "site_case.h"

namespace outcrop::bench {

struct Step {
    std::string name;  /* what is as in the thesis */
    std::string about; /* thesis' form, one phrase */
    BuildOptions build;
    bool updates_by_f = false; /* 5.5: matches held by F of seven points, poses as the sensors give them */
};

/* First ours, then ours with one step of the thesis each, last the thesis throughout. t_m_m: the thesis' own t_M for the
 * site (it was set by hand), 0 for a site that it does not have. */
std::vector<Step> steps(double t_m_m);

/* The model of a step. */
SiteModel build_step(const SiteCase &site, const Step &step);

/* One row per step, of all cases together: matches, poses, boxes, milliseconds. */
nlohmann::ordered_json measure_steps(const std::vector<SiteCase> &cases,
                                     const std::function<double(const std::string &)> &t_m_m);

} // namespace outcrop::bench
