#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs in the virtual machine: one group of scenarios, a line PASS or FAIL for each.

guest_scenarios.py GROUP BUILD SITE FRAMES    FRAMES: K.yuyv and K.jpg of the site's views
"""
import pathlib
import shutil
import sys
import time
import traceback

from guest_kit import (SCRATCH, TIME_OF_END, TIME_OF_START, Failed, GpioChip, Outcropd, Poses, Tap, UsbCamera, Vivid,
                       camera_section, expect, site_views, wait_for, write_calibration)
from guest_service import ServiceGroup


class Group:
    """What the scenarios of a boot share."""

    def __init__(self, build, site, frames):
        self.bin, self.programs, self.site, self.frames = build / "bin", build / "tests/bin", site, frames
        self.intrinsics, self.size, _, self.centres = site_views(site)
        self.calibration = write_calibration(SCRATCH / "camera.yaml", self.intrinsics, self.size)

    def outcropd(self, cameras, **sections):
        return Outcropd(self.bin / "outcropd", cameras, **sections)

    def section(self, name, device, **keys):
        return camera_section(name, device, self.calibration, **keys)


class VividGroup(Group):
    """Formats and every fault that the kernel's virtual driver can be told to make."""
    FORMATS = ("YUYV", "UYVY", "NV12", "GREY")

    def __init__(self, *places):
        super().__init__(*places)
        self.vivid = Vivid(2)
        self.poses = Poses(self.bin, self.site)
        self.junctions = {}

    def one_camera(self, **keys):
        return self.outcropd([self.section("front", self.vivid.links[0], **keys)])

    def format(self, name):
        """Frames come, none is lost to a fault, and the picture is the same in every format."""
        with Tap(self.programs) as tap, self.one_camera(format=name) as daemon:
            daemon.wait_counters(frames_in=3, camera_opened=1)
            view = next(iter(tap.wait_views(1).values()))
            counters = daemon.counters()
            for fault in ("camera_faults", "camera_lost", "frames_flagged", "frames_corrupt", "camera_stalls"):
                expect(counters[fault] == 0, f"{fault} is {counters[fault]}")
            daemon.end()
        self.junctions[name] = view["junctions"]
        expect(view["junctions"] >= 20, f"{view['junctions']} junctions of the test pattern")
        first = next(iter(self.junctions.values()))
        expect(abs(view["junctions"] - first) <= 0.1 * first, f"junctions of the same picture differ: {self.junctions}")

    def flagged_buffer(self):
        with self.one_camera() as daemon:
            daemon.wait_frames()
            self.vivid.control(0, inject_v4l2_buf_flag_error=1)
            daemon.wait_counters(frames_flagged=1)
            daemon.wait_frames()
            counters = daemon.counters()
            expect(counters["frames_flagged"] == 1, f"frames_flagged is {counters['frames_flagged']}, one was")
            expect(counters["camera_opened"] == 1, "a flagged buffer is no reason to open the camera again")
            daemon.end()

    def dropped_buffers(self):
        with self.one_camera() as daemon:
            daemon.wait_frames()
            self.vivid.control(0, percentage_of_dropped_buffers=50)
            try:
                daemon.wait_more(frames_lost=3)
            finally:
                self.vivid.control(0, percentage_of_dropped_buffers=0)
            daemon.wait_frames()
            expect(daemon.counters()["camera_opened"] == 1, "lost frames are no reason to open the camera again")
            daemon.end()

    def future_times(self):
        """Frames that the driver dates ahead of now are not believed."""
        with self.one_camera() as daemon:
            daemon.wait_frames()
            self.vivid.control(0, timestamp_source=TIME_OF_END)
            try:
                daemon.wait_more(frames_bad_time=5)
            finally:
                self.vivid.control(0, timestamp_source=TIME_OF_START)
            daemon.wait_frames()
            daemon.end()

    def streaming_fault(self, inject):
        """A fault in mid-stream: counted once, and the camera comes back by itself."""
        with self.one_camera() as daemon:
            daemon.wait_frames()
            self.vivid.control(0, **{inject: 1})
            daemon.wait_counters(camera_lost=1, camera_opened=2)
            daemon.wait_frames()
            lost = daemon.counters()["camera_lost"]
            expect(lost == 1, f"camera_lost is {lost} after one fault")
            daemon.end()

    def start_fault(self, inject):
        """A fault when streaming starts: told once, tried again until it works."""
        self.vivid.control(0, **{inject: 1})
        with self.one_camera() as daemon:
            daemon.wait_counters(camera_faults=1, camera_opened=1)
            daemon.wait_frames()
            faults = daemon.counters()["camera_faults"]
            expect(faults == 1, f"camera_faults is {faults} after one fault")
            daemon.end()

    def disconnect(self):
        """The driver says "no such device" while its node is still there; then the device is made anew."""
        with self.one_camera() as daemon:
            daemon.wait_frames()
            self.vivid.control(0, disconnect=1)
            daemon.wait_counters(camera_lost=1)
            self.vivid.unbind()
            self.vivid.bind()
            daemon.wait_counters(camera_opened=2)
            daemon.wait_frames()
            daemon.end()

    def unbind(self):
        with self.one_camera() as daemon:
            for round_ in (1, 2):
                daemon.wait_frames()
                self.vivid.unbind()
                daemon.wait_counters(camera_lost=round_)
                time.sleep(1)  # some tries in vain
                self.vivid.bind()
                daemon.wait_counters(camera_opened=round_ + 1)
            daemon.wait_frames()
            daemon.end()

    def absent_at_start(self):
        self.vivid.unbind()
        with self.one_camera() as daemon:
            daemon.wait_counters(camera_faults=1)
            self.vivid.bind()
            daemon.wait_counters(camera_opened=1)
            daemon.wait_frames()
            expect(daemon.counters()["camera_faults"] == 1, "a spell of absence is told once")
            daemon.end()

    def two_cameras(self):
        cameras = [self.section(name, link) for name, link in zip(("left", "right"), self.vivid.links)]
        with Tap(self.programs) as tap, self.outcropd(cameras) as daemon:
            daemon.wait_counters(60, camera_opened=2)
            wait_for(lambda: all(daemon.camera(name)["frames"] >= 3 for name in ("left", "right")), 60,
                     lambda: f"frames of both cameras: {daemon.status()['cameras']}")
            tap.wait_views(2)
            seen = {view["camera"] for view in tap.whole_views().values()}
            expect(seen == {0, 1}, f"views came of the cameras {seen}")
            daemon.end()

    def scenarios(self):
        for name in self.FORMATS:
            yield f"format {name}", lambda name=name: self.format(name)
        yield "a buffer flagged as damaged", self.flagged_buffer
        yield "dropped buffers", self.dropped_buffers
        yield "times in the future", self.future_times
        yield "a buffer is refused", lambda: self.streaming_fault("inject_vidioc_qbuf_error")
        yield "a fatal error while streaming", lambda: self.streaming_fault("inject_fatal_streaming_error")
        yield "buffers are refused at start", lambda: self.start_fault("inject_vidioc_reqbufs_error")
        yield "streaming is refused at start", lambda: self.start_fault("inject_vidioc_streamon_error")
        yield "absent at start", self.absent_at_start
        yield "disconnected", self.disconnect
        yield "unbound and bound while streaming", self.unbind
        yield "two cameras", self.two_cameras


