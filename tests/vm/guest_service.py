# SPDX-License-Identifier: BSD-3-Clause
"""The unit as it is installed, under a systemd of its own: ready, confined, watched."""
import json
import os
import pathlib
import shutil
import signal
import time

from guest_kit import (DOWN, POSES, UP, Failed, Poses, UsbCamera, camera_section, expect, run, site_views, wait_for,
                       write_calibration)

UNIT = "outcropd.service"


def show(key):
    return run("systemctl", "show", "--value", "-p", key, UNIT).strip()


def process_state(pid, key):
    for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith(f"{key}:"):
            return line.split(":", 1)[1].strip()
    return ""


class ServiceGroup:
    """$OUTCROP_VM_INSTALLED holds what cmake --install made; here it becomes part of the machine."""

    def __init__(self, build, site, frames):
        self.installed, self.site = pathlib.Path(os.environ["OUTCROP_VM_INSTALLED"]), site
        shutil.copytree(self.installed, "/", symlinks=True, dirs_exist_ok=True)
        run("systemd-sysusers")
        run("udevadm", "control", "--reload")
        self.camera = UsbCamera(build / "tests/bin", frames)
        run("udevadm", "trigger", "--subsystem-match=video4linux")
        run("udevadm", "settle")
        self.poses = Poses(build / "bin", site)
        self.configure()

    def configure(self):
        intrinsics, size, _, _ = site_views(self.site)
        folder = pathlib.Path("/etc/outcrop")
        folder.mkdir(exist_ok=True)
        calibration = write_calibration(folder / "front.yaml", intrinsics, size)
        config = {"vehicle": 1, "link": {"down_url": DOWN, "up_url": UP}, "poses": {"url": POSES},
                  "cameras": [camera_section("front", self.camera.LINK, calibration)],
                  "margins": {"from": "fixed", "position_m": 0.05, "angle_deg": 1.0}}
        (folder / "outcropd.yaml").write_text(json.dumps(config, indent=1) + "\n")

    @staticmethod
    def pid():
        pid = int(show("MainPID"))
        expect(pid > 0, f"the unit has no process; it is {show('ActiveState')}, {show('Result')}")
        return pid

    @staticmethod
    def counters():
        told = run("outcropd", "--status", "--json")
        return json.loads(told)["counters"]

    def start(self):
        """systemctl start returns when the daemon has said that it is ready."""
        run("systemctl", "daemon-reload")
        try:
            run("systemctl", "start", UNIT)
        except Failed:
            raise Failed("it does not start: " + run("journalctl", "--no-pager", "-o", "cat", "-n", "12", "-u", UNIT)) from None
        expect(show("Type") == "notify", f"Type is {show('Type')}")
        expect(show("ActiveState") == "active", f"ActiveState is {show('ActiveState')}")
        self.pid()

    def confined(self):
        pid = self.pid()
        uid = int(process_state(pid, "Uid").split()[0])
        expect(uid != 0, "it runs as root")
        for key, value in (("Seccomp", "2"), ("NoNewPrivs", "1"), ("CapEff", "0" * 16), ("CapBnd", "0" * 16)):
            told = process_state(pid, key)
            expect(told == value, f"{key} is {told}, not {value}")

    def sees_camera(self):
        wait_for(lambda: self.counters()["frames_in"] >= 3, 40, lambda: f"frames: {self.counters()}")

    def unplugged(self):
        """The device's node is made anew, and the confined process may open it again."""
        self.camera.unplug()
        wait_for(lambda: self.counters()["camera_lost"] >= 1, 20, lambda: f"{self.counters()}")
        self.camera.plug_in()
        wait_for(lambda: self.counters()["camera_opened"] >= 2, 20, lambda: f"{self.counters()}")

    def watchdog(self):
        """A process that gives no sign of life is replaced."""
        pid, restarts = self.pid(), int(show("NRestarts"))
        limit_s = int(show("WatchdogUSec").rstrip("s")) if show("WatchdogUSec").endswith("s") else 30
        os.kill(pid, signal.SIGSTOP)
        wait_for(lambda: int(show("NRestarts")) > restarts and show("MainPID") not in ("0", str(pid)), limit_s + 60,
                 lambda: f"a new process; {show('ActiveState')}, {show('Result')}")
        wait_for(lambda: show("ActiveState") == "active", 30, lambda: show("ActiveState"))
        self.sees_camera()

    def ignores_hangup(self):
        pid = self.pid()
        os.kill(pid, signal.SIGHUP)
        time.sleep(1)
        expect(self.pid() == pid and show("ActiveState") == "active", "SIGHUP ended it")

    def stop(self):
        run("systemctl", "stop", UNIT)
        expect(show("Result") == "success", f"Result is {show('Result')}")
        expect(show("ActiveState") == "inactive", f"ActiveState is {show('ActiveState')}")

    def scenarios(self):
        yield "the unit starts and tells so", self.start
        yield "own user, no privileges, system calls filtered", self.confined
        yield "the camera can be read", self.sees_camera
        yield "unplugged and plugged in", self.unplugged
        yield "SIGHUP is ignored", self.ignores_hangup
        yield "the watchdog replaces a process that hangs", self.watchdog
        yield "the unit stops", self.stop
