#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The daemons as programs: usage, configuration files, signals, and a start that fails: programs.py --bin DIR --sites DIR

Every fault must give one line that names the file, and the right exit status: 2 wrong usage, 1 failed.
"""
import argparse
import json
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

VEHICLE = {"vehicle": "3", "link": {"down_url": '"udpm://239.255.76.67:7667?ttl=0"',
                                    "up_url": '"udpm://239.255.76.68:7668?ttl=0"'}, "source": {"site": None}}
BASE = {"down_url": '"udpm://239.255.76.67:7667?ttl=0"', "up_url": '"udpm://239.255.76.68:7668?ttl=0"', "out": None}

n_checks = 0


def check(condition, *what):
    global n_checks
    n_checks += 1
    if not condition:
        sys.exit("programs: " + " ".join(str(w) for w in what))


def yaml(keys, indent=""):
    text = ""
    for key, value in keys.items():
        text += f"{indent}{key}:" + (f"\n{yaml(value, indent + '  ')}" if isinstance(value, dict) else f" {value}\n")
    return text


def changed(keys, change):
    """keys with "a.b" -> text put in; text None takes the key out."""
    out = json.loads(json.dumps(keys))
    for place, text in change.items():
        *outer, last = place.split(".")
        inner = out
        for name in outer:
            inner = inner.setdefault(name, {})
        if text is None:
            inner.pop(last)
        else:
            inner[last] = text
    return out


def run(command, timeout=20):
    done = subprocess.run(command, capture_output=True, text=True, timeout=timeout)
    return done.returncode, done.stdout, done.stderr


def one_line(name, command, status, *parts):
    code, _, err = run(command)
    check(code == status, name, "exit status", code, "not", status, err)
    check(err.count("\n") == 1 and len(err) < 600, name, "not one line:", repr(err))
    for part in parts:
        check(part in err, name, repr(part), "is not in", repr(err))


def expect_lines(name, command, lead, *places):
    """One line for each place, in that order, and status 1."""
    code, _, err = run(command)
    lines = err.splitlines()
    check(code == 1, name, "exit status", code, err)
    check(len(lines) == len(places), name, "tells", len(lines), "faults:", err)
    for line, place in zip(lines, places):
        check(line.startswith(lead[:-1] + place), name, repr(place), "is not told by", repr(line))


class Setup:
    def __init__(self, bin_dir, site, scratch):
        self.outcropd, self.base = str(bin_dir / "outcropd"), str(bin_dir / "outcrop-base")
        self.scratch = scratch
        self.vehicle_keys = changed(VEHICLE, {"source.site": f'"{site}"'})
        self.base_keys = changed(BASE, {"out": f'"{scratch}/out"'})

    def file(self, text):
        path = self.scratch / "config.yaml"
        path.write_text(text)
        return str(path)

    def scratch_config(self):
        return str(self.scratch / "config.yaml")

    def vehicle(self, change):
        return [self.outcropd, "--check", "--config", self.file(yaml(changed(self.vehicle_keys, change)))]

    def live(self, change):
        return [self.base, "live", "--check", "--config", self.file(yaml(changed(self.base_keys, change)))]


def check_usage(s):
    for command in ([s.outcropd], [s.outcropd, "--nonsense"], [s.outcropd, "--config"], [s.outcropd, "--config", "a", "b"],
                    [s.base], [s.base, "live"], [s.base, "replay"], [s.base, "replay", "a"], [s.base, "fly"],
                    [s.base, "replay", "a", "--out", "b", "--as", "clouds"],
                    [s.base, "replay", "a", "--out", "b", "--vehicle", "256"],
                    [s.base, "replay", "a", "--out", "b", "--area", "1,2"]):
        code, _, err = run(command)
        check(code == 2, command, "exit status", code)
        check(err.strip(), command, "says nothing")
    for program in (s.outcropd, s.base):
        for option in ("--help", "--version"):
            code, out, err = run([program, option])
            check(code == 0 and out and not err, program, option)


def check_vehicle_config(s):
    code, out, err = run(s.vehicle({}))
    check(code == 0 and not err and out.startswith("outcropd: 8 frames of at most 640x480"), out, err)
    faults = [
        ({"vehicle": "256"}, ":1: vehicle: 256 is not within 0..255"),
        ({"vehicle": "-1"}, ":1: vehicle: -1 is not within 0..255"),
        ({"vehicle": "one"}, ':1: vehicle: "one" is not a whole number'), ({"vehicle": "[1]"}, ":1: vehicle: must be one value"),
        ({"colour": "red"}, ":7: colour: is no key here"), ({"link.bogus": "1"}, ":5: link.bogus: is no key here"),
        ({"link.qualty": "1"}, "link.qualty: is no key here: did you mean quality?"),
        ({"link.up_url": None}, ":2: link.up_url: is missing"), ({"link": None}, ":1: link: is missing"),
        ({"source": None}, ":1: source: is missing, and so is cameras"), ({"source.site": '""'}, ":6: source.site: is empty"),
        ({"stored_views": "1"}, ":7: stored_views: 1 is not within 2..256"),
        ({"link.datagram_bytes": "199"}, ":5: link.datagram_bytes: 199 is not within 200..1380"),
        ({"link.datagram_bytes": "1381"}, "link.datagram_bytes: 1381 is"), ({"link.rate_kbit_s": "0"}, "link.rate_kbit_s: 0 is"),
        ({"link.quality": "101"}, "link.quality: 101 is"), ({"link.send": "smoke"}, 'link.send: "smoke" is not one of'),
        ({"link.codec": "gif"}, 'link.codec: "gif" is not one of'), ({"source.period_ms": "3600001"}, "source.period_ms: 3600001 is"),
        ({"margins": {"position_m": "-0.1"}}, ":8: margins.position_m: -0.1 is"),
        ({"margins": {"angle_deg": "46"}}, ":8: margins.angle_deg: 46 is"),
        ({"margins": {"position_m": ".nan"}}, 'margins.position_m: ".nan" is not finite'),
        ({"margins": {"position_m": "nan"}}, 'margins.position_m: "nan" is not finite'),
        ({"margins": {"angle_deg": "wide"}}, 'margins.angle_deg: "wide" is not a number'),
        ({"junctions": {"sigma_px": "0.1"}}, ":8: junctions.sigma_px: 0.1 is"),
        ({"junctions": {"lambda_px": "5"}}, "junctions.lambda_px: 5 is"), ({"junctions": {"max_sent": "0"}}, "junctions.max_sent: 0 is"),
        ({"junctions": {"max_corners": "1025"}}, "junctions.max_corners: 1025 is"),
        ({"junctions": {"method": "worst"}}, 'junctions.method: "worst" is'), ({"junctions": {"t_b": "inf"}}, 'junctions.t_b: "inf" is'),
    ]
    for change, *parts in faults:
        one_line(f"outcropd with {change}", s.vehicle(change), 1, f"outcropd: {s.scratch}/config.yaml:", *parts)
    expect_lines("outcropd with many faults", s.vehicle({"vehicle": "one", "link.up_url": "up", "link.send": "smoke",
                                                         "source.sight": "x", "junctions": {"t_b": "0.1"}}),
                 "outcropd: " + s.scratch_config() + ":", ":1: vehicle: ", ":4: link.up_url: ", ":5: link.send: ",
                 ":8: source.sight: ", ":10: junctions.t_b: ")
    one_line("no site", s.vehicle({"source.site": '"/nowhere/at/all"'}), 1, "outcropd: /nowhere/at/all")


def check_base_config(s):
    code, _, err = run(s.live({}))
    check(code == 0 and not err, err)
    faults = [
        ({"vehicle": "256"}, ":4: vehicle: 256 is not within 0..255"), ({"patch_quality": "32"}, ":4: patch_quality: 32 is"),
        ({"patch_quality": "0"}, "patch_quality: 0 is"), ({"datagram_bytes": "100"}, "datagram_bytes: 100 is not within"),
        ({"as": "clouds"}, ':4: as: "clouds" is'), ({"method": "worst"}, 'method: "worst" is'), ({"out": None}, ":1: out: is missing"),
        ({"area": "[0, 1, 0, 1]"}, ":4: area: has 4 items, not 5"), ({"area": "[0, 1, 0, 1, 0]"}, ":4: area: must be"),
        ({"area": "[1, 0, 0, 1, 1]"}, "area: must be"), ({"area": "[nan, 1, 0, 1, 1]"}, ':4: area[0]: "nan" is not finite'),
        ({"area": "[0, 1e9, 0, 1, 1]"}, ":4: area[1]: 1e9 is not within"),
        ({"exit_when_settled": "perhaps"}, 'exit_when_settled: "perhaps" is not one of false, true'),
        ({"bogus": "1"}, ":4: bogus: is no key here"), ({"up_url": "[]"}, ":2: up_url: must be one value"),
    ]
    for change, *parts in faults:
        one_line(f"outcrop-base with {change}", s.live(change), 1, f"outcrop-base: {s.scratch}/config.yaml:", *parts)
    expect_lines("outcrop-base with many faults", s.live({"out": None, "up_url": "up", "as": "clouds", "bogus": "1"}),
                 "outcrop-base: " + s.scratch_config() + ":", ":1: out: is missing", ":2: up_url: ", ":3: as: ", ":4: bogus: ")
    one_line("no path file", s.live({"path": '"/nowhere.json"'}), 1, "/nowhere.json")


def check_samples(s, root):
    """--print-config prints a file that the program takes, from the project's root."""
    for program, kept in ([s.outcropd], "outcropd.yaml"), ([s.base, "live"], "outcrop-base.yaml"):
        code, out, err = run(program + ["--print-config"])
        check(code == 0 and not err and out == (root / "docs" / kept).read_text(), program, err)
        done = subprocess.run(program + ["--check", "--config", s.file(out)], cwd=root, capture_output=True, text=True)
        check(done.returncode == 0 and not done.stderr, program, done.stderr)


