#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""outcrop-drive as a whole: drive.py --bin DIR two_obstacles|options|faults|through SITE. Exits 77 where it cannot run."""
import argparse
import filecmp
import json
import os
import pathlib
import subprocess
import sys
import tempfile

import wire

SKIP = 77
n_checks = 0


def check(condition, *what):
    global n_checks
    n_checks += 1
    if not condition:
        sys.exit("drive: " + " ".join(str(w) for w in what))


def skip(why):
    print("SKIPPED: " + why)
    sys.exit(SKIP)


def run(*command):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=280)


class Driver:
    def __init__(self, bin_dir, site, scratch):
        self.bin_dir, self.site, self.scratch = bin_dir, site, scratch

    def drive(self, name, *options, site=None):
        done = run(self.bin_dir / "outcrop-drive", site or self.site, "--out", self.scratch / name, *options)
        if done.returncode == 3:
            skip(done.stderr.strip())
        return done

    def driven(self, name, *options):
        """A drive that must succeed: its folder and report."""
        done = self.drive(name, *options)
        check(done.returncode == 0, name, "exit status", done.returncode, done.stdout[-2000:], done.stderr)
        out = self.scratch / name
        return out, json.loads((out / "report.json").read_text())


def check_bytes(out, report):
    """The report against the log, layer by layer."""
    log = wire.bytes_by_layer((out / "link.lcm").read_bytes())
    for key, place in (("messages", 0), ("bytes", 1), ("bytes_ip", 2)):
        for layer, value in report[key].items():
            if layer == "total":
                expected = sum(line[place] for line in log.values())
            else:
                expected = log.get(layer, (0, 0, 0))[place]
            check(value == expected, key, layer, value, "in the report,", expected, "in the log")
        check(set(log) <= set(report[key]), "a layer of the log is not in the report:", set(log) - set(report[key]))


def check_replay(driver, out, name):
    """The same bytes from the log alone: without the area, which the status packets carry, and with another path."""
    again = driver.scratch / (name + "_again")
    done = run(driver.bin_dir / "outcrop-base", "replay", out / "link.lcm", "--out", again, "--as", "none")
    check(done.returncode == 0, "replay:", done.stdout, done.stderr)
    for file in ("model/obstacles.json", "matches.json", "model/points.ply", "overhead.png"):
        check(filecmp.cmp(out / file, again / file, shallow=False), file, "differs between live and replay")
    live, replayed = (json.loads((d / "report.json").read_text()) for d in (out, again))
    check(live["bytes"] == replayed["bytes"], "bytes differ between live and replay")
    check(live["options"].get("area") == replayed["options"].get("area"), "the area differs between live and replay")


def two_obstacles(driver):
    out, report = driver.driven("out")
    done = run(driver.bin_dir / "outcrop-eval", driver.site, out, "--json")
    check(done.returncode == 0, "outcrop-eval:", done.stderr)
    figures = json.loads(done.stdout)
    check(figures["missed"] == 0, "missed", figures["missed"])
    check(figures["false"] <= 1, "false boxes:", figures["false"])
    check(figures["matches"]["precision"] >= 0.9, "matches", figures["matches"])
    for box in figures["boxes"]:
        check(box["iou"] > 0.3, "box", box)
    check(report["counts"]["packets_ill_formed"] == 0, report["counts"])
    check(report["counts"]["requests_given_up"] == 0, report["counts"])
    frames = len(list((out / "sequence" / "boxes").glob("frame_*.png")))
    check(frames == report["sequence"]["frames"] > 0, "frames", frames)
    check_bytes(out, report)
    check_replay(driver, out, "out")


def options(driver):
    out, report = driver.driven("views", "--views", "0,1,2,5", "--as", "none")
    cameras = json.loads((out / "model" / "cameras.json").read_text())
    check([view["index"] for view in cameras["views"]] == [0, 1, 2, 5], "indices", [v["index"] for v in cameras["views"]])
    names = [v["image"] for v in json.loads((driver.site / "cameras.json").read_text())["views"]]
    check([view["image"] for view in cameras["views"]] == [names[i] for i in (0, 1, 2, 5)], "image names")
    pairs = json.loads((out / "matches.json").read_text())["pairs"]
    check({p[side] for p in pairs for side in ("left", "right")} <= {0, 1, 2, 5}, "pairs of other views")
    check(report["counts"]["requests_given_up"] == 0, "asked for views that never were:", report["counts"])

    out, report = driver.driven("mtu", "--mtu", "250", "--views", "0,1,2,3", "--as", "none")
    packets = [len(payload) - 10 for _, _, payload in wire.events((out / "link.lcm").read_bytes())]
    check(max(packets) <= 250, "a packet of", max(packets), "bytes")
    check(report["counts"]["views"] == 4 and report["counts"]["obstacles"] >= 1, report["counts"])
    check_bytes(out, report)

    out, report = driver.driven("rival", "--link", "images:jpeg:80", "--views", "0,1,2,3", "--as", "none")
    check(report["options"]["null_rival"] and report["bytes"]["image"] > 0, report["bytes"])
    check(report["bytes"]["view"] == report["bytes"]["patch"] == 0, report["bytes"])
    check(report["counts"]["obstacles"] >= 1, report["counts"])
    check_bytes(out, report)
    check_replay(driver, out, "rival")

    site_views = json.loads((driver.site / "cameras.json").read_text())["views"]
    for kind in ("3", "3:drift"):
        out, _ = driver.driven("moved", "--perturb", kind, "--views", "0,1", "--as", "none")
        moved = json.loads((out / "vehicle" / "cameras.json").read_text())["views"]
        steps = [abs(a - b) for v, w in zip(moved, site_views) for a, b in zip(v["C"], w["C"])]
        check(0 < max(steps) <= 10.0, "--perturb", kind, "moved cameras by", max(steps), "mm, the margin is 10")


