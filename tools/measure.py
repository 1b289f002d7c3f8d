#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Measures the whole chain on every site there is and writes docs/measurements.md, its .json and its picture.

tools/measure.py [--sites DIR] [--quick] [--only NAME]...     after tools/build.sh or tools/test.sh, on a quiet machine

Every run is outcrop-drive and then outcrop-eval; every figure, verdict and comparing sentence of the document comes out
of those runs. A run that fails stays in the tables with its reason. Takes about fifteen minutes on two cores. With --quick
or --only the document goes to standard output and docs/ is left alone. Standard library only.
Exit: 0 all runs ended well, 1 some failed (the document is written all the same) or nothing could be run.
"""
import argparse
import filecmp
import json
import os
import pathlib
import platform
import re
import struct
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import about_machine  # noqa: E402
import measure_document  # noqa: E402
import measure_plot  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parent.parent
SITES = ["depot", "two_obstacles", "cubes"]
REAL_SITES = ["real_banana", "real_fountain"]  # and any other real_* beside them
VARIANTS = ["light", "noise"]                  # of the depot
RIVALS = ["jpeg:5", "jpeg:10", "jpeg:30", "jpeg:60", "webp:1", "webp:30"]
SEEDS = [1, 2, 3, 4, 5]
SHAPE_POSES = ["1", "1:drift", "1:mount", "1:height"]
REPEATS = 2
TIMEOUT_S = 300
VIEW_LINE = re.compile(r"^outcropd: view (\d+): .*?([\d.]+) ms$", re.MULTILINE)
LOG_SYNC = 0xEDA1DA01


def say(text):
    print(f"measure: {text}", file=sys.stderr, flush=True)


def one_line(text):
    """Standard error as one line of a table: no folders, no notes, the last three lines at most."""
    lines = [line.strip() for line in text.splitlines() if line.strip() and ": note: " not in line]
    joined = "; ".join(lines[-3:]) or "no reason given"
    return re.sub(r"(?<![\w.])/(?:[^\s/:;]+/)+", "", joined).replace("|", "/")


def execute(command):
    """(seconds, standard output, None or the reason of failure)."""
    begin = time.monotonic()
    try:
        ran = subprocess.run([str(part) for part in command], capture_output=True, text=True, timeout=TIMEOUT_S)
    except subprocess.TimeoutExpired:
        return time.monotonic() - begin, "", f"no end after {TIMEOUT_S} s"
    except OSError as fault:
        return time.monotonic() - begin, "", f"{pathlib.Path(command[0]).name}: {fault.strerror}"
    reason = None if ran.returncode == 0 else f"exit {ran.returncode}: {one_line(ran.stderr)}"
    return time.monotonic() - begin, ran.stdout, reason


def rounded(value):
    """Six significant digits are more than any table shows."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [rounded(item) for item in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def log_bytes(log):
    """What an LCM log says crossed the link: payload, channel with its end, 8 bytes of LCM header each."""
    data, at, total = log.read_bytes(), 0, 0
    while at < len(data):
        sync, _, _, n_channel, n_payload = struct.unpack_from(">IQQII", data, at)
        if sync != LOG_SYNC:
            raise ValueError("link.lcm: an event does not begin where the one before it ended")
        total += 8 + n_channel + 1 + n_payload
        at += 28 + n_channel + n_payload
    return total


def is_same_model(left, right):
    pairs = [(left / name, right / name) for name in ("model/obstacles.json", "model/points.ply", "matches.json")]
    return all(a.is_file() and b.is_file() and filecmp.cmp(a, b, shallow=False) for a, b in pairs)


