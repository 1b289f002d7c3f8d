# SPDX-License-Identifier: BSD-3-Clause
"""The part of docs/measurements.md about matches, poses and steps beside their rivals, out of docs/matching.json."""
DASH = "–"
LEAST_RATIO = 3.0
LEAST_PRECISION = 0.95
MOST_GROUND_PX = 0.5
LEAST_CUT = 3.0


def number(value, places=0, scale=1.0):
    return DASH if value is None else f"{value * scale:,.{places}f}"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "| --- |" + " ---: |" * (len(head) - 1)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]) + "\n"


def judged(is_met, figure):
    return f"{figure}: {'met' if is_met else '**not met**'}"


def precision_cell(count):
    if count["precision"] is None:
        return DASH
    return (f"{number(count['precision'], 1, 100)} % ({number(count['precision_low'], 1, 100)} to "
            f"{number(count['precision_high'], 1, 100)})")


def in_order(methods):
    """Ours first, rivals by name."""
    return sorted(methods, key=lambda m: (not m["method"].startswith("ours"), m["method"]))


def ratio_cell(value):
    return DASH if value is None else judged(value >= LEAST_RATIO, f"{value:.2f}")


def group_text(group):
    ours = next(m for m in group["methods"] if m["method"] == "ours")
    text = (f"#### {group['title'].capitalize()}: {group['pairs']} pairs\n\n{'; '.join(group['cases'])}. Precision of ours (>= "
            f"95 %): {judged((ours['precision'] or 0) >= LEAST_PRECISION, number(ours['precision'], 1, 100) + ' %')}.\n\n")
    text += table(["method", "obstacle matches", "right", "precision (95 % interval)", "right, on obstacles",
                   "ground matches right"],
                  [[m["method"], number(m["n"]), number(m["correct"]), precision_cell(m),
                    number(m["correct_on_obstacle"]), f"{number(m['ground_correct'])} of {number(m['ground_n'])}"]
                   for m in in_order(group["methods"])])
    return text + "\n" + table(
        ["rival", "ours / rival at ratio 0.8 (>= 3)", "its laxest ratio of 95 % precision", "ours / rival there"],
        [[r["rival"], ratio_cell(r["ours_over_rival"]),
          DASH if r["ratio_at_95"] is None else f"{r['ratio_at_95']:g}", ratio_cell(r["ours_over_rival_at_95"])]
         for r in group["ratios"]]) + "\n"


def losses_text(cases):
    stages = ["visible", "detected", "candidate", "correlated", "alike", "best"]
    rows = [[f"{c['site']}, {c['poses']}"] + [number(c["losses"][stage]) for stage in stages] for c in cases]
    wrong = []
    for case in cases:
        kinds = next(m for m in case["methods"] if m["method"] == "ours")["wrong"]
        wrong.append([f"{case['site']}, {case['poses']}", kinds["near_px"], kinds["far_px"], kinds["hidden"],
                      kinds["no_depth"]])
    return ("#### Where ours loses\n\nJunctions of left views on obstacles, at the true poses: truly seen by the right view; "
            "with a junction within 3 px of there; of those in the strip; alike under some plane at all; alike by the least "
            "score; best of both by the margin.\n\n" +
            table(["site, poses", "seen", "found again", "in the strip", "some plane", "alike", "best"], rows) +
            "\nOurs' wrong obstacle matches:\n\n" +
            table(["site, poses", "3 to 10 px off", "further", "hidden from the right view", "nothing there"], wrong) +
            "\n")


def wide_text(wide):
    return ("### Pairs 40 to 60 degrees apart\n\nAll such pairs of each site, whole pictures. Rivals bring their own points "
            "and descriptors, best and second best at another place both ways, and get what ours has: the strips of the poses, "
            "narrowed twice, a first pass that only refines the poses, all matches in the strips of these, the tracks' check. They do "
            "not get the check in third views, without which ours is \"two views only\". Points of a rival: all, of affine "
            "SIFT the best 5,000 spread over the picture. A match is right by the rule of `outcrop-eval`; several "
            "of one place count once.\n\n" + "".join(group_text(g) for g in wide["groups"]) +
            losses_text(wide["cases"]))


def share(cell):
    total, right = cell
    return f"{right} of {total}" + (f", {100 * right / total:.1f} %" if total else "")


def tables_text(tables):
    text = "### Thesis, table 5.3 and its comparisons\n\nTotal and right; the printed columns are of the thesis' own pictures.\n\n"
    for one in tables["table_5_3"]:
        text += f"{one['site']}, views {one['left']} and {one['right']}, poses {one['poses']}:\n\n"
        text += table(["window, px; t_VNC", "printed", "thesis' form", "ours, that window and least score"],
                      [[f"{r['window_px']}; {r['t_vnc']:.2f}", share(r["printed"]), share(r["thesis_form"]),
                        share(r["ours"])] for r in one["rows"]]) + "\n"
    for one in tables["methods"]:
        text += (f"{one['title']}: {one['site']}, {one['pairs']} pair{'s' if one['pairs'] > 1 else ''}, window "
                 f"{one['window_px']} px, poses {one['poses']}. Printed: {one['printed']}.\n\n")
        text += table(["method", "matches", "right", "precision (95 % interval)", "ms"],
                      [[r["method"], r["n"], r["correct"], precision_cell(r), number(r["ms"], 1)]
                       for r in one["rows"]]) + "\n"
    return text


