# SPDX-License-Identifier: BSD-3-Clause
"""The bench's part of docs/measurements.md, out of docs/bench.json (bench_report.py writes both)."""
DASH = "–"
SET_NAMES = {"cells": "Cells (one junction each, two to four branches)", "polys": "Polygons",
             "chess": "Chessboards (inner corners)", "triangles": "Triangles"}
METHOD_NAMES = {"fixed": "ours, lambda", "grown": "ours, grown branches (default)",
                "grown-auto": "ours, grown, t_b from the noise", "thesis": "thesis as printed, lambda",
                "gftt+subpix": "GFTT + cornerSubPix, told the count", "bound": "bound: noise alone, lambda"}
DETECTORS = ["ours", "harris", "gftt", "fast", "orb", "sift", "thesis", "ours+corners"]


def number(value, places=0):
    return DASH if value is None else f"{value:,.{places}f}"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "| --- |" + " ---: |" * (len(head) - 1)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]) + "\n"


def unique(values):
    return list(dict.fromkeys(values))


def verdict_cell(target):
    if target["value"] is None:
        return "**not known**"
    if target["met"]:
        return "met"
    return f"**missed by {abs(target['value'] - target['limit']):.3g}**"


FIGURE_NAMES = {"rmse_px": "RMSE, px", "angle_rmse_deg": "branch angle RMSE, deg",
                "l_bias_size_deg": "bias of L angles, deg",
                "sum_error_deg": "sum of a triangle's angles off 180, deg", "lead_over_harris": "lead over Harris"}


def target_rows(bench):
    rows = []
    for row in bench.get("accuracy", []):
        for target in row["targets"]:
            rows.append((target, f"{row['set']}, noise variance {row['variance']}, lambda {row['lambda_px']}"))
    for row in bench.get("repeatability", {}).get("rows", []):
        for target in row["targets"]:
            rows.append((target, f"{row['set']}, {row['warp']}"))
    rows.sort(key=lambda entry: entry[0]["number"])
    return [[target["number"], where, FIGURE_NAMES.get(target["figure"], target["figure"]),
             ("at least " if target["is_floor"] else "at most ") + f"{target['limit']:g}", number(target["value"], 3),
             verdict_cell(target)] for target, where in rows]


def targets_section(bench):
    rows = target_rows(bench)
    if not rows:
        return ""
    n_met = sum(row[-1] == "met" for row in rows)
    return (f"### Targets of the detector: {n_met} of {len(rows)} met\n\n" +
            table(["target", "where", "figure", "asked", "measured", ""], rows) + "\n")


# ---- accuracy

def accuracy_cell(row):
    """recall / precision, RMSE (median) px, branch angle RMSE."""
    if row is None:
        return DASH
    figures = row["figures"]
    if row["method"] == "bound":
        return f"{figures['rmse_px']:.3f} px, {figures['angle_rmse_deg']:.2f}°"
    text = f"{number(figures.get('recall'), 3)}/{number(figures.get('precision'), 3)}"
    if "rmse_px" in figures:
        text += f" {figures['rmse_px']:.3f} ({figures['median_px']:.3f}) px"
    if "angle_rmse_deg" in figures:
        text += f" {figures['angle_rmse_deg']:.2f}°"
    return text


def method_label(method, lambda_px):
    return METHOD_NAMES[method] + (f" {lambda_px}" if METHOD_NAMES[method].endswith("lambda") else "")


def accuracy_table(rows):
    variances = unique(row["variance"] for row in rows)
    by_key = {(row["method"], row["lambda_px"], row["variance"]): row for row in rows}
    methods = unique((row["method"], row["lambda_px"]) for row in rows)
    methods.sort(key=lambda key: list(METHOD_NAMES).index(key[0]))
    return table(["detector"] + [f"variance {variance}" for variance in variances],
                 [[method_label(*key)] + [accuracy_cell(by_key.get((*key, v))) for v in variances] for key in methods])


def branches_table(rows):
    """What accuracy_table leaves out, for the cells."""
    head = ["detector", "noise variance", "branches found", "branches right", "kind mistaken", "bias of L angles, deg"]
    shown = [row for row in rows if row["method"] in ("fixed", "thesis") and row["lambda_px"] in (10, 15, 20)]
    cells = []
    for row in shown:
        figures = row["figures"]
        cells.append([method_label(row["method"], row["lambda_px"]), row["variance"],
                      number(figures.get("branch_recall"), 3), number(figures.get("branch_precision"), 3),
                      number(figures.get("kind_confusion"), 3), number(figures.get("l_bias_deg"), 2)])
    return table(head, cells)