class UsbGroup(Group):
    """The kernel's uvcvideo, with udevd's own by-id name."""

    def __init__(self, *places):
        super().__init__(*places)
        self.camera = UsbCamera(self.programs, self.frames)
        self.poses = Poses(self.bin, self.site)
        self.junctions = {}

    def one_camera(self, **keys):
        return self.outcropd([self.section("front", self.camera.LINK, **keys)])

    def format(self, name):
        with Tap(self.programs) as tap, self.one_camera(format=name) as daemon:
            daemon.wait_counters(frames_in=3, camera_opened=1)
            view = next(iter(tap.wait_views(1).values()))
            daemon.end()
        self.junctions[name] = view["junctions"]
        first = next(iter(self.junctions.values()))
        expect(view["junctions"] >= 200 and abs(view["junctions"] - first) <= 0.1 * first,
               f"junctions of the depot's first view: {self.junctions}")

    def damaged(self, name, fault, *counters):
        """Damaged frames are counted in one of the counters, and none of them is looked at."""
        def damaged_so_far():
            told = daemon.counters()
            return sum(told[counter] for counter in counters)

        with self.one_camera(format=name) as daemon:
            daemon.wait_frames()
            expect(damaged_so_far() == 0, f"{damaged_so_far()} damaged frames before there was one")
            with self.camera.with_fault(fault):
                wait_for(lambda: damaged_so_far() >= 4, 20, lambda: f"damaged frames counted: {daemon.counters()}")
                before = daemon.counters()["frames_in"]
                time.sleep(2)
                expect(daemon.counters()["frames_in"] == before, "a damaged frame was handed on")
            daemon.wait_frames()
            expect(daemon.counters()["camera_opened"] == 1, "damaged frames are no reason to open the camera again")
            daemon.end()

    def stall(self):
        with self.one_camera(stall_ms=1500) as daemon:
            daemon.wait_frames()
            with self.camera.with_fault("silence"):
                daemon.wait_counters(camera_stalls=1)
            daemon.wait_counters(camera_opened=2)
            daemon.wait_frames()
            daemon.end()

    def unplugged(self, name):
        with self.one_camera(format=name) as daemon:
            for round_ in (1, 2, 3):
                daemon.wait_frames(2)
                self.camera.unplug()
                daemon.wait_counters(camera_lost=round_)
                expect(daemon.camera("front")["state"] != "streaming", f"unplugged: {daemon.camera('front')}")
                self.camera.plug_in()
                daemon.wait_counters(camera_opened=round_ + 1)
            daemon.wait_frames(2)
            daemon.end()

    def scenarios(self):
        for name in ("YUYV", "MJPG"):
            yield f"pictures as {name}", lambda name=name: self.format(name)
        yield "damaged JPEGs", lambda: self.damaged("MJPG", "corrupt", "frames_corrupt")
        yield "JPEGs cut in the middle", lambda: self.damaged("MJPG", "short", "frames_corrupt")
        yield "frames cut short", lambda: self.damaged("YUYV", "short", "frames_flagged", "frames_corrupt")
        yield "frames with the error bit", lambda: self.damaged("YUYV", "flag", "frames_flagged")
        yield "no frames for a while", self.stall
        yield "unplugged and plugged in, YUYV", lambda: self.unplugged("YUYV")
        yield "unplugged and plugged in, MJPG", lambda: self.unplugged("MJPG")


