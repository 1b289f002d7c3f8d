#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""COLMAP on the same sites and poses as ours: obstacles found, box IoU, seconds and bytes, side by side.

tools/peer_colmap.py --sites DIR [--json FILE] [--only NAME]... [--perturb SEED]    after tools/build.sh

Each site is driven by outcrop-drive first. Then COLMAP 3.8 (tools/setup.sh --peers) gets every picture whole, as it is and as
a JPEG, and the poses that our vehicle reported: features, exhaustive matching, point_triangulator. With poses moved
inside the margins bundle_adjuster and a second triangulation follow, on a line of their own. Its points become obstacles by our clusters and
boxes (outcrop-bench-matching points). Debian's COLMAP has neither CUDA nor CGAL: no dense stereo, no Delaunay mesh.
Without COLMAP it says so and exits 0. Standard library only.
"""
import argparse
import json
import os
import pathlib
import shutil
import sqlite3
import struct
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
SITES = ["depot", "two_obstacles", "cubes"]
PINHOLE = 1        # COLMAP's number of the model
JPEG_SCALE = "3"   # of ffmpeg's -q:v, 2 the best; about quality 90
TIMEOUT_S = 900
FIXED = ["--Mapper.ba_refine_focal_length", "0", "--Mapper.ba_refine_principal_point", "0",
         "--Mapper.ba_refine_extra_params", "0"]


def say(text):
    print(f"peer_colmap: {text}", file=sys.stderr, flush=True)


def run(command):
    """Seconds. RuntimeError with the last line when it fails."""
    begin = time.monotonic()
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, timeout=TIMEOUT_S,
                          env=dict(os.environ, QT_QPA_PLATFORM="offscreen"))
    if done.returncode != 0:
        last = (done.stderr.strip() or done.stdout.strip() or "no reason given").splitlines()[-1]
        raise RuntimeError(f"{pathlib.Path(str(command[0])).name} {command[1]}: {last}")
    return time.monotonic() - begin


def quaternion(r):
    """w, x, y, z of a rotation matrix; the largest component is never small."""
    squares = [1 + r[0][0] + r[1][1] + r[2][2], 1 + r[0][0] - r[1][1] - r[2][2],
               1 - r[0][0] + r[1][1] - r[2][2], 1 - r[0][0] - r[1][1] + r[2][2]]
    k = max(range(4), key=lambda i: squares[i])
    rows = [[squares[0], r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]],
            [r[2][1] - r[1][2], squares[1], r[1][0] + r[0][1], r[0][2] + r[2][0]],
            [r[0][2] - r[2][0], r[1][0] + r[0][1], squares[2], r[2][1] + r[1][2]],
            [r[1][0] - r[0][1], r[0][2] + r[2][0], r[2][1] + r[1][2], squares[3]]]
    norm = sum(v * v for v in rows[k]) ** 0.5
    return [v / norm for v in rows[k]]


def camera_parameters(view):
    """COLMAP's pixels have their centre at a half."""
    return [view["fx"], view["fy"], view["cx"] + 0.5, view["cy"] + 0.5]


def put_intrinsics(database, by_name):
    """Every picture has a camera of its own; gives {name: (image, camera)}."""
    with sqlite3.connect(database) as base:
        found = {name: (image, camera) for image, name, camera in
                 base.execute("SELECT image_id, name, camera_id FROM images")}
        for name, (_, camera) in found.items():
            base.execute("UPDATE cameras SET model = ?, params = ? WHERE camera_id = ?",
                         (PINHOLE, struct.pack("<4d", *camera_parameters(by_name[name])), camera))
    return found


def write_model(folder, by_name, ids, metres):
    folder.mkdir(parents=True)
    cameras, images = [], []
    for name, view in by_name.items():
        image, camera = ids[name]
        numbers = " ".join(repr(v) for v in camera_parameters(view))
        cameras.append(f"{camera} PINHOLE {view['width']} {view['height']} {numbers}\n")
        pose = quaternion(view["R"]) + [v * metres for v in view["t"]]
        images.append(f"{image} {' '.join(repr(v) for v in pose)} {camera} {name}\n\n")
    (folder / "cameras.txt").write_text("".join(cameras))
    (folder / "images.txt").write_text("".join(images))
    (folder / "points3D.txt").write_text("")


def write_points(model, work, file):
    text = work / "text"
    text.mkdir(exist_ok=True)
    run(["colmap", "model_converter", "--input_path", model, "--output_path", text, "--output_type", "TXT"])
    lines = []
    for line in (text / "points3D.txt").read_text().splitlines():
        if line and not line.startswith("#"):
            words = line.split()
            lines.append(f"{words[1]} {words[2]} {words[3]} {len(words[8:]) // 2}\n")
    file.write_text("".join(lines))


