#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""A base that is killed at any moment comes back to the same model: kill_sweep.py --bin DIR --site DIR

One outcropd that has taken all its views; a base that runs through; then bases that are killed (SIGKILL) after ever more
messages, one of them with its journal cut in the middle of an event, and started again. The folders of all must be equal,
byte for byte. In a private network namespace.
"""
import argparse
import filecmp
import pathlib
import subprocess
import sys
import tempfile
import time

from private_network import enter_private_network

DOWN, UP = "udpm://239.255.76.67:7667?ttl=0", "udpm://239.255.76.68:7668?ttl=0"
SAME = ["matches.json", "model/obstacles.json", "model/points.ply", "model/cameras.json", "model/ground.png",
        "overhead.png", "model/site.glb"]
SHARES = [0.02, 0.15, 0.4, 0.6, 0.8, 0.97]  # of the bytes of the whole journal, when the base is killed
CUT = 3                                     # index of the share at which the journal is cut as well


def fail(*what):
    sys.exit("kill_sweep: " + " ".join(str(w) for w in what))


def start_base(bin_dir, folder, name):
    out = folder / name
    config = folder / f"{name}.yaml"
    config.write_text(f'vehicle: 1\ndown_url: "{DOWN}"\nup_url: "{UP}"\nout: "{out}"\nas: voxels\n'
                      f'path: "{folder}/path.json"\nexit_when_settled: true\n')
    return subprocess.Popen([bin_dir / "outcrop-base", "live", "--config", config], stdout=subprocess.PIPE,
                            stderr=subprocess.STDOUT, text=True), out


def finish(process, what):
    text, _ = process.communicate(timeout=60)
    if process.returncode != 0:
        fail(what, "ended with", process.returncode, text)
    return text


def kill_at(process, journal, n_bytes):
    deadline = time.monotonic() + 40
    while not journal.exists() or journal.stat().st_size < n_bytes:
        if process.poll() is not None or time.monotonic() > deadline:
            fail("the base ended before its journal had", n_bytes, "bytes")
        time.sleep(0.002)
    process.kill()
    process.communicate()


def sweep(options, folder):
    base, whole = start_base(options.bin, folder, "whole")
    finish(base, "the undisturbed base")
    if not (whole / "model" / "1.voxels.ply").exists():
        fail("the undisturbed base carved nothing")
    size = (whole / "link.lcm").stat().st_size
    n_told = 0
    for i, share in enumerate(SHARES):
        name = f"killed_{i}"
        base, out = start_base(options.bin, folder, name)
        kill_at(base, out / "link.lcm", share * size)
        if (out / "report.json").exists():
            fail(name, "was finished before it was killed")
        if i == CUT:
            with open(out / "link.lcm", "r+b") as journal:
                journal.truncate((out / "link.lcm").stat().st_size - 9)
        base, out = start_base(options.bin, folder, name)
        text = finish(base, name)
        n_told += "went on from" in text and ("was cut" in text) == (i == CUT)
        for file in SAME:
            if not filecmp.cmp(whole / file, out / file, shallow=False):
                fail(name, "came back to another", file)
    if n_told != len(SHARES):
        fail("only", n_told, "of", len(SHARES), "said rightly what they went on from")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--site", type=pathlib.Path, required=True)
    options = parser.parse_args()
    enter_private_network("kill_sweep")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "path.json").write_text('{"waypoints":[{"x":0.0,"y":-0.5,"pan_deg":0},{"x":0.1,"y":-0.5,"pan_deg":0}],'
                                          '"steps":2,"height_m":0.3,"tilt_deg":60,"swing_deg":0,"hfov_deg":60,'
                                          '"width":160,"height":120}')
        config = folder / "outcropd.yaml"
        config.write_text(f'vehicle: 1\nstored_views: 16\nlink:\n  down_url: "{DOWN}"\n  up_url: "{UP}"\nsource:\n'
                          f'  site: "{options.site.resolve()}"\n  period_ms: 20\n')
        vehicle = subprocess.Popen([options.bin / "outcropd", "--config", config], stdout=subprocess.DEVNULL)
        try:
            sweep(options, folder)
        finally:
            vehicle.terminate()
            vehicle.wait(10)
    print(f"kill_sweep: killed {len(SHARES)} times, the same model each time")


main()