class GpioGroup(Group):
    """Lines of a simulated chip, and the depot seen through a camera."""

    def __init__(self, *places):
        super().__init__(*places)
        self.chip = GpioChip("vehicle", {"trigger": 0, "strobe": 1, "heartbeat": 2, "enable": 3, "mark": 4})
        self.camera = UsbCamera(self.programs, self.frames)
        self.poses = Poses(self.bin, self.site)

    def one_camera(self, gpio, **sections):
        return self.outcropd([self.section("front", self.camera.LINK)], gpio=gpio, **sections)

    def trigger_per_frame(self):
        """As many pulses as frames: one pulse of 20 ms for each, 5 a second."""
        with self.one_camera({"trigger": {"line": "trigger", "mode": "per_frame", "pulse_us": 20000}}) as daemon:
            daemon.wait_frames()
            frames = daemon.camera("front")["frames"]
            pulses = self.chip.count_rises("trigger", 6)
            time.sleep(1.1)  # the status file's turn
            frames = daemon.camera("front")["frames"] - frames
            expect(frames - 10 <= pulses <= frames and pulses >= 15, f"{pulses} pulses in 6 s, {frames} frames in 7 to 8 s")
            daemon.end()

    def trigger_periodic(self):
        """A clock of its own: 4 pulses a second, whether frames come or not; here active is the low level."""
        trigger = {"line": "trigger", "mode": "periodic", "rate_hz": 4, "pulse_us": 50000, "active_low": True}
        with self.one_camera({"trigger": trigger, "strobe": {"chip": "vehicle", "offset": 1, "pulse_us": 50000}}) as daemon:
            daemon.wait_frames()
            pulses = self.chip.count_rises("trigger", 5)
            expect(18 <= pulses <= 22, f"{pulses} pulses in 5 s at 4 Hz")
            strobes = self.chip.count_rises("strobe", 5)
            expect(18 <= strobes <= 22, f"{strobes} strobe pulses in 5 s at 4 Hz")
            daemon.end()

    def heartbeat(self):
        """Blinks while frames come, and stands still when they do not."""
        with self.one_camera({"heartbeat": {"line": "heartbeat", "period_ms": 400}}) as daemon:
            daemon.wait_frames()
            blinks = self.chip.count_rises("heartbeat", 4)
            expect(8 <= blinks <= 12, f"{blinks} flashes in 4 s at 400 ms each")
            with self.camera.with_fault("silence"):
                time.sleep(4)
                blinks = self.chip.count_rises("heartbeat", 3)
                expect(blinks == 0, f"{blinks} flashes in 3 s without a frame")
            daemon.end()

    def enable(self):
        self.chip.pull("enable", False)
        with self.one_camera({"enable": {"line": "enable"}}) as daemon:
            daemon.wait_counters(frames_disabled=5)
            expect(daemon.counters()["frames_in"] == 0, "frames were taken while they were not wanted")
            self.chip.pull("enable", True)
            daemon.wait_frames()
            self.chip.pull("enable", False)
            daemon.wait_more(frames_disabled=10)
            before = daemon.counters()["frames_in"]
            time.sleep(3)
            expect(daemon.counters()["frames_in"] == before, "frames were taken while they were not wanted")
            daemon.end()

    def mark(self):
        """A vehicle that stands makes one keyframe; each mark makes another."""
        with Tap(self.programs) as tap, self.one_camera({"mark": {"line": "mark", "debounce_ms": 10}}) as daemon:
            tap.wait_views(1)
            daemon.wait_frames(5)
            expect(len(tap.views()) == 1, f"{len(tap.views())} views of a vehicle that stands")
            for n in (2, 3):
                self.chip.pulse("mark")
                tap.wait_views(n)
            daemon.wait_frames(5)
            counters = daemon.counters()
            expect(counters["marks"] == 2, f"marks is {counters['marks']} after two")
            expect(len(tap.views()) == 3, f"{len(tap.views())} views after two marks")
            daemon.end()

    def refused(self, gpio, *words):
        """outcropd ends at once with a line that says what is wrong."""
        try:
            with self.one_camera(gpio) as daemon:
                daemon.end()
        except Failed as failure:
            told = str(failure)
            expect(told.startswith("outcropd ended with") and all(word in told for word in words),
                   f"of {words} not all is told: {told}")
            return
        raise Failed("outcropd starts although the line cannot be had")

    def depot(self):
        """The depot's views arrive as frames, each with its pose, and leave as views."""
        gpio = {"enable": {"line": "enable"}, "mark": {"line": "mark", "debounce_ms": 10}}
        views = range(len(self.centres))
        self.chip.pull("enable", False)
        with Tap(self.programs) as tap, self.one_camera(gpio, stored_views=32) as daemon:
            for n, k in enumerate(views):
                self.camera.tell(f"show {k}")
                self.poses.hold(k)
                daemon.wait_more(frames_disabled=5)  # those of the view before are gone
                self.chip.pulse("mark")
                self.chip.pull("enable", True)
                wait_for(lambda: len(tap.views()) > n, 30, lambda: f"view {k} leaves; there are {tap.views().keys()}")
                self.chip.pull("enable", False)
            told = tap.wait_views(len(views), 60)
            expect(len(told) == len(views), f"{len(told)} views for {len(views)} pictures")
            for k, view in zip(views, [told[number] for number in sorted(told)]):
                distance = sum((a - b) ** 2 for a, b in zip(view["centre"], self.centres[k])) ** 0.5
                expect(distance <= 0.005, f"view {k} has the pose of a camera {distance:.4f} m away")
                expect(view["junctions"] >= 200, f"view {k} has {view['junctions']} junctions")
            daemon.end()

    def scenarios(self):
        yield "trigger, a pulse per frame", self.trigger_per_frame
        yield "trigger and strobe by the clock", self.trigger_periodic
        yield "heartbeat", self.heartbeat
        yield "capture-enable", self.enable
        yield "mark", self.mark
        yield "a line that is not there", lambda: self.refused({"mark": {"line": "nowhere"}}, "mark", "nowhere")
        yield "the same line twice", lambda: self.refused({"mark": {"line": "mark"}, "enable": {"line": "mark"}}, "mark")
        yield "the depot through a camera", self.depot


