# SPDX-License-Identifier: BSD-3-Clause
"""What the scenarios in the virtual machine work with: outcropd, cameras, poses, packets and GPIO lines."""
import contextlib
import json
import os
import pathlib
import signal
import subprocess
import time

SCRATCH = pathlib.Path("/tmp/scenario")
DOWN = "udpm://239.255.76.67:7667?ttl=0"
UP = "udpm://239.255.76.68:7668?ttl=0"
POSES = "udpm://239.255.76.70:7670?ttl=0"


class Failed(Exception):
    """A scenario's reason in one line."""


def expect(condition, text):
    if not condition:
        raise Failed(text)


def wait_for(condition, seconds, text):
    """The condition's first true value; Failed when the time is over."""
    end = time.monotonic() + seconds
    while True:
        value = condition()
        if value:
            return value
        told = text() if callable(text) else text
        expect(time.monotonic() < end, f"not within {seconds} s: {told}")
        time.sleep(0.05)


def run(*command):
    """Standard output of a command that must succeed."""
    done = subprocess.run(command, capture_output=True, text=True)
    expect(done.returncode == 0, f"{' '.join(command)}: status {done.returncode}: {(done.stdout + done.stderr)[-300:]!r}")
    return done.stdout


class Program:
    """A process whose output goes to a file; ended with the scenario."""

    def __init__(self, *command, name, takes_input=False):
        self.name, self.log = name, SCRATCH / f"{name}.log"
        with open(self.log, "wb") as log:
            self.process = subprocess.Popen(command, stdin=subprocess.PIPE if takes_input else subprocess.DEVNULL,
                                            stdout=log, stderr=subprocess.STDOUT)

    def lines(self):
        return self.log.read_text(errors="replace").splitlines()

    def say(self, line):
        self.process.stdin.write(f"{line}\n".encode())
        self.process.stdin.flush()

    def wait_line(self, start, seconds=20):
        wait_for(lambda: any(line.startswith(start) for line in self.lines()), seconds,
                 lambda: f'{self.name} says "{start}"; its last lines: {self.lines()[-3:]}')

    def stop(self, seconds=30):
        """Exit status after SIGTERM; a process that does not end is a failure."""
        self.process.send_signal(signal.SIGTERM)
        try:
            return self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise Failed(f"{self.name} does not end on SIGTERM") from None

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()


# ---- outcropd


def camera_section(name, device, calibration, **keys):
    mount = dict.fromkeys(("x_m", "y_m", "z_m", "roll_deg", "pitch_deg", "yaw_deg"), 0)
    return {"name": name, "device": str(device), "calibration": str(calibration), "mount": mount, "rate_hz": 5,
            "stall_ms": 3000, "retry_ms": 300, **keys}


def write_calibration(path, intrinsics, size):
    """ROS camera_info of a camera without distortion."""
    fx, fy, cx, cy = intrinsics
    path.write_text(f"""image_width: {size[0]}
image_height: {size[1]}
camera_name: test
camera_matrix:
  rows: 3
  cols: 3
  data: [{fx}, 0, {cx}, 0, {fy}, {cy}, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0, 0, 0, 0, 0]
""")
    return path


