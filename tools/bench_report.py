#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Puts what the bench's programs wrote into docs/: bench.json, pictures/bench_*.svg, its part of measurements.md.

tools/bench_report.py --from DIR                       DIR: accuracy.json, repeatability.json, thesis.json, ...
tools/bench_report.py --from DIR --print               the bench's part to standard output, docs/ is left alone
tools/bench_report.py --matching DIR                   DIR: matching.json, colmap.json; into docs/matching.json
tools/bench_report.py                                  writes pictures and measurements.md again from docs/bench.json
tools/bench_report.py --check                          exit 1 unless docs are what their .json files make

tools/bench.sh runs the programs and then this. Standard library only.
"""
import argparse
import json
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import about_machine  # noqa: E402
import bench_document  # noqa: E402
import bench_plot  # noqa: E402
import measure_document  # noqa: E402

DOCS = pathlib.Path(__file__).resolve().parent.parent / "docs"
PARTS = ["accuracy", "repeatability", "thesis", "chess-stereo"]  # {"seed", "result"}
PLAIN = ["speed", "instructions", "ground_labels", "ground_speed", "ground_table"]


def rounded(value):
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [rounded(item) for item in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def gather(folder):
    bench = {"machine": about_machine.text() + ", one thread"}
    for name in PARTS:
        file = folder / f"{name}.json"
        if file.is_file():
            given = json.loads(file.read_text())
            bench.setdefault("seed", given.get("seed"))
            bench[name] = rounded(given["result"])
    for name in PLAIN:
        file = folder / f"{name}.json"
        if file.is_file():
            bench[name] = rounded(json.loads(file.read_text()))
    if (folder / "rivals.json").is_file():  # Google Benchmark's form, whose context names the machine and the folder
        entries = json.loads((folder / "rivals.json").read_text())["benchmarks"]
        bench["rivals"] = [{"name": e["name"], "ms": rounded(e["cpu_time"])} for e in entries]
    if "seed" not in bench:
        sys.exit(f"bench_report: nothing measured in {folder}")
    return bench


def one_per_line(value, depth=0):
    """JSON with the rows of each table on lines of their own, so that a change of one is a change of one line."""
    if isinstance(value, dict) and depth < 3:
        inner = ",\n".join(json.dumps(key) + ": " + one_per_line(item, depth + 1) for key, item in value.items())
        return "{" + inner + "}"
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return "[\n" + ",\n".join(json.dumps(item, separators=(",", ":")) for item in value) + "\n]"
    return json.dumps(value, separators=(",", ":"))


def stored(name):
    """None when docs/ does not hold it."""
    file = DOCS / name
    return json.loads(file.read_text()) if file.is_file() else None


def gather_matching(folder):
    out = {"machine": about_machine.text(), "matching": rounded(json.loads((folder / "matching.json").read_text()))}
    if (folder / "colmap.json").is_file():
        out["colmap"] = rounded(json.loads((folder / "colmap.json").read_text()))
    return out


def documents(bench):
    """{path under docs: text} of all that follows from the measurements."""
    files = {"pictures/" + name: text for name, text in bench_plot.pictures(bench).items()}
    measured = DOCS / "measurements.json"
    if measured.is_file():
        files["measurements.md"] = measure_document.text(json.loads(measured.read_text()), bench, stored("soak.json"),
                                                         stored("matching.json"))
    return files


def main():
    parser = argparse.ArgumentParser(description="Writes the bench's figures into docs/.")
    parser.add_argument("--from", dest="source", type=pathlib.Path, metavar="DIR", help="what the programs wrote")
    parser.add_argument("--matching", type=pathlib.Path, metavar="DIR", help="what matching.sh's programs wrote")
    parser.add_argument("--print", action="store_true", help="to standard output; docs/ is left alone")
    parser.add_argument("--check", action="store_true", help="compare only; exit 1 when docs are not up to date")
    options = parser.parse_args()
    bench = gather(options.source) if options.source else stored("bench.json")
    if options.matching and not options.check:
        (DOCS / "matching.json").write_text(one_per_line(gather_matching(options.matching)) + "\n")
    if options.print:
        print(bench_document.text(bench))
        return 0
    if options.source and not options.check:
        (DOCS / "bench.json").write_text(one_per_line(bench) + "\n")
    stale = []
    for name, text in documents(bench).items():
        file = DOCS / name
        if options.check:
            stale += [name] if not file.is_file() or file.read_text() != text else []
        else:
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
    for name in stale:
        print(f"docs/{name} is not what the .json files of docs/ make: run tools/bench_report.py")
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