def check_files_that_are_no_yaml(s):
    for text in ("", "# nothing\n", "- a\n", "a: [\n", "\x00\x01", "a: b: c\n", "\xff" * 100):
        config = s.file(text)
        one_line(repr(text), [s.outcropd, "--check", "--config", config], 1, "outcropd: " + config + ":")
        one_line(repr(text), [s.base, "live", "--check", "--config", config], 1, "outcrop-base: " + config + ":")
    for place in ("/nowhere/a.yaml", str(s.scratch)):
        one_line(place, [s.outcropd, "--check", "--config", place], 1, place)
        one_line(place, [s.base, "live", "--check", "--config", place], 1, place)


def check_replay_faults(s):
    out = s.scratch / "replayed"
    (s.scratch / "empty.lcm").write_bytes(b"")
    (s.scratch / "noise.lcm").write_bytes(bytes(range(256)) * 40)
    for log in ("none.lcm", "empty.lcm", "noise.lcm"):
        one_line(log, [s.base, "replay", str(s.scratch / log), "--out", str(out)], 1, f"outcrop-base: {s.scratch}/{log}: ")
        check(not out.exists(), log, "left something behind")


def have_namespaces():
    return shutil.which("unshare") and run(["unshare", "-rn", "true"])[0] == 0


def check_no_route(s):
    config = s.file(yaml(s.vehicle_keys))
    one_line("outcropd without a route", ["unshare", "-rn", s.outcropd, "--config", config], 1, "multicast route")
    config = s.file(yaml(s.base_keys))
    one_line("outcrop-base without a route", ["unshare", "-rn", s.base, "live", "--config", config], 1, "multicast route")
    check(not (s.scratch / "out").exists(), "a failed start left a folder behind")


