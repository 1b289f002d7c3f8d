#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Do two machines find the same junctions, bit for bit?

same_bits.py --native DIR --sites DIR -- COMMAND...    COMMAND runs the other machine's junction_digest

Compares, line by line, what DIR/junction_digest and COMMAND print for the pictures of all sites, which
DIR/image_to_pgm decodes once for both. Exit 77 when the native programs are not built.
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile

N_SHOWN = 5


def run(command, pictures):
    return subprocess.run([*command, *pictures], check=True, capture_output=True, text=True).stdout.splitlines()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--native", type=pathlib.Path, required=True)
    parser.add_argument("--sites", type=pathlib.Path, required=True)
    parser.add_argument("command", nargs="+")
    options = parser.parse_args()
    digest, to_pgm = options.native / "junction_digest", options.native / "image_to_pgm"
    for program in (digest, to_pgm):
        if not program.exists():
            print(f"same_bits: SKIPPED: {program.name} is not built for this machine")
            return 77
    with tempfile.TemporaryDirectory() as scratch:
        images = sorted(str(path) for path in options.sites.glob("*/images/*"))
        if not images:
            print("same_bits: no pictures")
            return 1
        subprocess.run([to_pgm, scratch, *images], check=True)
        pictures = sorted(str(path) for path in pathlib.Path(scratch).glob("*.pgm"))
        here, there = (run(command, pictures) for command in ([digest], options.command))
        different = [pair for pair in zip(here, there) if pair[0] != pair[1]]
        for ours, theirs in different[:N_SHOWN]:
            print(f"here:  {ours}\nthere: {theirs}")
    print(f"{len(here)} digests over {len(pictures)} pictures and two made ones, {len(different)} differ")
    return 1 if different or len(here) != len(there) else 0


if __name__ == "__main__":
    sys.exit(main())
