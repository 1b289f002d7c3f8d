// SPDX-License-Identifier: BSD-3-Clause
// outcrop-drive: both ends on a site folder, over LCM in a private network.
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "drive.h"
#include "private_net.h"

namespace {

void add_options(CLI::App *app, outcrop::DriveOptions *options, std::string *perturb, double *angle_deg)
{
    app->add_option("SITE", options->site.site, "site folder, or its cameras file")->required();
    app->add_option("--out", options->out, "folder to write")->required();
    app->add_option("--as", options->represent, "how obstacles are shown: boxes, voxels or none")
        ->check(CLI::IsMember({"boxes", "voxels", "none"}));
    app->add_flag("!--no-textures", options->with_textures, "voxels of silhouettes alone, no colour is asked for");
    app->add_option("--path", options->path, "path file; default: the site's path.json, else a loop")
        ->check(CLI::ExistingFile);
    app->add_option("--views", options->site.views, "indices of the views to use")->delimiter(',');
    app->add_option("--images", options->site.images, "folder of the pictures instead of the file's");
    app->add_option("--margin-pos", options->site.margin_position_m, "margin of the position, metres")
        ->check(CLI::Range(0.0, 1e4));
    app->add_option("--margin-ang", *angle_deg, "margin of the angles, degrees")->check(CLI::Range(0.0, 45.0));
    app->add_option("--perturb", *perturb, "SEED[:independent|drift|mount|height]: move poses inside the margins");
    app->add_option("--method", options->method, "best or thesis")->check(CLI::IsMember({"best", "thesis"}));
    app->add_option("--link", options->link, "layers, or the null rival images:jpeg:Q, images:webp:Q");
    app->add_option("--mtu", options->datagram_bytes, "bytes of a datagram")->check(CLI::Range(200, 1380));
}

} // namespace

int main(int argc, char **argv)
{
    CLI::App app{"outcrop-drive: runs outcropd and outcrop-base on a site folder over LCM, then prints what they made"};
    app.set_version_flag("--version", "outcrop-drive " OUTCROP_VERSION);
    outcrop::DriveOptions options;
    std::string perturb;
    double angle_deg = -1;
    add_options(&app, &options, &perturb, &angle_deg);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError &fault) {
        return app.exit(fault) == 0 ? 0 : 2;
    }
    if (angle_deg >= 0) options.site.margin_angle_rad = angle_deg * 0.017453292519943295;
    try {
        outcrop::check_link(options.link);
        if (options.represent == "voxels" && options.link != "layers")
            throw std::runtime_error("--as voxels: whole pictures bring no silhouettes, use --link layers");
        if (!perturb.empty()) options.site.perturbation = outcrop::parse_perturbation(perturb);
    } catch (const std::exception &fault) {
        std::fprintf(stderr, "outcrop-drive: %s\n", fault.what());
        return 2;
    }
    try {
        outcrop::enter_private_net();
    } catch (const std::exception &fault) {
        std::fprintf(stderr, "outcrop-drive: %s\n", fault.what());
        return 3;
    }
    try {
        outcrop::drive(options);
        outcrop::print_summary(options.out);
    } catch (const std::exception &fault) {
        std::fprintf(stderr, "outcrop-drive: %s\n", fault.what());
        return 1;
    }
    return 0;
}
