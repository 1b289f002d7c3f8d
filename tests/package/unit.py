#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The systemd unit is sound and shut in, and its user, groups and rules are what it counts on: unit.py --source DIR --bin DIR

The checks are held against weakened and broken copies of the unit, which have to fail.
"""
import argparse
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

MOST_EXPOSURE = 20  # tenths
# Keys that shut nothing in, so that the unit without them is as exposed.
OPEN_KEYS = {"Description", "Documentation", "Wants", "After", "StartLimitIntervalSec", "StartLimitBurst", "Type",
             "NotifyAccess", "ExecStart", "WatchdogSec", "TimeoutStartSec", "TimeoutStopSec", "Restart", "RestartSec",
             "RestartPreventExitStatus", "SupplementaryGroups", "ConfigurationDirectory", "RuntimeDirectory",
             "RuntimeDirectoryMode", "UMask", "StateDirectory", "StateDirectoryMode", "WorkingDirectory", "Group",
             "WantedBy", "SystemCallErrorNumber", "IPAddressAllow", "DeviceAllow"}
# Relaxations the daemon needs: nobody tightens them for a better figure.
NEEDED = ["Type=notify", "NotifyAccess=main", "WatchdogSec=10", "Restart=on-failure", "User=outcrop",
          "SupplementaryGroups=video gpio", "RuntimeDirectory=outcrop", "ConfigurationDirectory=outcrop",
          "DeviceAllow=char-video4linux rw", "DeviceAllow=char-gpiochip rw", "RestrictAddressFamilies=AF_INET AF_UNIX"]
FORBIDDEN = ["PrivateDevices=yes", "PrivateNetwork=yes"]

n_checks = 0


def check(condition, *what):
    global n_checks
    n_checks += 1
    if not condition:
        sys.exit("unit: " + " ".join(str(w) for w in what))


def run(*command):
    return subprocess.run(command, capture_output=True, text=True)


class Analyst:
    def __init__(self, folder):
        self.unit = folder / "outcropd.service"

    def exposure(self, text):
        """(tenths, within the bound) as systemd sees it."""
        self.unit.write_text(text)
        done = run("systemd-analyze", "security", "--offline=true", f"--threshold={MOST_EXPOSURE}", self.unit)
        found = re.search(r"Overall exposure level for outcropd\.service: (\d+)\.(\d)", done.stdout)
        check(found, "no verdict", done.stdout[-500:], done.stderr)
        return int(found[1]) * 10 + int(found[2]), done.returncode == 0

    def complaints(self, text):
        self.unit.write_text(text)
        done = run("systemd-analyze", "verify", "--man=no", self.unit)
        return done.stdout + done.stderr + ("" if done.returncode == 0 else f"exit status {done.returncode}")


def without(text, key):
    return "\n".join(line for line in text.splitlines() if not line.startswith(key + "=")) + "\n"


def keys(text):
    return [line.split("=", 1)[0] for line in text.splitlines() if re.match(r"[A-Z]\w*=", line)]


def check_exposure(analyst, text):
    exposure, is_within = analyst.exposure(text)
    print(f"exposure {exposure / 10}")
    check(is_within and exposure <= MOST_EXPOSURE, "too exposed:", exposure / 10)
    for key in sorted(set(keys(text)) - OPEN_KEYS):
        weaker, _ = analyst.exposure(without(text, key))
        check(weaker >= exposure, "less exposed without", key)
    weak = text
    for key in ("CapabilityBoundingSet", "SystemCallFilter", "ProtectSystem"):
        weak = without(weak, key)
    exposure, is_within = analyst.exposure(weak)
    check(not is_within and exposure > MOST_EXPOSURE, "a weakened unit passes:", exposure / 10)
    exposure, is_within = analyst.exposure(without(text, "User") + "[Service]\nCapabilityBoundingSet=~\n")
    check(not is_within, "a unit of root's with every right passes:", exposure / 10)


def check_verified(analyst, text):
    said = analyst.complaints(text)
    check(said == "", "verify says:", said)
    for name, broken in (("a key misspelt", text.replace("ProtectHome=", "ProtectHomes=")),
                         ("a value misspelt", text.replace("Type=notify", "Type=notifies")),
                         ("no program", text.replace("/outcropd --config", "/outcropd-none --config"))):
        check(analyst.complaints(broken) != "", "verify lets pass:", name)


def check_words(text):
    lines = text.splitlines()
    for line in NEEDED:
        check(line in lines, "missing:", line)
    for line in FORBIDDEN:
        check(line not in lines, "cuts the daemon off:", line)
    check(not re.search(r"@\w+@", text), "a place holder is left")


def check_users(source, folder):
    """In a root of its own: made once, unchanged the second time."""
    root = folder / "root"
    (root / "usr/lib/sysusers.d").mkdir(parents=True)
    (root / "etc").mkdir()
    shutil.copy(source / "daemon/service/outcrop.sysusers", root / "usr/lib/sysusers.d/outcrop.conf")
    before = None
    for _ in range(2):
        done = run("systemd-sysusers", f"--root={root}", "outcrop.conf")
        check(done.returncode == 0, "systemd-sysusers:", done.stderr)
        files = {name: (root / "etc" / name).read_text() for name in ("passwd", "group")}
        check(before in (None, files), "systemd-sysusers made more the second time")
        before = files
    user = re.search(r"^outcrop:x:(\d+):\d+:[^:]*:/var/lib/outcrop:/usr/sbin/nologin$", files["passwd"], re.M)
    check(user and 0 < int(user[1]) < 1000, "no system user:", files["passwd"])
    for group in ("video", "gpio"):
        check(re.search(rf"^{group}:x:\d+:outcrop$", files["group"], re.M), "not a member of", group, files["group"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--source", type=pathlib.Path, required=True)
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    options = parser.parse_args()
    for program in ("systemd-analyze", "systemd-sysusers"):
        if not shutil.which(program):
            print(f"unit: SKIPPED: {program} is not installed")
            sys.exit(77)
    text = (options.source / "daemon/service/outcropd.service.in").read_text()
    text = text.replace("@bindir@", str(options.bin.resolve())).replace("@config_folder@", "/etc/outcrop")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        check_words(text)
        check_exposure(Analyst(folder), text)
        check_verified(Analyst(folder), text)
        check_users(options.source, folder)
    print(f"unit: {n_checks} checks")


if __name__ == "__main__":
    main()