def accuracy_section(bench):
    if "accuracy" not in bench:
        return ""
    text = ("### Accuracy\n\nScenes drawn exactly (area-true, blur 0.7 px). Each cell: recall/precision within 2 px, "
            "RMSE (median) of the matched, RMSE of branch angles matched within 15 degrees. Sigma and t_b are 1.2 and "
            "6 up to variance 100, 1.5 and 8 at 400, 1.8 and 8 at 1000. The bound is Cramér and Rao's, from the "
            "pixels within lambda of the apex, over all cells, for an estimate that is told how many branches there "
            "are; a detector's own figure can lie below it where it loses the worst cells or cuts errors off at 2 "
            "px.\n\n")
    for name in unique(row["set"] for row in bench["accuracy"]):
        rows = [row for row in bench["accuracy"] if row["set"] == name]
        text += f"{SET_NAMES[name]}, {number(rows[0]['figures']['n_truth'])} junctions:\n\n{accuracy_table(rows)}\n"
        if name == "cells":
            text += ("![Accuracy over branch length](pictures/bench_accuracy.svg)\n\n"
                     f"Branches and kinds of the cells:\n\n{branches_table(rows)}\n")
    return text


# ---- repeatability

def repeatability_section(bench):
    rows = bench.get("repeatability", {}).get("rows")
    if not rows:
        return ""
    shown_names = [name for name in DETECTORS if any(row["detector"] == name for row in rows)]
    cells = []
    for key in unique((row["set"], row["variance"], row["warp"]) for row in rows):
        here = {row["detector"]: row["figures"] for row in rows if (row["set"], row["variance"], row["warp"]) == key}
        best = max(figures["repeatability"] for figures in here.values())
        cells.append([f"{key[0]}, {key[2]}", key[1], number(here["ours"]["n"])])
        for name in shown_names:
            share = here[name]["repeatability"] if name in here else None
            shown = number(share, 3)
            cells[-1].append(f"**{shown}**" if share == best else shown)
    text = ("### Repeatability\n\nShare of the strongest points found again within 2 px, of as many points in each "
            "pair as ours finds in both views (at most 300 structured, 100 natural); the best of each row in bold. "
            "Structured: polygons and chessboards drawn exactly again under the homography. Natural: crops of site "
            "pictures (`tests/bench/natural.json`), warped.\n\n")
    text += table(["views", "noise variance", "points"] + shown_names, cells)
    skipped = bench["repeatability"]["skipped"]
    if skipped:
        text += "\n**Left out, since the pictures were not there: " + "; ".join(skipped) + ".**\n"
    return text + "\n![Repeatability](pictures/bench_repeatability.svg)\n\n"


# ---- the thesis' experiments

def noise_claims(rows):
    """The thesis' two sentences, held against each method's rows."""
    text = ""
    for method in unique(row["method"] for row in rows):
        narrow, wide, high, low = [row for row in rows if row["method"] == method]
        fewer = "fewer" if wide["false"] < narrow["false"] else "**not fewer**"
        more = "more" if low["low_corners"] > high["low_corners"] else "**not more**"
        text += (f" {method.capitalize()}: at variance 400 {fewer} false junctions with the larger sigma, at 1000 "
                 f"{more} of the square of low contrast with the lower t_b.")
    return text


def noise_text(noise):
    rows = [[row["figure"], row["method"], number(row["variance"]), row["sigma_px"], number(row["t_b"]),
             number(row["false"], 1), number(row["corners"], 1), number(row["low_corners"], 2)]
            for row in noise["rows"]]
    return ("Figures 3.2 and 3.3, four squares under noise, one of low contrast "
            f"({noise['low_contrast']:g} grey levels), means over 20 seeds." + noise_claims(noise["rows"]) + "\n\n" +
            table(["figure", "method", "variance", "sigma", "t_b", "false junctions", "corners found of 16",
                   "of the 4 of low contrast"], rows) + "\n")


def triangle_text(triangle):
    by_key = {(row["method"], row["lambda_px"]): row for row in triangle["rows"]}
    lambdas = [value for value in (8, 10, 13, 15, 20, 24) if ("ours", value) in by_key]

    def cell(method, value):
        row = by_key.get((method, value))
        return f"{row['mean_deg']:.2f} ({row['sd_deg']:.2f})" if row else DASH
    return (f"Figure 3.5, sum of a triangle's angles in 28 views, noise variance {triangle['variance']:g}, mean "
            "(standard deviation) in degrees:\n\n" +
            table(["method"] + [f"lambda {value}" for value in lambdas],
                  [[method] + [cell(method, value) for value in lambdas] for method in ("thesis", "ours")]) +
            "\n![Sum of a triangle's angles](pictures/bench_triangle.svg)\n\n")