class Outcropd(Program):
    """The daemon under test. Counters and cameras are read from its status file, as --status does."""

    def __init__(self, program, cameras, **sections):
        self.status_file = SCRATCH / "outcropd.json"
        self.status_file.unlink(missing_ok=True)
        config = {"vehicle": 1, "status_file": str(self.status_file), "link": {"down_url": DOWN, "up_url": UP},
                  "cameras": cameras, "poses": {"url": POSES, "wait_ms": 1000, "max_gap_ms": 1000},
                  "margins": {"from": "fixed", "position_m": 0.05, "angle_deg": 1.0}, **sections}
        path = SCRATCH / "outcropd.yaml"
        path.write_text(json.dumps(config, indent=1) + "\n")  # JSON is YAML
        super().__init__(str(program), "--config", str(path), name="outcropd")
        wait_for(self.is_up, 30, lambda: f"outcropd writes its status; its last lines: {self.lines()[-3:]}")

    def is_up(self):
        expect(self.process.poll() is None, f"outcropd ended with {self.process.poll()}: {self.lines()[-3:]}")
        return self.status_file.exists()

    def status(self):
        expect(self.process.poll() is None, f"outcropd ended with {self.process.poll()}: {self.lines()[-3:]}")
        return json.loads(self.status_file.read_text())

    def counters(self):
        return self.status()["counters"]

    def camera(self, name):
        return next(camera for camera in self.status()["cameras"] if camera["name"] == name)

    def wait_counters(self, seconds=30, **least):
        """Until each counter has at least that value."""
        def reached():
            counters = self.counters()
            return all(counters[name] >= value for name, value in least.items())

        def told():
            counters = self.counters()
            got = {name: value for name, value in counters.items() if value or name in least}
            return f"counters {least}; there are {got}; last lines {self.lines()[-2:]}"
        wait_for(reached, seconds, told)

    def wait_more(self, seconds=30, **more):
        """Until each counter has grown by at least that much from now."""
        before = self.counters()
        self.wait_counters(seconds, **{name: before[name] + n for name, n in more.items()})

    def wait_frames(self, n=3, seconds=30):
        """Until n more frames have come to the end of the way: to the vehicle, or passed over by the keyframe policy."""
        self.wait_more(seconds, frames_in=n)

    def end(self):
        status = self.stop()
        expect(status == 0, f"outcropd ended with {status} on SIGTERM: {self.lines()[-3:]}")


# ---- packets and poses


class Tap(Program):
    """Packets as they leave."""

    def __init__(self, programs):
        super().__init__(str(programs / "vm_packet_tap"), DOWN, name="tap")
        self.wait_line("ready")

    def views(self):
        """{view: {camera, junctions, parts, whole, utime, centre}} of what has come so far."""
        views = {}
        for words in map(str.split, self.lines()):
            expect(words[0] != "bad", "a packet left that is none")
            if words[0] != "view" or len(words) != 16:
                continue
            view = views.setdefault(int(words[1]), {"junctions": 0, "parts": set(), "n_parts": None})
            part = int(words[5])
            if part not in view["parts"]:
                view["junctions"] += int(words[9])
            view["parts"].add(part)
            if words[7] == "1":
                view["n_parts"] = part + 1
            view.update(camera=int(words[3]), utime=int(words[11]), centre=tuple(map(float, words[13:])))
        for view in views.values():
            view["whole"] = view["n_parts"] == len(view["parts"])
        return views

    def whole_views(self):
        return {view: told for view, told in self.views().items() if told["whole"]}

    def wait_views(self, n, seconds=40):
        """The first n whole views, by number."""
        return wait_for(lambda: len(views := self.whole_views()) >= n and views, seconds,
                        lambda: f"{n} whole views; there are {len(self.whole_views())}")


class Poses(Program):
    """Poses of one view of a site, again and again."""

    def __init__(self, bin_folder, site, view=0):
        super().__init__(str(bin_folder / "outcrop-pose-replay"), str(site), "--lcm-url", POSES, "--rate", "20", "--hold", str(view),
                         name="poses", takes_input=True)

    def hold(self, view):
        self.say(view)


def site_views(site):
    """Intrinsics, picture size, picture files and centres (m) of a site whose views share one camera."""
    told = json.loads((site / "cameras.json").read_text())
    views = told["views"]
    first = views[0]
    scale = 0.001 if told["units"] == "mm" else 1.0
    intrinsics = tuple(first[key] for key in ("fx", "fy", "cx", "cy"))
    pictures = [site / view["image"] for view in views]
    centres = [tuple(scale * x for x in view["C"]) for view in views]
    return intrinsics, (first["width"], first["height"]), pictures, centres


# ---- cameras