def faults(driver):
    cases = [
        (1, "/nowhere/cameras.json", [], "/nowhere"),
        (2, None, ["--perturb", "x"], "--perturb"), (2, None, ["--perturb", "1:sideways"], "--perturb"),
        (2, None, ["--link", "images:gif:1"], "--link"), (2, None, ["--link", "images:jpeg:0"], "--link"),
        (2, None, ["--link", "carrier:pigeon"], "--link"), (2, None, ["--mtu", "199"], "mtu"),
        (2, None, ["--mtu", "1381"], "mtu"), (2, None, ["--as", "clouds"], "--as"), (2, None, ["--nonsense"], "nonsense"),
        (2, None, ["--views", "0,a"], "views"), (1, None, ["--views", "0,8"], "--views"),
        (1, None, ["--views", "3"], "two views"), (1, None, ["--images", "nowhere"], "nowhere"),
        (2, None, ["--path", "/nowhere.json"], "/nowhere.json"), (1, None, ["--path", "/dev/null"], "/dev/null"),
    ]
    for status, site, arguments, part in cases:
        done = driver.drive("bad", *arguments, site=site)
        check(done.returncode == status, arguments, "exit status", done.returncode, "not", status, done.stderr)
        check(part in done.stderr, arguments, repr(part), "is not in", repr(done.stderr))
        check(done.stderr.count("\n") == 1 or status == 2 or "ended" in done.stderr, arguments, repr(done.stderr))
        check(not (driver.scratch / "bad" / "report.json").exists(), arguments, "left a report")
    # Broken sites: told before anything is sent.
    site = json.loads((driver.site / "cameras.json").read_text())
    for key, value, part in (("R", [[1, 0, 0], [0, 1, 0], [0, 0, 2]], "rotation"), ("width", 641, "641"), ("fx", -1, "focal"),
                             ("image", "images/none.jpg", "none.jpg"), ("t", ["a", 0, 0], "cameras.json")):
        broken = json.loads(json.dumps(site))
        for view in broken["views"]:
            view["image"] = str(driver.site / view["image"])
        broken["views"][1][key] = value
        file = driver.scratch / "cameras.json"
        file.write_text(json.dumps(broken))
        done = driver.drive("bad", site=file)
        check(done.returncode == 1 and part in done.stderr, key, done.returncode, repr(done.stderr))
        check(not (driver.scratch / "bad" / "report.json").exists(), key, "left a report")
    check_refused_namespace(driver)


def check_refused_namespace(driver):
    """Where namespaces are refused: exit status 3 and one line."""
    limit = "echo 0 > /proc/sys/user/max_net_namespaces && exec "
    command = limit + " ".join(map(str, (driver.bin_dir / "outcrop-drive", driver.site, "--out", driver.scratch / "refused")))
    done = run("unshare", "-rn", "sh", "-c", command)
    if "max_net_namespaces" in done.stderr or "unshare: unshare failed" in done.stderr:
        print("note: cannot have namespaces refused here, exit status 3 was not tested")
        return
    check(done.returncode == 3, "exit status", done.returncode, done.stderr)
    check(done.stderr.count("\n") == 1 and "namespace" in done.stderr, repr(done.stderr))
    check(not (driver.scratch / "refused").exists(), "left something behind")


def through(driver):
    if not driver.site.exists():
        skip(f"{driver.site} is not there")
    out, report = driver.driven("out")
    check(report["counts"]["views"] == len(json.loads((driver.site / "cameras.json").read_text())["views"]),
          "views", report["counts"]["views"])
    for file in ("model/obstacles.json", "matches.json", "overhead.png", "link.lcm"):
        check((out / file).stat().st_size > 0, file, "is empty")
    check_bytes(out, report)
    print(f"{driver.site.name}: {report['counts']['obstacles']} obstacles, {report['bytes']['total']} bytes")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("what", choices=("two_obstacles", "options", "faults", "through"))
    parser.add_argument("site", type=pathlib.Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        site = pathlib.Path(os.path.abspath(arguments.site))
        globals()[arguments.what](Driver(arguments.bin, site, pathlib.Path(scratch)))
    print(f"{n_checks} checks of outcrop-drive passed")


if __name__ == "__main__":
    main()
