#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Views that outcropd holds back: held_views.py --bin DIR --site DIR

With pre_event.hold views are announced only; outcrop-base recall and SIGUSR1, which is a mark, set those of the last
seconds free. Both real programs, in a private network namespace.
"""
import argparse
import json
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

from private_network import enter_private_network

DOWN, UP = "udpm://239.255.76.67:7667?ttl=0", "udpm://239.255.76.68:7668?ttl=0"
BASE = f'vehicle: 1\ndown_url: "{DOWN}"\nup_url: "{UP}"\nout: "OUT"\n'


def fail(*what):
    sys.exit("held_views: " + " ".join(str(w) for w in what))


class Vehicle:
    def __init__(self, bin_dir, site, folder):
        self.status_file = folder / "status.json"
        config = folder / "outcropd.yaml"
        config.write_text(f'vehicle: 1\nstatus_file: "{self.status_file}"\nlink:\n  down_url: "{DOWN}"\n'
                          f'  up_url: "{UP}"\nsource:\n  site: "{site.resolve()}"\n  period_ms: 250\n  loop: true\n'
                          "  keyframes: moved\npre_event:\n  hold: true\n  seconds: 2\n")
        self.process = subprocess.Popen([bin_dir / "outcropd", "--config", config], stdout=subprocess.DEVNULL)

    def counters(self):
        return json.loads(self.status_file.read_text())["counters"]

    def await_more(self, name, least, what):
        for _ in range(150):
            if self.status_file.exists() and self.counters()[name] >= least:
                return self.counters()
            if self.process.poll() is not None:
                fail("outcropd ended with", self.process.returncode)
            time.sleep(0.1)
        fail(what, name, "stays at", self.counters()[name], "below", least)


def recall(bin_dir, config, *options):
    done = subprocess.run([bin_dir / "outcrop-base", "recall", "--config", config, *options], capture_output=True, text=True,
                          timeout=60)
    return done.returncode, done.stdout + done.stderr


def check(options, folder, vehicle):
    base = folder / "outcrop-base.yaml"
    base.write_text(BASE.replace("OUT", str(folder / "out")))
    before = vehicle.await_more("frames_in", 8, "at the start")
    if before["recalled"] != 0 or before["views_sent"] != 0:
        fail("views left although they are held:", before)

    code, text = recall(options.bin, base, "--last", "1.0")
    after = vehicle.await_more("recalled", 1, "after a recall")
    if code != 0 or "have come" not in text:
        fail("recall:", code, text)
    if not 1 <= after["recalled"] <= 25:  # five tries of a second each, at four views a second
        fail("a recall of one second set", after["recalled"], "views free")
    code, text = recall(options.bin, base, "--from", "2001-01-01T00:00:00Z", "--to", "2001-01-01T00:01:00Z")
    if code != 1 or "none is stored" not in text or vehicle.counters()["recalled"] != after["recalled"]:
        fail("recall of a time without views:", code, text)

    vehicle.process.send_signal(signal.SIGUSR1)
    marked = vehicle.await_more("marks", 1, "after SIGUSR1")
    marked = vehicle.await_more("recalled", after["recalled"] + 3, "after a mark")
    if marked["recalled"] > after["recalled"] + 10:
        fail("a mark reaching back two seconds set", marked["recalled"] - after["recalled"], "views free")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--site", type=pathlib.Path, required=True)
    options = parser.parse_args()
    enter_private_network("held_views")
    with tempfile.TemporaryDirectory() as folder:
        vehicle = Vehicle(options.bin, options.site, pathlib.Path(folder))
        try:
            check(options, pathlib.Path(folder), vehicle)
            vehicle.process.send_signal(signal.SIGTERM)
            if vehicle.process.wait(10) != 0:
                fail("outcropd ended with", vehicle.process.returncode)
        finally:
            if vehicle.process.poll() is None:
                vehicle.process.kill()
    print("held_views: passed")


main()