def poses_text(poses):
    text = ("### Poses\n\nErrors at true points of the model's pairs, poses moved inside the margins, all seeds together; ms of all "
            "pairs of a seed (ours: the whole model). F comes of the matches with the sensors' poses, with and without the "
            "vehicle's ground ties; F says nothing of the ground.\n\n")
    for site in poses:
        ours = next(s for s in site["sources"] if s["source"] == "ours")
        text += f"{site['site']}, seeds {', '.join(site['poses'])}:\n\n"
        text += table(["source", "pairs", "epipolar error, median px", "90 %", "ground transfer, median px", "90 %", "ms"],
                      [[s["source"], s["pairs"]] +
                       [number(s[key], 2) for key in ("epipolar_median_px", "epipolar_p90_px", "ground_median_px",
                                                      "ground_p90_px")] + [number(s["ms"], 1)]
                       for s in site["sources"]])
        (before, after), (free, free_after) = site["position_rmse_m"], site["position_aligned_rmse_m"]
        ground = ours["ground_median_px"]
        text += (f"\nGround transfer (<= 0.5 px): {judged(ground <= MOST_GROUND_PX, f'{ground:.2f} px')}. Centres: "
                 f"{before * 1e3:.1f} mm to {after * 1e3:.1f} mm, cut (>= 3) "
                 f"{judged(site['position_cut'] >= LEAST_CUT, number(site['position_cut'], 2))}; but for one move over the "
                 f"plane and turn of all cameras, which no picture shows: {free * 1e3:.1f} mm to {free_after * 1e3:.1f} mm, "
                 f"{judged(site['position_aligned_cut'] >= LEAST_CUT, number(site['position_aligned_cut'], 2))}.\n\n")
    return text


def steps_text(steps):
    text = ("### The thesis' steps in the place of ours\n\nEach row is ours with one step as in the thesis, the last the thesis "
            "throughout; depot, two_obstacles and cubes together, whole pictures, same run.\n\n")
    for one in steps:
        text += f"Poses {one['poses']}:\n\n" + table(
            ["step", "thesis' form", "obstacle matches", "precision (95 % interval)", "centres off, mm",
             "box IoU, mean / least", "missed", "false", "suspected", "matching, ms", "refinement, ms", "all, ms"],
            [[r["step"], r["about"] or DASH, number(r["matches"]["n"]), precision_cell(r["matches"]),
              number(r["position_rmse_m"], 2, 1000), f"{r['mean_iou']:.3f} / {r['least_iou']:.2f}", r["missed"],
              r["false"], r["suspected"], number(r["match_ms"], 0), number(r["refine_ms"], 0), number(r["all_ms"], 0)]
             for r in one["rows"]]) + "\n"
    return text


def colmap_text(cases):
    text = ("### COLMAP\n\nCOLMAP 3.8 of Debian, which has neither CUDA (no dense stereo) nor CGAL (no Delaunay mesh): features, "
            "exhaustive matching and triangulation with the poses that our vehicle reported, its points made into obstacles "
            "by our clusters and boxes. Bytes are those of the pictures; ours are all that crossed the link, its seconds the "
            "whole drive. Written by `tools/peer_colmap.py`.\n\n")
    for case in cases:
        rows = []
        for row in case["rows"]:
            if row.get("failed"):
                rows.append([row["method"], "**failed**: " + row["failed"]] + [DASH] * 6)
                continue
            rows.append([row["method"], row["found"], row["missed"], row["false"],
                         " ".join(f"{box['iou']:.2f}" for box in row["boxes"]), number(row["points"]),
                         number(row["seconds"], 1), number(row["bytes"])])
        text += f"{case['site']}, poses {case['poses']}:\n\n" + table(
            ["method", "found", "missed", "false", "box IoU of each", "points", "seconds", "bytes"], rows) + "\n"
    return text


def text(matching):
    """Empty when nothing was measured."""
    if not matching:
        return ""
    figures = matching["matching"]
    out = (f"## Matching beside its rivals\n\nWritten by `tools/matching.sh` on {matching['machine']}. \"exact\" poses are "
           "reported as they are, with the site's margins; a number is the seed of poses moved inside them.\n\n")
    if figures.get("skipped"):
        out += f"**Skipped, since the files were not there: {', '.join(figures['skipped'])}.**\n\n"
    for part, write in (("wide", wide_text), ("tables", tables_text), ("poses", poses_text), ("steps", steps_text)):
        out += write(figures[part]) if part in figures else ""
    return out + (colmap_text(matching["colmap"]) if matching.get("colmap") else "")
