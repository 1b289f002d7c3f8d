# SPDX-License-Identifier: BSD-3-Clause
"""docs/measurements.md out of measure.py's records: tables, verdicts and the sentences that compare."""
from statistics import mean, median

import bench_document
import matching_document
import soak_document

MIN_IOU = 0.3          # an obstacle below it counts as missed, as outcrop-eval counts
MAX_FALSE = 1
MIN_PRECISION = 0.90
MAX_DEMO_S = 60
SAME_BOXES_SLACK = 0.02
LAYERS = ["view", "patch", "overhead", "silhouette", "texture", "image", "request", "status"]
LAYER_NAMES = {"image": "pictures"}
DASH = "–"


def number(value, places=0, scale=1.0, unit=""):
    return DASH if value is None else f"{value * scale:,.{places}f}{unit}"


def percent(value):
    return number(value, 1, 100, " %")


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "| --- |" + " ---: |" * (len(head) - 1)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]) + "\n"


def rows_of(runs, cells, n_cells):
    """One row per run, its label first; a failed one gives its reason in place of figures."""
    rows = []
    for run in runs:
        if run["failed"]:
            rows.append([run["label"], "**failed**: " + run["failed"]] + [DASH] * (n_cells - 1))
        else:
            rows.append([run["label"]] + cells(run))
    return rows


def total_bytes(run):
    return number(run["bytes"]["total"])


def ious(run):
    return [box["iou"] for box in run["boxes"]]


def mean_iou(run):
    return mean(ious(run)) if run.get("boxes") else None


def precision(run):
    return (run.get("matches") or {}).get("precision")


def iou_cell(run):
    """Missed obstacles stand in bold."""
    return " ".join(f"{iou:.2f}" if iou > MIN_IOU else f"**{iou:.2f}**" for iou in ious(run)) or DASH


def judged(is_met, figure):
    return f"{figure}: {'met' if is_met else '**not met**'}"


def of_kind(result, *kinds, site=None):
    return [run for run in result["runs"] if run["kind"] in kinds and site in (None, run["site"])]


def truth_sites(result):
    return list(dict.fromkeys(run["site"] for run in of_kind(result, "ours")))


def head_section(result):
    about = result["machine"]
    text = ("# Measurements\n\nWritten by `tools/measure.py`; every figure, verdict and comparing sentence comes out of "
            "its runs, none is typed. A run is `outcrop-drive` (the real outcropd and outcrop-base over LCM) and then "
            "`outcrop-eval`; quality and bytes of a row are of the same run. Bytes are LCM payload, channel and header, "
            "both directions; \"with UDP/IP\" adds 28 a datagram. What each figure means: `outcrop-eval --help`.\n\n"
            f"Machine: {about['cpu']}, {about['cores']} cores, {about['os']}, {about['compiler']}, build type "
            f"{about['build_type']}; load before the first run {about['load_before']}. {len(result['runs'])} runs in "
            f"{result['minutes']} minutes.\n\n")
    if result["skipped"]:
        text += ("**Skipped, since the files were not there: " + ", ".join(result["skipped"]) +
                 ". Nothing below speaks of them.**\n\n")
    failed = [f"{run['site']} ({run['label']})" for run in result["runs"] if run["failed"]]
    if failed:
        text += "**Failed: " + ", ".join(failed) + ".**\n\n"
    for site in truth_sites(result):
        first = next((run for run in of_kind(result, "ours", site=site) if not run["failed"]), None)
        if first:
            text += f"- {site}: {first['views']} views, obstacles {', '.join(b['name'] for b in first['boxes'])}"
            given = result["margins"].get(site)
            text += f"; margins {given['position_m'] * 1000:g} mm, {given['angle_deg']:g} deg.\n" if given else ".\n"
    return text + "\n"


