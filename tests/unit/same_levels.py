#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Do all instruction sets of this machine find the same junctions, bit for bit, on every picture of every site?

same_levels.py --native DIR --sites DIR...    DIR holds junction_digest and image_to_pgm

Every folder images* of every site is decoded by image_to_pgm and handed to junction_digest --levels, which holds each
level against the twin in many settings. A folder of sites that is not there is said and passed over, except the first.
Exit 77 when image_to_pgm is not built.
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile

PICTURES = {".jpg", ".jpeg", ".png"}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--native", type=pathlib.Path, required=True)
    parser.add_argument("--sites", type=pathlib.Path, nargs="+", required=True)
    options = parser.parse_args()
    to_pgm = options.native / "image_to_pgm"
    if not to_pgm.exists():
        print("same_levels: SKIPPED: image_to_pgm is not built")
        return 77
    n_pictures, n_failed = 0, 0
    for place in options.sites:
        folders = sorted(path for path in place.glob("*/images*") if path.is_dir())
        if not folders:
            print(f"same_levels: SKIPPED: no sites in {place}")
        for folder in folders:
            images = sorted(str(path) for path in folder.iterdir() if path.suffix.lower() in PICTURES)
            with tempfile.TemporaryDirectory() as scratch:
                subprocess.run([to_pgm, scratch, *images], check=True)
                pictures = sorted(str(path) for path in pathlib.Path(scratch).glob("*.pgm"))
                run = subprocess.run([options.native / "junction_digest", "--levels", *pictures], check=False,
                                     capture_output=True, text=True)
            n_pictures += len(pictures)
            if run.returncode != 0 or len(pictures) != len(images):
                n_failed += 1
                print(f"{folder}: {len(images)} images, {len(pictures)} pictures\n{run.stdout}{run.stderr}")
    print(f"{n_pictures} pictures of {len(options.sites)} places, {n_failed} folders with differences")
    return 1 if n_failed or not n_pictures else 0


if __name__ == "__main__":
    sys.exit(main())
