#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Captured logs against their kept models: replay_logs.py --bin DIR LOGS [--renew]

Every NAME.lcm in LOGS is replayed and compared with NAME.expected.json: counts and bytes must be equal, every box coordinate
within 0.1 mm, yaw within 0.01 degree. --renew writes the expectations instead (tools/renew_logs.sh does that).
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

NEAR_M, NEAR_DEG = 1e-4, 0.01
COUNTS = ("views", "obstacles", "suspected", "points", "matches_obstacle", "matches_ground", "tiles", "packets_ill_formed",
          "packets_foreign", "log_garbage_bytes", "log_is_cut")


def replay(bin_dir, log, scratch):
    out = pathlib.Path(scratch) / log.stem
    done = subprocess.run([str(bin_dir / "outcrop-base"), "replay", str(log), "--out", str(out), "--as", "none"],
                          capture_output=True, text=True, timeout=280)
    if done.returncode != 0:
        sys.exit(f"{log.name}: exit status {done.returncode}: {done.stderr}")
    report = json.loads((out / "report.json").read_text())
    return {"counts": {name: report["counts"][name] for name in COUNTS}, "bytes": report["bytes"],
            "messages": report["messages"], "model": json.loads((out / "model" / "obstacles.json").read_text())}


def differences(kept, found, place="", near=NEAR_M):
    """Lines that say where two expectations differ; numbers of the model may be near, all else must be equal."""
    if isinstance(kept, dict) and isinstance(found, dict):
        if set(kept) != set(found):
            return [f"{place}: keys {sorted(set(kept) ^ set(found))}"]
        return [line for key in kept for line in differences(
            kept[key], found[key], f"{place}/{key}", NEAR_DEG if key == "yaw_deg" else near if place else
            (NEAR_M if key == "model" else 0))]
    if isinstance(kept, list) and isinstance(found, list):
        if len(kept) != len(found):
            return [f"{place}: {len(found)} entries, {len(kept)} kept"]
        return [line for i, pair in enumerate(zip(kept, found)) for line in differences(*pair, f"{place}/{i}", near)]
    if isinstance(kept, float) and isinstance(found, (int, float)) and not isinstance(found, bool):
        return [] if abs(kept - found) <= near else [f"{place}: {found}, kept {kept}"]
    return [] if kept == found else [f"{place}: {found}, kept {kept}"]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("logs", type=pathlib.Path)
    parser.add_argument("--renew", action="store_true")
    options = parser.parse_args()
    logs = sorted(options.logs.glob("*.lcm"))
    if not logs:
        sys.exit(f"{options.logs}: no logs")
    faults = []
    with tempfile.TemporaryDirectory() as scratch:
        for log in logs:
            expectation = log.with_suffix(".expected.json")
            found = replay(options.bin, log, scratch)
            if options.renew:
                expectation.write_text(json.dumps(found, indent=1) + "\n")
            else:
                faults += [f"{log.name}{line}" for line in differences(json.loads(expectation.read_text()), found)]
            counts = found["counts"]
            print(f"{log.name}: {log.stat().st_size} bytes, {counts['views']} views, {counts['obstacles']} obstacles, "
                  f"{counts['packets_ill_formed']} ill-formed packets, {counts['log_garbage_bytes']} bytes of garbage"
                  + (", cut" if counts["log_is_cut"] else ""))
    print("\n".join(faults))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