def target_cells(run):
    lowest = min(ious(run)) if run["boxes"] else 0.0
    found = judged(run["missed"] == 0 and lowest > MIN_IOU, f"{lowest:.2f}")
    if run["kind"] == "perturb":
        return [total_bytes(run), found, run["false"], percent(precision(run)), DASH, DASH]
    is_precise = precision(run) is not None and precision(run) >= MIN_PRECISION
    return [total_bytes(run), found, judged(run["false"] <= MAX_FALSE, run["false"]),
            judged(is_precise, percent(precision(run))),
            judged(run["replay_same"], "same" if run["replay_same"] else "differs"),
            judged(run["bytes_add_up"], "equal" if run["bytes_add_up"] else "unequal")]


def targets_section(result):
    head = ["run", "bytes", f"lowest box IoU (> {MIN_IOU:g})", f"false boxes (<= {MAX_FALSE})",
            f"matches correct (>= {100 * MIN_PRECISION:g} %)", "replay of link.lcm (same model)",
            "report's bytes against link.lcm (equal)"]
    runs = [run for run in of_kind(result, "ours", "perturb") if run["label"] in ("ours", "ours, perturb 1")]
    named = [dict(run, label=f"{run['site']}, " + ("exact poses" if run["kind"] == "ours" else "perturb 1"))
             for run in runs]
    text = "## Targets\n\n" + table(head, rows_of(named, target_cells, len(head) - 1))
    text += "\nPerturbed runs are asked for every obstacle only; their other figures stand for information.\n"
    for run in of_kind(result, "ours", site="depot"):
        if not run["failed"]:
            seconds = run["drive_s"] + run["eval_s"]
            text += (f"\nThe depot demo after the build, driven and judged, took {seconds:.1f} s for {total_bytes(run)} "
                     f"bytes (under {MAX_DEMO_S} s: {'met' if seconds < MAX_DEMO_S else '**not met**'}).\n")
    return text + "\n"


def seconds_cell(run):
    """Runs without a sequence are shorter for that alone."""
    return f"{run['drive_s']:.1f}" + ("" if run.get("sequence") or run["kind"] == "real" else " (no sequence)")


def bytes_table(runs):
    used = [layer for layer in LAYERS if any((run.get("bytes") or {}).get(layer) for run in runs)]
    head = (["link"] + [LAYER_NAMES.get(layer, layer) for layer in used] +
            ["bytes in all", "with UDP/IP", "messages", "drive, s"])

    def cells(run):
        layers = [number(run["bytes"].get(layer, 0)) for layer in used]
        return layers + [total_bytes(run), number(run["bytes_ip"]), number(run["messages"]), seconds_cell(run)]
    return table(head, rows_of(runs, cells, len(head) - 1))


def boxes_table(runs):
    head = ["link", "bytes", "matches", "correct", "box IoU of each", "mean", "missed", "false"]

    def cells(run):
        matches = run["matches"] or {}
        return [total_bytes(run), number(matches.get("n")), percent(matches.get("precision")), iou_cell(run),
                number(mean_iou(run), 3), run["missed"], run["false"]]
    return table(head, rows_of(runs, cells, len(head) - 1))


def ground_table(runs):
    head = ["link", "bytes", "poses off, mm", "deg", "footprint covered", "shown free wrongly, m2", "free ground free",
            "PSNR, dB", "SSIM", "mask IoU"]

    def cells(run):
        poses, footprint, sequence = run["poses"] or {}, run["footprint"] or {}, run["sequence"] or {}
        return [total_bytes(run), number(poses.get("position_rmse_m"), 2, 1000),
                number(poses.get("angle_rmse_deg"), 3), percent(footprint.get("covered")),
                number(footprint.get("false_free_m2"), 4), percent(footprint.get("free_recall")),
                number(sequence.get("psnr_db"), 2), number(sequence.get("ssim"), 3),
                number(sequence.get("mask_iou"), 3)]
    return table(head, rows_of(runs, cells, len(head) - 1))