class Runner:
    """Drives sites and keeps one record per run, in the order of the runs."""

    def __init__(self, folder, bin_dir):
        self.folder, self.bin = folder, bin_dir
        self.records = []

    def run(self, name, site, kind, label, options, is_replayed=False):
        out = self.folder / f"{len(self.records):02d}_{name}_{re.sub(r'[^a-z0-9]+', '_', label.lower())}"
        record = {"site": name, "kind": kind, "label": label}
        self.records.append(record)
        say(f"{name}, {label}")
        seconds, stdout, record["failed"] = execute([self.bin / "outcrop-drive", site, "--out", out, *options])
        record["drive_s"] = round(seconds, 2)
        if record["failed"] is None:
            self.take_report(record, out, stdout)
        if record["failed"] is None:
            self.take_judgement(record, site, out)
        if record["failed"] is None and is_replayed:
            self.take_replay(record, out)
        if record["failed"]:
            say(f"{name}, {label}: FAILED: {record['failed']}")
        return out

    def take_report(self, record, out, stdout):
        try:
            report = json.loads((out / "report.json").read_text())
            model = json.loads((out / "model" / "obstacles.json").read_text())
            record["bytes"] = report["bytes"]
            record["bytes_ip"] = report["bytes_ip"]["total"]
            record["messages"] = report["messages"]["total"]
            layers = sum(count for layer, count in report["bytes"].items() if layer != "total")
            record["bytes_add_up"] = report["bytes"]["total"] == layers == log_bytes(out / "link.lcm")
            record["ms"] = rounded(report["ms"])
            record["views"], record["points"] = report["counts"]["views"], report["counts"]["points"]
        except (OSError, KeyError, ValueError, struct.error) as fault:
            record["failed"] = one_line(f"what the run wrote: {fault!r}")
            return
        record["obstacles"], record["suspected"] = len(model["obstacles"]), len(model.get("suspected", []))
        record["vehicle_ms"] = [float(ms) for _, ms in VIEW_LINE.findall(stdout)]

    def take_judgement(self, record, site, out):
        seconds, stdout, record["failed"] = execute([self.bin / "outcrop-eval", site, out, "--json"])
        record["eval_s"] = round(seconds, 2)
        if record["failed"]:
            return
        try:
            judged = json.loads(stdout)
            record["boxes"] = [{"name": box.get("name", str(box["truth"])), "iou": rounded(box["iou"] or 0.0),
                                "yaw_error_deg": rounded(box.get("yaw_error_deg"))} for box in judged["boxes"] or []]
            for key in ("voxels", "hull"):
                record[key] = rounded(judged.get(key))
            for key in ("matches", "missed", "false", "poses", "footprint"):
                record[key] = rounded(judged[key])
            record["sequence"] = rounded(next(iter((judged["sequence"] or {}).values()), None))
        except (KeyError, ValueError) as fault:
            record["failed"] = one_line(f"what outcrop-eval printed: {fault!r}")

    def take_replay(self, record, out):
        again = out / "replayed"
        _, _, record["failed"] = execute(
            [self.bin / "outcrop-base", "replay", out / "link.lcm", "--out", again, "--as", "none"])
        record["replay_same"] = record["failed"] is None and is_same_model(out, again)


def find_site(name, sites):
    for parent in (ROOT / "tests" / "data" / "sites", sites):
        if (parent / name / "cameras.json").is_file():
            return parent / name
    return None


def margins(site):
    root = json.loads((site / "cameras.json").read_text())
    metres = 1e-3 if root["units"] == "mm" else 1.0
    given = root.get("margins")
    return {"position_m": given["position"] * metres, "angle_deg": given["angle_deg"]} if given else None


def measure_truth_site(runner, name, site, is_quick):
    first = runner.run(name, site, "ours", "ours", [], is_replayed=True)
    first_record = runner.records[-1]
    runner.run(name, site, "perturb", "ours, perturb 1", ["--perturb", 1])
    for codec in RIVALS[:2] if is_quick else RIVALS:
        runner.run(name, site, "rival", codec.replace(":", " q"), ["--link", f"images:{codec}"])
    if is_quick:
        return
    for seed in SEEDS[1:]:
        runner.run(name, site, "perturb", f"ours, perturb {seed}", ["--perturb", seed, "--as", "none"])
    for i in range(REPEATS):
        again = runner.run(name, site, "repeat", f"ours, again {i + 1}", ["--as", "none"])
        if not runner.records[-1]["failed"] and not first_record["failed"]:
            runner.records[-1]["same_as_first"] = is_same_model(first, again)


def measure_variants(runner, sites, skipped):
    for variant in VARIANTS:
        places = [place / "depot" for place in (ROOT / "tests" / "data" / "sites", sites)
                  if (place / "depot" / f"images_{variant}").is_dir()]
        if places:
            runner.run("depot", places[0], "variant", f"ours, {variant}", ["--images", f"images_{variant}"])
        else:
            skipped.append(f"depot under {variant}")


def measure(options, folder):
    """All records, and the names of what is not there."""
    runner, skipped = Runner(folder, options.bin), []
    found = sorted(path.parent.name for path in options.sites.glob("real_*/cameras.json"))
    real = sorted(set(REAL_SITES) | set(found))
    names = ["depot", "two_obstacles"] if options.quick and not options.only else SITES + real
    known_margins = {}
    for name in names:
        if options.only and name not in options.only:
            continue
        site = find_site(name, options.sites)
        if site is None:
            skipped.append(name)
            continue
        known_margins[name] = margins(site)
        if name in real:
            runner.run(name, site, "real", "ours", [])
        else:
            measure_truth_site(runner, name, site, options.quick)
            if not options.quick:
                whole = options.sites / name  # tests/data/sites has no variants of some
                measure_shapes(runner, name, whole if (whole / "cameras.json").is_file() else site)
        if name == "depot" and not options.quick:
            measure_variants(runner, options.sites, skipped)
    for name in skipped:
        say(f"SKIPPED: {name}: its files are not here (--sites gives another place)")
    return {"runs": runner.records, "skipped": skipped, "margins": known_margins}