def check_signals(s):
    """SIGHUP is told once, SIGTERM ends both well; a base that heard nothing says so."""
    lo = "ip link set lo up && ip route add 239.0.0.0/8 dev lo && exec "
    config = s.file(yaml(s.vehicle_keys))
    daemon = subprocess.Popen(["unshare", "-rn", "sh", "-c", lo + f"{s.outcropd} --config {config}"],
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    check("frames" in daemon.stdout.readline(), "outcropd did not start")
    time.sleep(0.5)
    for number in (signal.SIGHUP, signal.SIGHUP, signal.SIGTERM):
        daemon.send_signal(number)
        time.sleep(0.2)
    _, err = daemon.communicate(timeout=20)
    check(daemon.returncode == 0, "outcropd's exit status on SIGTERM:", daemon.returncode, err)
    check(err.count("SIGHUP") == 1, "SIGHUP told", err.count("SIGHUP"), "times")

    config = s.file(yaml(s.base_keys))
    base = subprocess.Popen(["unshare", "-rn", "sh", "-c", lo + f"{s.base} live --config {config}"],
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    check("ready" in base.stdout.readline(), "outcrop-base did not start")
    base.send_signal(signal.SIGTERM)
    out, err = base.communicate(timeout=20)
    check(base.returncode == 0 and not err and "nothing written" in out, out, err)
    check(not (s.scratch / "out" / "report.json").exists(), "a report of nothing")


def check_base_leaves_with_what_it_has(s):
    """SIGTERM in the middle of a drive: the model of what came is written."""
    lo = "ip link set lo up && ip route add 239.0.0.0/8 dev lo && "
    base, vehicle = s.scratch / "base.yaml", s.scratch / "vehicle.yaml"
    base.write_text(yaml(changed(s.base_keys, {"as": "none"})))
    vehicle.write_text(yaml(changed(s.vehicle_keys, {"source.period_ms": "60000"})))  # one view, then a long wait
    process = subprocess.Popen(["unshare", "-rn", "--kill-child", "sh", "-c", lo + f"""
        {s.base} live --config {base} & base=$!; {s.outcropd} --config {vehicle} >{s.scratch}/told & vehicle=$!
        until grep -q "view 0" {s.scratch}/told; do sleep 0.1; done; sleep 3; kill $base; wait $base; code=$?; kill $vehicle; exit $code"""],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    out, err = process.communicate(timeout=60)
    check(process.returncode == 0, out, err)
    check("writing what there is" in out, out)
    report = json.loads((s.scratch / "out" / "report.json").read_text())
    check(report["counts"]["views"] == 1, report["counts"])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--sites", type=pathlib.Path, required=True)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        setup = Setup(options.bin, options.sites / "two_obstacles", pathlib.Path(scratch))
        check_usage(setup)
        check_vehicle_config(setup)
        check_base_config(setup)
        check_samples(setup, options.sites.resolve().parent.parent.parent)
        check_files_that_are_no_yaml(setup)
        check_replay_faults(setup)
        if have_namespaces():
            check_no_route(setup)
            check_signals(setup)
            check_base_leaves_with_what_it_has(setup)
        else:
            print("SKIPPED: network namespaces are refused here: signals and missing routes were not tested")
    print(f"{n_checks} checks of the daemons as programs passed")


if __name__ == "__main__":
    main()