GROUPS = {"vivid": VividGroup, "usb": UsbGroup, "gpio": GpioGroup, "service": ServiceGroup}


def run_scenario(name, scenario):
    """True when it passes; one line either way."""
    started = time.monotonic()
    try:
        scenario()
        verdict, reason = "PASS", ""
    except Failed as failure:
        verdict, reason = "FAIL", f": {failure}"
    except Exception as failure:  # a fault of the test itself
        place = traceback.extract_tb(failure.__traceback__)[-1]
        verdict, reason = "FAIL", f": {type(failure).__name__}: {failure} ({place.filename}:{place.lineno})"
    print(f"{verdict} {name} ({time.monotonic() - started:.1f} s){reason}", flush=True)
    return verdict == "PASS"


def main():
    group, *places = sys.argv[1:]
    shutil.rmtree(SCRATCH, ignore_errors=True)
    SCRATCH.mkdir()
    try:
        scenarios = list(GROUPS[group](*map(pathlib.Path, places)).scenarios())
    except Failed as failure:
        print(f"FAIL {group}: {failure}")
        return 1
    passed = [run_scenario(name, scenario) for name, scenario in scenarios]
    print(f"{group}: {sum(passed)} of {len(passed)} scenarios passed")
    return 0 if all(passed) else 1


if __name__ == "__main__":
    sys.exit(main())
