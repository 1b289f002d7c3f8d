// SPDX-License-Identifier: BSD-3-Clause
// outcrop-eval SITE DIR [--json]: holds a run's output against the site's truth.
#include "report.h"

#include <CLI/CLI.hpp>
#include <iostream>

namespace {

const char *const kDefinitions = R"(
What is judged (null, with a note on stderr, where the files for it are absent):
  matches    obstacle matches. Correct: some true depth in the 3x3 pixels round
             the left apex puts it within 3 px of the right apex and visible
             there (true right depth within 1 % in 3x3).
  ground     vehicle/junctions.json: junctions labelled ground; true ground is
             mask 0 or 254 without an obstacle pixel within 2 px; recall over
             true ground junctions with a partner within 2 px of their true
             transfer in a stored view; obstacle_as_ground: share of the junctions
             within 2 px of an obstacle pixel that are labelled ground. Without that file: ground matches whose
             left apex is true ground and that are correct; no recall.
  boxes      given to obstacles one to one, best axis-aligned IoU first; obb_iou
             against the least-area upright box of the true mesh; yaw_error_deg
             (0..45, quarter turns are the same) where that box is the mesh's own
             outline but for 10 % of its area.
  missed     obstacles without a box of IoU > 0.3.
  false      boxes of IoU <= 0.1 with every obstacle that are no fragment (half
             their volume inside an obstacle's box); duplicates are the rest of
             the boxes given to no obstacle.
  voxels     model/K.voxels.ply against the true mesh on the run's own grid;
             chamfer: mean of both mean surface distances. hull: the same IoU for
             the hull carved from the true masks.
  poses      model/cameras.json against cameras.json, by image name (view_N without
             extension: by number), unaligned.
  sequence   frames against path/. PSNR over all frames' pixels together (99 dB
             when identical), SSIM the frames' mean; psnr_ground_db against the
             true overhead warped, psnr_ground_limit_db what the true frames
             themselves score; mask_iou any obstacle against the rest,
             mask_iou_obstacle the mean over obstacles through their boxes;
             flicker: mean change of ground pixels between frames, grey levels.
  footprint  model/ground.png on cells of 20 mm (area over 3 m) or 3 mm; cells
             within one cell of a true outline are left out.
  bytes      as report.json says.
Exit: 0 evaluated, 1 a file unreadable or ill-formed, 2 wrong usage.)";

} // namespace

int main(int argc, char **argv)
{
    CLI::App app("Holds DIR (what a run wrote) against SITE's truth.", "outcrop-eval");
    app.footer(kDefinitions);
    std::string site, dir;
    bool is_json = false;
    app.add_option("SITE", site, "site folder")->required();
    app.add_option("DIR", dir, "a run's output folder")->required();
    app.add_flag("--json", is_json, "print JSON instead of a table");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError &e) {
        return app.exit(e) == 0 ? 0 : 2;
    }
    try {
        outcrop::eval::Notes notes;
        const auto report = outcrop::eval::evaluate(site, dir, notes);
        for (const std::string &note : notes) std::cerr << "outcrop-eval: note: " << note << '\n';
        if (is_json)
            std::cout << to_json(report).dump(2) << '\n';
        else
            std::cout << to_table(report);
    } catch (const std::exception &e) {
        std::cerr << "outcrop-eval: " << e.what() << '\n';
        return 1;
    }
    return 0;
}