class UsbCamera(Program):
    """The test's USB camera on dummy_hcd, seen through the kernel's uvcvideo."""
    LINK = pathlib.Path("/dev/v4l/by-id/usb-Outcrop_Test_camera_0001-video-index0")

    def __init__(self, programs, frames):
        gadget = pathlib.Path("/dev/gadget")
        if not gadget.exists():
            gadget.mkdir()
            run("mount", "-t", "gadgetfs", "none", str(gadget))
        super().__init__(str(programs / "vm_uvc_camera"), str(frames), name="usb_camera", takes_input=True)
        wait_for(self.LINK.exists, 30, f"{self.LINK} appears")
        port, = pathlib.Path("/sys/bus/usb/devices").glob("usb*/*-0:1.0/usb*-port1")
        self.disable = port / "disable"

    def tell(self, command):
        n = sum(line in ("ok", "what?") for line in self.lines())
        self.say(command)

        def answers():
            return [line for line in self.lines() if line in ("ok", "what?")][n:]
        expect(wait_for(answers, 10, f'the camera obeys "{command}"')[0] == "ok", f'the camera refuses "{command}"')

    @contextlib.contextmanager
    def with_fault(self, fault):
        self.tell(f"{fault} on")
        try:
            yield
        finally:
            self.tell(f"{fault} off")

    def unplug(self):
        self.disable.write_text("1")
        wait_for(lambda: not self.LINK.exists(), 10, f"{self.LINK} vanishes")

    def plug_in(self):
        self.disable.write_text("0")
        wait_for(self.LINK.exists, 20, f"{self.LINK} comes back")


class Vivid:
    """The kernel's virtual video driver; one link per instance that follows its node."""
    DRIVER = pathlib.Path("/sys/bus/platform/drivers/vivid")

    def __init__(self, n):
        self.links = [pathlib.Path(f"/dev/v4l/by-id/vivid-{k}") for k in range(n)]
        self.links[0].parent.mkdir(parents=True, exist_ok=True)
        self.set_up()

    def set_up(self):
        """Links to the nodes of now, a still picture with corners, times of the start of a frame: those of its end are
        9/10 of a period ahead when it is handed out."""
        for k, link in enumerate(self.links):
            named = [entry.parent.name for entry in pathlib.Path("/sys/class/video4linux").glob("video*/name")
                     if entry.read_text().strip() == f"vivid-{k:03d}-vid-cap"]
            expect(len(named) == 1, f"vivid instance {k} has the nodes {named}")
            beside = link.with_suffix(".new")
            beside.symlink_to(f"/dev/{named[0]}")
            beside.rename(link)
            self.control(k, osd_text_mode=2, test_pattern=PATTERN, timestamp_source=TIME_OF_START)

    def control(self, k, **values):
        told = ",".join(f"{name}={value}" for name, value in values.items())
        run("v4l2-ctl", "-d", str(self.links[k]), "-c", told)

    def unbind(self):
        (self.DRIVER / "unbind").write_text("vivid.0")
        for link in self.links:
            link.unlink()

    def bind(self):
        (self.DRIVER / "bind").write_text("vivid.0")
        self.set_up()


PATTERN = 4  # of vivid: "100% Color Squares"
TIME_OF_END, TIME_OF_START = 0, 1


# ---- GPIO


class GpioChip:
    """A chip of gpio-sim with named lines: {name: offset}."""

    def __init__(self, name, lines):
        self.lines = lines
        self.config = pathlib.Path("/sys/kernel/config/gpio-sim") / name
        bank = self.config / "bank0"
        bank.mkdir(parents=True)
        (bank / "num_lines").write_text(str(max(lines.values()) + 1))
        (bank / "label").write_text(name)
        for line, offset in lines.items():
            (bank / f"line{offset}").mkdir()
            (bank / f"line{offset}" / "name").write_text(line)
        (self.config / "live").write_text("1")
        device = (self.config / "dev_name").read_text().strip()
        self.name = (bank / "chip_name").read_text().strip()
        self.sysfs = pathlib.Path("/sys/devices/platform") / device / self.name

    def value(self, line):
        """What an output drives, or an input sees."""
        return int((self.sysfs / f"sim_gpio{self.lines[line]}" / "value").read_text())

    def pull(self, line, is_up):
        (self.sysfs / f"sim_gpio{self.lines[line]}" / "pull").write_text("pull-up" if is_up else "pull-down")

    def pulse(self, line, seconds=0.02):
        self.pull(line, True)
        time.sleep(seconds)
        self.pull(line, False)
        time.sleep(seconds)

    def count_rises(self, line, seconds):
        """Rises of an output within a time, by looking often."""
        with open(self.sysfs / f"sim_gpio{self.lines[line]}" / "value", "rb", buffering=0) as file:
            last, n, end = 1, 0, time.monotonic() + seconds
            while time.monotonic() < end:
                now = os.pread(file.fileno(), 1, 0) == b"1"
                n += now and not last
                last = now
                time.sleep(0.001)
        return n