def site_section(result, site):
    runs = [run for run in of_kind(result, "ours", "perturb", "variant", "rival", site=site)
            if run["kind"] != "perturb" or run["label"] == "ours, perturb 1"]
    named = [dict(run, label="null rival, " + run["label"]) if run["kind"] == "rival" else run for run in runs]
    return (f"### {site}\n\nWhat crossed the link:\n\n{bytes_table(named)}\nMatches and boxes (a missed obstacle in "
            f"bold):\n\n{boxes_table(named)}\nPoses, ground plane and sequence:\n\n{ground_table(named)}\n")


def sites_section(result):
    return ("## Site by site, the null rival beside ours\n\nThe null rival (`--link images:CODEC:Q`) sends every view "
            "whole as one picture and the base does all the work with the same code. Its poses are exact, as those of "
            "the first row.\n\n" + "".join(site_section(result, site) for site in truth_sites(result)))


def least_and_median(values, places, scale=1.0):
    return f"{min(values) * scale:.{places}f} / {median(values) * scale:.{places}f}"


def seeds_row(site, runs):
    good = [run for run in runs if not run["failed"]]
    label = f"{site}, {len(good)} of {len(runs)} seeds"
    if not good:
        return [label, "**failed**: " + runs[0]["failed"]] + [DASH] * 6
    sizes = [run["bytes"]["total"] for run in good]
    each = zip(*[ious(run) for run in good])
    precisions = [precision(run) for run in good if precision(run) is not None]
    return [label, f"{number(median(sizes))} / {number(max(sizes))}",
            least_and_median([mean_iou(run) for run in good], 3), ", ".join(least_and_median(one, 2) for one in each),
            f"{sum(run['missed'] > 0 for run in good)} of {len(good)}", max(run["false"] for run in good),
            least_and_median(precisions, 1, 100) + " %" if precisions else DASH,
            number(median([run["poses"]["position_rmse_m"] for run in good]), 2, 1000)]


def seeds_section(result):
    head = ["site", "bytes, median / most", "mean box IoU, least / median", "box IoU of each, least / median",
            "seeds that miss one", "false, most", "matches correct, least / median", "poses off, median, mm"]
    rows = []
    for site in truth_sites(result):
        runs = of_kind(result, "perturb", site=site)
        rows.append(seeds_row(site, runs))
        rows += [[f"{site}, {run['label']}", "**failed**: " + run["failed"]] + [DASH] * 6
                 for run in runs if run["failed"]]
    return ("## Poses moved inside the margins\n\n`--perturb`, each seed moving every pose independently and uniformly "
            "inside the site's margins:\n\n" + table(head, rows) + "\n")


def repeats_section(result):
    rows = []
    for site in truth_sites(result):
        runs = [run for run in of_kind(result, "ours", "repeat", site=site) if not run["failed"]]
        again = [run for run in runs if run["kind"] == "repeat"]
        if again:
            sizes = [run["bytes"]["total"] for run in runs]
            rows.append([site, f"{number(min(sizes))} to {number(max(sizes))}", len(runs),
                         f"{sum(run.get('same_as_first', False) for run in again)} of {len(again)}",
                         least_and_median([mean_iou(run) for run in runs], 3)])
        rows += [[f"{site}, {run['label']}", "**failed**: " + run["failed"]] + [DASH] * 3
                 for run in of_kind(result, "repeat", site=site) if run["failed"]]
    if not rows:
        return ""
    return ("## The same drive again\n\nWhen the base asks depends on when packets arrive, so a live drive need not "
            "repeat to the byte (the replay of its log does):\n\n" +
            table(["site", "bytes", "runs", "same model and matches as the first", "mean box IoU, least / median"],
                  rows) + "\n")


