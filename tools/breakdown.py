#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Drives one site with ever wider margins filled to their brim and prints, as JSON, what the model says and how wrong it is."""
import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

LEVELS = [(0.01, 0.5), (0.025, 0.75), (0.05, 1.0), (0.1, 1.5), (0.2, 2.0), (0.4, 3.0), (0.7, 4.0), (1.0, 5.0)]
WRONG_IOU = 0.3  # a claimed box that shares less with its obstacle is wrong


def run(command, seconds):
    return subprocess.run([str(c) for c in command], check=True, capture_output=True, text=True, timeout=seconds).stdout


def level(programs, site, position_m, angle_deg, perturbation):
    with tempfile.TemporaryDirectory() as folder:
        run([programs / "outcrop-drive", site, "--out", folder, "--as", "none", "--margin-pos", position_m,
             "--margin-ang", angle_deg, "--perturb", perturbation], 120)
        judged = json.loads(run([programs / "outcrop-eval", site, folder, "--json"], 60))
        model = json.loads(Path(folder, "model", "obstacles.json").read_text(encoding="utf-8"))
    claimed = [b["iou"] for b in judged["boxes"] if b["found"] is not None and b["iou"] is not None]
    faults = [s["code"] for s in model["quality"] if s["severity"] == "fault"]
    n_wrong = judged["false"] + sum(1 for iou in claimed if iou < WRONG_IOU) if model["obstacles"] else 0
    return {
        "margin_m": position_m, "margin_deg": angle_deg, "quality": model["quality"], "is_fault": bool(faults),
        "boxes": len(model["obstacles"]), "suspected": len(model["suspected"]), "iou": claimed, "wrong_boxes": n_wrong,
        "false_free_m2": judged["footprint"]["false_free_m2"], "position_rmse_m": judged["poses"]["position_rmse_m"],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("site", type=Path)
    parser.add_argument("--programs", type=Path, default=Path("build/bin"), help="folder of outcrop-drive")
    parser.add_argument("--perturb", default="1:independent", help="as for outcrop-drive")
    args = parser.parse_args()
    levels = [level(args.programs, args.site, *margins, args.perturb) for margins in LEVELS]
    n_wrong = sum(entry["wrong_boxes"] for entry in levels)
    is_safe = n_wrong == 0 and all(entry["false_free_m2"] == 0 for entry in levels)
    json.dump({"site": args.site.name, "perturb": args.perturb, "is_safe": is_safe, "levels": levels}, sys.stdout, indent=1)
    print()
    return 0 if is_safe else 1


if __name__ == "__main__":
    sys.exit(main())