def chess_text(chess):
    rows = [[method, f"({one['peak_deg'][0]:g}, {one['peak_deg'][1]:g})", one["peak"], one["pairs"],
             number(100 * one["near"], 1) + " %", one["junctions"]]
            for method, one in ((name, chess[name]) for name in ("thesis", "ours"))]
    return ("Figure 3.6, directions of a chessboard's branches, pairs of one near level and one near upright, bins of "
            "5 degrees; the thesis' peak is at (-5, 90).\n\n" +
            table(["method", "peak", "pairs in it", "pairs", "within a bin of (-5, 90)", "junctions"], rows) +
            "\n![Histogram of directions](pictures/bench_chess.svg)\n\n")


def lines_text(lines):
    if lines["skipped"]:
        return "**Figure 3.10 left out, since the site cubes was not there.**\n\n"
    rows = [[f"{row['method']}, view {row['view']}", row["junctions"], row["lines"], number(row["median_deg"], 2),
             number(row["mean_deg"], 2), number(row["rms_deg"], 2)] for row in lines["rows"]]
    return ("Figure 3.10, site cubes: of each junction with three or more branches the two nearest to one straight "
            "line (within 20 degrees), how far they are from it. The thesis counts 322 and 301 junctions in its views "
            "e and f and four lines off by 5.09, 5.39, 0 and 7.26 degrees.\n\n" +
            table(["method", "junctions", "lines", "off, median, deg", "mean", "RMS"], rows) + "\n")


def thesis_section(bench):
    parts = [("noise", noise_text), ("triangle", triangle_text), ("chess", chess_text), ("lines", lines_text)]
    given = bench.get("thesis", {})
    text = "".join(write(given[name]) for name, write in parts if name in given)
    return "### The thesis' experiments (3.4)\n\n" + text if text else ""


def photographs_section(bench):
    given = bench.get("chess-stereo")
    if given is None:
        return ""
    if given["skipped"]:
        return "### Photographed chessboards\n\n**Left out, since the photographs were not there.**\n\n"
    rows = [[("ours, lambda " + str(row["lambda_px"])) if row["method"] == "fixed" else "ours, grown (default)",
             f"{row['found']} of {row['corners']}", f"{row['to_given_rms_px']:.3f} ({row['to_given_median_px']:.3f})",
             f"{row['to_lines_rms_px']:.3f} ({row['to_lines_median_px']:.3f})", number(row["given_to_lines_rms_px"], 3),
             number(row["own_gap_rms_px"], 3), number(row["given_gap_rms_px"], 3), number(row["angle_rms_deg"], 2)]
            for row in given["rows"]]
    return (f"### Photographed chessboards\n\n{given['images']} photographs of a board of 9 x 6 inner corners with "
            "known lens. Given corners are cornerSubPix's; the board's lines are fitted to them without distortion, so "
            "their own distance to the crossings is small by construction; \"straight\" is the distance of each "
            "detector's corners from lines fitted to its own.\n\n" +
            table(["detector", "found", "to given corners, px RMS (median)", "to crossings of lines",
                   "given corners to them", "straight: ours, px RMS", "given", "angle to lines, deg RMS"], rows) + "\n")


# ---- what other programs of the bench wrote

def speed_rows(paired):
    for row in paired:
        target = row.get("target") or {}
        best = min(row["ours_ratio"], row["fixed_ratio"])
        limit = target.get("ratio")
        verdict = "" if limit is None else f"<= {limit:g}: " + (
            "met" if row["ours_ratio"] <= limit else f"missed by {row['ours_ratio'] - limit:.2f}" + (
                ", met at fixed length" if best <= limit else ""))
        literal = row.get("literal_ms")
        yield [row["image"], row["kind"], f"{row['width_px']}x{row['height_px']}", number(row["blur_canny_ms"], 2),
               number(row["ours_ms"], 2), number(row["ours_ratio"], 2), number(row["fixed_ms"], 2),
               number(row["fixed_ratio"], 2), verdict, number(row["fixed_gradient_ms"], 2),
               "" if literal is None else number(literal, 1),
               "" if literal is None else number(literal / row["fixed_ms"], 1)]


