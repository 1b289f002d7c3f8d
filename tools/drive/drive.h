// SPDX-License-Identifier: BSD-3-Clause
// A drive over a site folder: the real outcropd and the real outcrop-base on one private link.
#pragma once

#include <string>

#include "reported_site.h"

namespace outcrop {

struct DriveOptions {
    ReportedSiteOptions site;
    std::string out;
    std::string represent = "boxes";
    bool with_textures = true;
    std::string path; // empty: the site's own, else a loop
    std::string method = "best";
    std::string link = "layers"; // "layers" or "images:jpeg:Q" or "images:webp:Q"
    unsigned datagram_bytes = 1380;
    double timeout_s = 900;
};

// Throws std::runtime_error with one line when `link` is none of these.
void check_link(const std::string &link);

// Runs both ends until the base has settled. Throws std::runtime_error with one line.
void drive(const DriveOptions &options);

// Prints what a run made: boxes, bytes per layer, where the pictures are.
void print_summary(const std::string &out);

} // namespace outcrop
