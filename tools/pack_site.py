#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Packs a rendered site folder into a small copy that the same readers read: tests/data/sites were made with it.

pack_site.py SITE DIR [--variant NAME]...

Colour images become JPEG (views at quality 95, virtual views and overhead maps at 90), masks stay PNG, true depth keeps
the bits that matter, names inside the JSON files follow. Variants (images_NAME with cameras_NAME.json) are only copied
when asked for. Needs python3-opencv and python3-numpy (tools/setup.sh --dev). The same input gives the same files.
"""
import argparse
import io
import pathlib
import re
import shutil
import sys
import zipfile

import cv2
import numpy as np

VIEW_QUALITY = 95
TRUTH_QUALITY = 90
# Depth is rounded to 2^-13 of itself (0.6 mm at 5 m), or to a quarter millimetre where that is coarser. Matches are
# judged at 1 %.
DEPTH_MANTISSA_BITS = 12
DEPTH_STEP = {"mm": 0.25, "m": 0.00025}


def write_jpeg(source, target, quality):
    image = cv2.imread(str(source), cv2.IMREAD_COLOR)
    if image is None:
        sys.exit(f"{source}: not an image")
    target.parent.mkdir(parents=True, exist_ok=True)
    if not cv2.imwrite(str(target), image, [cv2.IMWRITE_JPEG_QUALITY, quality]):
        sys.exit(f"{target}: cannot be written")


def round_depth(depth, step):
    """float32, each value on the coarser of the two grids; 0 stays 0."""
    _, exponent = np.frexp(depth.astype(np.float64))
    grid = np.maximum(np.ldexp(1.0, exponent - DEPTH_MANTISSA_BITS - 1), step)
    return (np.round(depth / grid) * grid).astype(np.float32)


def pack_depth(source, target, step):
    with np.load(source) as arrays:
        packed = {"depth": round_depth(arrays["depth"], step), "mask": arrays["mask"].astype(np.uint8)}
    target.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, array in packed.items():
            npy = io.BytesIO()
            np.lib.format.write_array(npy, array)
            entry = zipfile.ZipInfo(name + ".npy")  # dated 1980: the same bytes each time
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, npy.getvalue(), compresslevel=9)


def pack_json(source, target):
    """The file as it is, but for the names of images that became JPEG."""
    text = source.read_text()
    text = re.sub(r'("image"\s*:\s*"[^"]+)\.png"', r'\1.jpg"', text)
    text = re.sub(r'"(overhead(?:_shadows)?)\.png"', r'"\1.jpg"', text)
    target.write_text(text)


def pack_site(site, out, variants):
    cameras = site / "cameras.json"
    if not cameras.is_file():
        sys.exit(f"{cameras}: not there, so {site} is no site folder")
    units = re.search(r'"units"\s*:\s*"(mm|m)"', cameras.read_text())
    if not units:
        sys.exit(f"{cameras}: no units")
    if out.exists():
        shutil.rmtree(out)
    out.mkdir(parents=True)
    names = ["cameras.json", "path.json", "obstacles.json", "overhead.json"]
    for variant in variants:
        names += [f"cameras_{variant}.json", "images_variants.json"]
    for name in dict.fromkeys(names):
        if (site / name).is_file():
            pack_json(site / name, out / name)
    for folder in ["images"] + [f"images_{variant}" for variant in variants]:
        for image in sorted((site / folder).iterdir()):
            if image.suffix == ".jpg":
                (out / folder).mkdir(exist_ok=True)
                shutil.copyfile(image, out / folder / image.name)
            else:
                write_jpeg(image, out / folder / (image.stem + ".jpg"), VIEW_QUALITY)
    for image in sorted(site.glob("path/frame_*.png")) + [site / "overhead.png", site / "overhead_shadows.png"]:
        if image.is_file():
            write_jpeg(image, (out / image.relative_to(site)).with_suffix(".jpg"), TRUTH_QUALITY)
    for depth in sorted(site.glob("depth/*.npz")):
        pack_depth(depth, out / "depth" / depth.name, DEPTH_STEP[units.group(1)])
    for kept in sorted(site.glob("path/mask_*.png")) + sorted(site.glob("obstacles/*.ply")):
        (out / kept.relative_to(site)).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(kept, out / kept.relative_to(site))


def main():
    parser = argparse.ArgumentParser(description="Packs a site folder small; see the top of this file.")
    parser.add_argument("site", type=pathlib.Path)
    parser.add_argument("dir", type=pathlib.Path, help="written anew")
    parser.add_argument("--variant", action="append", default=[], metavar="NAME", help="light or noise")
    options = parser.parse_args()
    if options.dir.exists() and not (options.dir / "cameras.json").is_file():
        sys.exit(f"{options.dir}: exists and is no site folder; not touched")
    pack_site(options.site, options.dir, options.variant)
    sizes = {}
    for path in options.dir.rglob("*"):
        if path.is_file():
            part = path.relative_to(options.dir).parts
            sizes[part[0]] = sizes.get(part[0], 0) + path.stat().st_size
    for name, size in sorted(sizes.items()):
        print(f"{size:>10,}  {options.dir.name}/{name}")
    print(f"{sum(sizes.values()):>10,}  {options.dir.name}")


if __name__ == "__main__":
    main()