def speed_section(bench):
    """Pairs with blur and Canny of the same image, and instructions."""
    paired = bench.get("speed", {}).get("paired", [])
    if not paired:
        return ""
    head = ["image", "kind", "size", "blur + Canny ms", "ours ms", "ratio", "fixed ms", "ratio", "target, ours",
            "of it gradient ms", "literal ms", "literal / fixed"]
    note = ("Medians over pairs in one process, one thread: ours (defaults), ours at one length (lambda 10, sigma 1.2, "
            "t_B 6, s_J 0.6), the thesis' literal method, each beside GaussianBlur(1.2) and Canny(48, 48, L2) of the same "
            "image. `outcrop-bench-speed` prints the same, and FAST, ORB, SIFT, LSD and Shi-Tomasi as Google Benchmark "
            "rows.\n\n")
    text = "### Speed\n\n" + note + table(head, list(speed_rows(paired))) + "\n"
    if bench.get("rivals"):
        text += "Other detectors in the same process (CPU ms, Google Benchmark; one thread):\n\n"
        text += rivals_table(bench["rivals"]) + "\n"
    counted = bench.get("instructions")
    if counted:
        text += "Instructions per frame (x86-64 and aarch64 under emulation, where time means nothing):\n\n"
        text += instructions_table(counted) + "\n"
    return text


def instructions_table(counted):
    rows = [[row["image"], row["method"], number(row.get("x86_instructions")), number(row.get("aarch64_instructions"))]
            for row in counted["instructions"]]
    return table(["image", "method", "x86-64", "aarch64"], rows)


def rivals_table(rivals):
    """A row per image, a column per detector; CPU milliseconds."""
    found = {tuple(one["name"].split("/", 1)): one["ms"] for one in rivals}
    detectors = unique(key[0] for key in found)
    return table(["image"] + detectors,
                 [[image] + [number(found.get((detector, image)), 2) for detector in detectors]
                  for image in unique(key[1] for key in found)])


def percent(value):
    return f"{100 * value:.1f}"


def ground_labels_table(labels):
    rows = []
    for site, runs in labels.items():
        for run in runs:
            met = run["precision"] >= 0.97 and run["recall"] >= 0.9 and run["obstacle_as_ground"] <= 0.02
            rows.append([site, run["poses"], number(run["n"]), percent(run["precision"]), percent(run["recall"]),
                         percent(run["obstacle_as_ground"]), percent(run["ground_as_obstacle"]),
                         "met" if met else "missed"])
    return table(["site", "poses", "ground", "precision % (>= 97)", "recall % (>= 90)", "obstacle called ground % (<= 2)",
                  "ground called obstacle %", "target"], rows)


def ground_grid(cells):
    thresholds = unique(cell["t_g"] for cell in cells)
    windows = unique(cell["window_px"] for cell in cells)
    found = {(cell["window_px"], cell["t_g"]): cell for cell in cells}

    def entry(cell):
        return f"{cell['correct']} of {cell['total']}, {percent(cell['share_correct'])}" if cell else ""

    return table(["window"] + [f"t_g {t:.2f}" for t in thresholds],
                 [[f"{w} x {w}"] + [entry(found.get((w, t))) for t in thresholds] for w in windows])


def ground_section(bench):
    labels = bench.get("ground_labels")
    if not labels:
        return ""
    text = ("### Ground filter\n\n`outcrop-bench-ground labels`: the vehicle on each site, its final labels against the "
            "truth. Poses: exact, or moved inside the margins with a seed (`outcrop-drive --perturb`).\n\n")
    text += ground_labels_table(labels) + "\n"
    speed = bench.get("ground_speed")
    if speed:
        times = ", ".join(f"{site} {one['median_ms']:.1f} (most {one['most_ms']:.1f})" for site, one in speed.items())
        text += f"Milliseconds a pair of views with 300 junctions each (<= 50): {times}.\n\n"
    for site, one in bench.get("ground_table", {}).items():
        text += (f"Table 4.1 of the thesis, ground matches of views {one['left']} and {one['right']} of {site} by window and "
                 f"t_g, poses {one['poses']}: correct of total, %.\n\n")
        for name, title in (("printed_in_thesis", "As printed (the thesis' own pictures)"),
                            ("thesis_form", "The thesis' form on these pictures"), ("ours", "Ours")):
            if one.get(name):
                text += f"{title}:\n\n{ground_grid(one[name])}\n"
    return text


SECTIONS = [targets_section, accuracy_section, repeatability_section, thesis_section, photographs_section,
            speed_section, ground_section]


def text(bench):
    """Empty when nothing was measured."""
    parts = "".join(section(bench) for section in SECTIONS)
    if not parts:
        return ""
    return (f"## The junction detector by itself\n\nWritten by `tools/bench.sh` (seed {bench['seed']}) on "
            f"{bench['machine']}; every figure comes out of its programs.\n\n{parts}")