def colmap(site, cameras_file, work, pictures, adjusts):
    """{"seconds", ...} of one run on these pictures: {name: file}."""
    root = json.loads(cameras_file.read_text())
    metres = 1e-3 if root["units"] == "mm" else 1.0
    folder = work / "pictures"
    folder.mkdir(parents=True)
    by_name = {}
    for view in root["views"]:
        file = pictures[pathlib.Path(view["image"]).stem]
        shutil.copy(file, folder / file.name)
        by_name[file.name] = view
    base = work / "base.db"
    seconds = run(["colmap", "feature_extractor", "--database_path", base, "--image_path", folder,
                   "--SiftExtraction.use_gpu", "0"])
    ids = put_intrinsics(base, by_name)
    seconds += run(["colmap", "exhaustive_matcher", "--database_path", base, "--SiftMatching.use_gpu", "0"])
    write_model(work / "known", by_name, ids, metres)
    seconds += triangulate(base, folder, work / "known", work / "model")
    if adjusts:
        (work / "adjusted").mkdir()
        seconds += run(["colmap", "bundle_adjuster", "--input_path", work / "model", "--output_path", work / "adjusted",
                        "--BundleAdjustment.refine_focal_length", "0", "--BundleAdjustment.refine_extra_params", "0"])
        shutil.rmtree(work / "model")
        seconds += triangulate(base, folder, work / "adjusted", work / "model")
    write_points(work / "model", work, work / "points.txt")
    judged = subprocess.run([ROOT / "build/bin/outcrop-bench-matching", "points", site, work / "points.txt"],
                            capture_output=True, text=True, check=True)
    return {"seconds": seconds, "bytes": sum(file.stat().st_size for file in pictures.values()),
            **json.loads(judged.stdout)}


def triangulate(base, pictures, poses, out):
    out.mkdir()
    return run(["colmap", "point_triangulator", "--database_path", base, "--image_path", pictures, "--input_path", poses,
                "--output_path", out, "--clear_points", "1", *FIXED])


def ours(site, work, perturb):
    drive = [ROOT / "build/bin/outcrop-drive", site, "--out", work / "drive"]
    seconds = run(drive + (["--perturb", perturb] if perturb else []))
    text = subprocess.run([ROOT / "build/bin/outcrop-eval", site, work / "drive", "--json"], capture_output=True,
                          text=True, check=True).stdout
    judged = json.loads(text)
    report = json.loads((work / "drive/report.json").read_text())
    boxes = [{"name": box["name"], "iou": box["iou"], "obb_iou": box.get("obb_iou")} for box in judged["boxes"]]
    return {"seconds": seconds, "bytes": report["bytes"]["total"], "points": report["counts"].get("points"),
            "found": int(report["counts"]["obstacles"]), "suspected": int(report["counts"]["suspected"]),
            "missed": judged["missed"], "false": judged["false"], "boxes": boxes}


def as_jpeg(pictures, folder):
    folder.mkdir()
    out = {}
    for stem, file in pictures.items():
        out[stem] = folder / f"{stem}.jpg"
        run(["ffmpeg", "-nostdin", "-loglevel", "error", "-i", file, "-q:v", JPEG_SCALE, out[stem]])
    return out


def measure(site, work, perturb):
    rows = [{"method": "ours, on request", **ours(site, work, perturb)}]
    cameras = work / "drive/vehicle/cameras.json"
    pictures = {pathlib.Path(view["image"]).stem: site / view["image"]
                for view in json.loads((site / "cameras.json").read_text())["views"]}
    kinds = {"as they are": pictures, "JPEG": as_jpeg(pictures, work / "jpeg")}
    for kind, files in kinds.items():
        for adjusts in ([False, True] if perturb else [False]):
            name = f"COLMAP, pictures {kind}" + (", bundle adjusted" if adjusts else "")
            try:
                row = colmap(site, cameras, work / (kind + str(adjusts)), files, adjusts)
            except (RuntimeError, OSError, subprocess.SubprocessError) as fault:
                row = {"failed": str(fault).replace(str(work), "")}
            rows.append({"method": name, **row})
    for row in rows:
        say(f"{site.name}, poses {perturb or 'exact'}: {row['method']}: " + (row.get("failed") or
            f"{row['found']} found, {row['missed']} missed, {row['seconds']:.1f} s, {row['bytes']} bytes"))
    return {"site": site.name, "poses": perturb or "exact", "rows": rows}


def main():
    parser = argparse.ArgumentParser(description="COLMAP 3.8 beside ours on the same sites and poses.")
    parser.add_argument("--sites", type=pathlib.Path, action="append", required=True,
                        help="folders that hold depot, two_obstacles, cubes; the first that has a site counts")
    parser.add_argument("--only", action="append", help="this site")
    parser.add_argument("--perturb", default="1", help="seed of the moved poses, as outcrop-drive has it")
    parser.add_argument("--json", type=pathlib.Path, help="figures go here and not to standard output")
    options = parser.parse_args()
    if not shutil.which("colmap"):
        say("SKIPPED: COLMAP is not installed (tools/setup.sh --peers)")
        return 0
    cases = []
    for name in options.only or SITES:
        site = next((folder / name for folder in options.sites if (folder / name / "depth").is_dir()), None)
        if site is None:
            say(f"SKIPPED: {name}, not in the given folders")
            continue
        for perturb in ["", options.perturb]:
            with tempfile.TemporaryDirectory() as work:
                cases.append(measure(site.resolve(), pathlib.Path(work), perturb))
    text = json.dumps(cases, indent=1) + "\n"
    if options.json:
        options.json.write_text(text)
    else:
        print(text, end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