def measure_shapes(runner, site_name, site):
    runner.run(site_name, site, "shape", "exact", ["--as", "voxels"])
    for poses in SHAPE_POSES:
        runner.run(site_name, site, "shape", f"perturb {poses}", ["--as", "voxels", "--perturb", poses])
    for variant in VARIANTS:
        if (site / f"images_{variant}").is_dir():
            runner.run(site_name, site, "shape", variant, ["--as", "voxels", "--images", f"images_{variant}"])


def first_match(pattern, file, default):
    try:
        found = re.search(pattern, pathlib.Path(file).read_text(), re.MULTILINE)
    except OSError:
        found = None
    return found.group(1).strip() if found else default


def machine(bin_dir):
    cache = bin_dir.parent / "CMakeCache.txt"
    compiler = first_match(r"^CMAKE_CXX_COMPILER:\w+=(.*)$", cache, "c++")
    _, version, fault = execute([compiler, "--version"])
    return {
        "cpu": about_machine.cpu(),
        "cores": about_machine.cores(),
        "os": first_match(r'^PRETTY_NAME="?([^"\n]*)', "/etc/os-release", platform.system()),
        "compiler": "unknown compiler" if fault else version.splitlines()[0],
        "build_type": first_match(r"^CMAKE_BUILD_TYPE:\w+=(.*)$", cache, "unknown"),
        "load_before": round(os.getloadavg()[0], 1),
    }


def parse_options():
    parser = argparse.ArgumentParser(description="Measures the chain and writes docs/measurements.md.")
    parser.add_argument("--sites", type=pathlib.Path, default=ROOT.parent / "shared" / "sites", metavar="DIR",
                        help="where sites that tests/data/sites does not hold are")
    parser.add_argument("--quick", action="store_true", help="few runs, for trying; document to standard output")
    parser.add_argument("--only", action="append", default=[], metavar="NAME", help="only this site; may be repeated")
    parser.add_argument("--bin", type=pathlib.Path, default=ROOT / "build" / "bin", metavar="DIR",
                        help="where the programs are; default build/bin")
    parser.add_argument("--keep", type=pathlib.Path, metavar="DIR", help="keep the runs' folders here")
    parser.add_argument("--from", dest="source", type=pathlib.Path, metavar="FILE",
                        help="run nothing: write the document again from this measurements.json")
    options = parser.parse_args()
    missing = [name for name in ("outcrop-drive", "outcrop-eval", "outcrop-base", "outcropd")
               if not (options.bin / name).is_file()]
    if missing and not options.source:
        sys.exit(f"measure: {', '.join(missing)} not in {options.bin}: run tools/build.sh first")
    options.bin, options.sites = options.bin.resolve(), options.sites.resolve()
    return options


def collect(options):
    if options.source:
        return json.loads(options.source.read_text())
    about, begin = machine(options.bin), time.monotonic()
    with tempfile.TemporaryDirectory(prefix="outcrop-measure-") as scratch:
        folder = options.keep or pathlib.Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        result = measure(options, folder.resolve())
    if not result["runs"]:
        sys.exit("measure: no site to run")
    return {"machine": about, "minutes": round((time.monotonic() - begin) / 60, 1), **result}


def json_text(result):
    """One run per line, so that a change of one run is a change of one line."""
    head = {key: value for key, value in result.items() if key != "runs"}
    runs = ",\n".join("  " + json.dumps(run, separators=(",", ":")) for run in result["runs"])
    return json.dumps(head)[:-1] + ', "runs": [\n' + runs + "\n]}\n"


def part(name):
    """What tools/bench.sh, soak.sh or matching.sh measured last, or None."""
    file = ROOT / "docs" / name
    return json.loads(file.read_text()) if file.is_file() else None


def main():
    options = parse_options()
    result = collect(options)
    is_partial = options.quick or options.only
    document = measure_document.text(result, *([] if is_partial else [part("bench.json"), part("soak.json"),
                                                               part("matching.json")]))
    if is_partial:
        print(document)
    else:
        pictures = ROOT / "docs" / "pictures"
        pictures.mkdir(parents=True, exist_ok=True)
        (pictures / "bytes_vs_iou.svg").write_text(measure_plot.svg(result))
        (ROOT / "docs" / "measurements.json").write_text(json_text(result))
        (ROOT / "docs" / "measurements.md").write_text(document)
        say("docs/measurements.md, docs/measurements.json and docs/pictures/bytes_vs_iou.svg written")
    n_failed = sum(1 for run in result["runs"] if run["failed"])
    say(f"{len(result['runs'])} runs, {n_failed} failed, {len(result['skipped'])} skipped, {result['minutes']} min")
    return 1 if n_failed else 0


if __name__ == "__main__":
    sys.exit(main())