def cheapest_rival(result, ours, least_mean_iou, most_missed=0):
    """The cheapest null rival with at least this mean box IoU that misses no more than that; None if there is none."""
    rivals = [run for run in of_kind(result, "rival", site=ours["site"])
              if not run["failed"] and run["missed"] <= most_missed and mean_iou(run) >= least_mean_iou]
    return min(rivals, key=lambda run: run["bytes"]["total"], default=None)


def ratio(ours, rival):
    return rival["bytes"]["total"] / ours["bytes"]["total"]


def compared(ours, rival):
    if rival is None:
        return f"on {ours['site']} no null rival tried qualifies, at any number of bytes"
    times = ratio(ours, rival)
    if times > 1:
        return f"on {ours['site']} ours is cheaper by a factor of {times:.2f}"
    return f"on {ours['site']} the null rival is cheaper by a factor of {1 / times:.2f}"


def verdict(pairs):
    ours_wins = sum(rival is not None and ratio(ours, rival) > 1 for ours, rival in pairs)
    rival_wins = sum(rival is not None and ratio(ours, rival) <= 1 for ours, rival in pairs)
    text = f"Ours is cheaper on {ours_wins} of {len(pairs)} sites, the null rival on {rival_wins}"
    alone = len(pairs) - ours_wins - rival_wins
    return (text + (f", {alone} without a rival that qualifies" if alone else "") + ": " +
            "; ".join(compared(ours, rival) for ours, rival in pairs) + ".")


def near_miss(result, ours):
    """Where no rival qualifies: the one that fails for a missed obstacle alone, and by how little it does."""
    near = cheapest_rival(result, ours, mean_iou(ours) - SAME_BOXES_SLACK, len(ours["boxes"]))
    if near is None:
        return ""
    return (f" On {ours['site']} {near['label']} reaches our mean at {ratio(ours, near):.2f} of our bytes and fails only "
            f"for {near['missed']} missed: its lowest IoU is {min(ious(near)):.2f} against the limit of {MIN_IOU:g}, ours "
            f"{min(ious(ours)):.2f}.")


def reservations(result, pairs):
    """What else a reader must know of each pair."""
    text = ""
    for ours, rival in pairs:
        layer, most = max(((key, n) for key, n in ours["bytes"].items() if key != "total"), key=lambda item: item[1])
        text += f" On {ours['site']} {percent(most / ours['bytes']['total'])} of our bytes are the {layer} layer."
        if rival is None:
            text += near_miss(result, ours)
        if ours["missed"]:
            text += f" Ours misses {ours['missed']} there, which its rival was not allowed to."
        if rival and precision(rival) is not None and precision(rival) < MIN_PRECISION:
            text += (f" The rival's matches there are {percent(precision(rival))} correct, ours "
                     f"{percent(precision(ours))}.")
    return text


def rivals_table(pairs):
    head = ["site", "our bytes", "cheapest rival", "its bytes", "its bytes / ours", "mean box IoU, ours / its",
            "missed, ours / its", "matches correct, ours / its", "mask IoU, ours / its"]
    rows = []
    for ours, rival in pairs:
        row = [ours["site"], total_bytes(ours)]
        if rival is None:
            rows.append(row + ["none tried", DASH, DASH, f"{mean_iou(ours):.3f} / {DASH}",
                               f"{ours['missed']} / {DASH}", f"{percent(precision(ours))} / {DASH}", DASH])
            continue
        masks = [number((run["sequence"] or {}).get("mask_iou"), 3) for run in (ours, rival)]
        rows.append(row + [rival["label"], total_bytes(rival), f"{ratio(ours, rival):.2f}",
                           f"{mean_iou(ours):.3f} / {mean_iou(rival):.3f}", f"{ours['missed']} / {rival['missed']}",
                           f"{percent(precision(ours))} / {percent(precision(rival))}", " / ".join(masks)])
    return table(head, rows)


