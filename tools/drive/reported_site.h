// SPDX-License-Identifier: BSD-3-Clause
// The site as the vehicle's sensors report it: chosen views, other images, poses moved inside their margins.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace outcrop {

struct Perturbation {
    bool is_on = false;
    unsigned seed = 0;
    std::string kind = "independent"; // independent | drift | mount | height
};

struct ReportedSiteOptions {
    std::string site;       // folder or cameras file
    std::string images;     // folder name instead of the views' own; empty: as the file says
    std::vector<int> views; // indices; empty: all
    double margin_position_m = -1, margin_angle_rad = -1; // negative: the file's
    Perturbation perturbation;
};

// "SEED" or "SEED:kind". Throws std::runtime_error with one line.
Perturbation parse_perturbation(const std::string &text);

struct ReportedSite {
    std::map<int, std::string> image_names; // by index in the site's file
    std::string path_file;                  // SITE/path.json when there is one
};

// Write out_file, a cameras file with absolute image paths and an "index" per
// view. Throws std::runtime_error with one line that names file and fault.
ReportedSite write_reported_site(const ReportedSiteOptions &options, const std::string &out_file);

} // namespace outcrop