def same_boxes_section(result):
    good = [run for run in of_kind(result, "ours") if not run["failed"] and run["boxes"]]
    if not good:
        return ""
    left_out = [run["label"] + " on " + run["site"] for run in of_kind(result, "ours", "rival") if run["failed"]]
    warning = f"**Left out, since they failed: {', '.join(left_out)}.**\n\n" if left_out else ""
    same = [(ours, cheapest_rival(result, ours, mean_iou(ours) - SAME_BOXES_SLACK)) for ours in good]
    found = [(ours, cheapest_rival(result, ours, 0.0)) for ours in good]
    return ("## Our bytes beside the null rival's at the same boxes\n\nFor each site the cheapest null rival that "
            f"misses no obstacle and whose mean box IoU is at least ours less {SAME_BOXES_SLACK:g}, all poses exact:\n\n"
            f"{warning}{rivals_table(same)}\n{verdict(same)}{reservations(result, same)}\n\nHeld to less, the cheapest null rival that "
            f"misses no obstacle, however well its boxes fit:\n\n{rivals_table(found)}\n{verdict(found)}\n\n"
            "![Bytes against mean box IoU](pictures/bytes_vs_iou.svg)\n\n")


def real_section(result):
    runs = of_kind(result, "real")
    if not runs:
        return ""
    head = ["site", "bytes", "views", "obstacles", "suspected", "points", "poses moved, mm", "deg"]

    def cells(run):
        poses = run["poses"] or {}
        return [total_bytes(run), run["views"], run["obstacles"], run["suspected"], run["points"],
                number(poses.get("position_rmse_m"), 2, 1000), number(poses.get("angle_rmse_deg"), 3)]
    named = [dict(run, label=run["site"]) for run in runs]
    n_good = sum(not run["failed"] for run in runs)
    return ("## Photographs\n\nNo truth but the poses, so these are only asked to run through: "
            f"{judged(n_good == len(runs), f'{n_good} of {len(runs)} do')}. The refined poses are held against the "
            f"reported ones:\n\n{table(head, rows_of(named, cells, len(head) - 1))}\n{bytes_table(named)}\n")


def vehicle_table(runs):
    head = ["run", "bytes", "frames", "ms a frame, least", "median", "most", "bytes a frame, view layer"]

    def cells(run):
        times = run["vehicle_ms"]
        if not times:
            return [total_bytes(run), 0] + [DASH] * 4
        return [total_bytes(run), len(times), number(min(times), 1), number(median(times), 1), number(max(times), 1),
                number(run["bytes"]["view"] / run["views"])]
    return table(head, rows_of(runs, cells, len(head) - 1))


def base_table(runs):
    steps = list(dict.fromkeys(step for run in runs if not run["failed"] for step in run["ms"]))
    head = ["run", "bytes"] + [f"{step}, ms" for step in steps] + ["drive, s", "eval, s"]

    def cells(run):
        return ([total_bytes(run)] + [number(run["ms"].get(step), 1) for step in steps] +
                [number(run["drive_s"], 1), number(run["eval_s"], 1)])
    return table(head, rows_of(runs, cells, len(head) - 1))


def times_section(result):
    runs = [dict(run, label=run["site"]) for run in of_kind(result, "ours", "real")]
    return ("## Times\n\nThe vehicle, junctions and ground filter of each frame, while the base shares the machine:\n\n" +
            vehicle_table(runs) + "\nThe base by step, the whole drive, the evaluation:\n\n" + base_table(runs) + "\n")


def text(result, bench=None, soak=None, matching=None):
    import shape_document  # here: it is written with the helpers above

    """bench, soak, matching: what docs/bench.json, soak.json and matching.json hold, whose parts stand at the end."""
    parts = [head_section(result), targets_section(result), same_boxes_section(result), seeds_section(result),
             shape_document.text(result), sites_section(result), repeats_section(result), real_section(result), times_section(result)]
    parts += [soak_document.text(soak), matching_document.text(matching), bench_document.text(bench) if bench else ""]
    return "".join(parts).rstrip() + "\n"
