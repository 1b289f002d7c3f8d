#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""outcropd at 640x480 and 30 frames a second, watched: soak.py --bin DIR [--seconds S] [--json FILE]

The depot's views as frames of a vehicle that stands a second at each and drives on, round and round, with a base that
asks for pixels, tiles and repeats, and a service manager that wants signs of life. After a fifth of the time (two of
ten minutes) memory must not grow any more: RssAnon by at most 64 kB; and the thread from capture to packet must not
call the heap once. Run by tools/soak.sh in a network namespace of its own.
"""
import argparse
import json
import os
import pathlib
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import about_machine  # noqa: E402

DOWN, UP = "udpm://239.255.76.67:7667?ttl=0", "udpm://239.255.76.68:7668?ttl=0"
PERIOD_MS = 33
MAX_GROWTH_KB = 64
SLOT = struct.Struct("<iiQQ")

CONFIG = """vehicle: 1
status_file: "{status}"
link:
  down_url: "{down}"
  up_url: "{up}"
source:
  site: "{site}"
  period_ms: {period}
  repeat: 30
  loop: true
  keyframes: moved
"""


def make_network():
    for command in (["ip", "link", "set", "lo", "up"], ["ip", "route", "add", "239.0.0.0/8", "dev", "lo"]):
        subprocess.run(command, check=True)


def proc_field(pid, field):
    for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith(field + ":"):
            return int(line.split()[1])
    sys.exit(f"soak: /proc/{pid}/status has no {field}")


def cpu_s(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def heap_calls(path):
    """tid -> allocations + frees so far."""
    data = path.read_bytes()
    return {tid: n + f for tid, _, n, f in SLOT.iter_unpack(data) if tid}


def signs_of_life(listener):
    n = 0
    while True:
        try:
            n += listener.recv(4096).count(b"WATCHDOG=1")
        except BlockingIOError:
            return n


class Soak:
    def __init__(self, options, folder):
        self.options, self.folder = options, folder
        self.status_file, self.counts_file = folder / "status.json", folder / "counts"
        self.listener = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self.listener.bind(str(folder / "notify"))
        config = folder / "outcropd.yaml"
        config.write_text(CONFIG.format(status=self.status_file, down=DOWN, up=UP, site=options.site.resolve(),
                                        period=PERIOD_MS))
        environment = dict(os.environ, LD_PRELOAD=str((options.bin / "outcrop_alloc_counts.so").resolve()),
                           OUTCROP_ALLOC_COUNTS=str(self.counts_file), NOTIFY_SOCKET=str(folder / "notify"),
                           WATCHDOG_USEC="2000000")
        self.log = open(folder / "log", "w")
        self.peer = subprocess.Popen([options.bin / "outcrop-soak-peer", DOWN, UP, "1"], stdout=subprocess.PIPE, text=True)
        self.daemon = subprocess.Popen([options.bin / "outcropd", "--config", config], env=environment, stdout=self.log,
                                       stderr=subprocess.STDOUT)

    def sample(self):
        pid = self.daemon.pid
        if self.daemon.poll() is not None:
            sys.exit(f"soak: outcropd ended with {self.daemon.returncode}: {(self.folder / 'log').read_text()[-500:]}")
        status = json.loads(self.status_file.read_text())
        return {"t_s": time.monotonic(), "rss_anon_kb": proc_field(pid, "RssAnon"), "cpu_s": cpu_s(pid),
                "frame_thread_cpu_us": status["frame_thread_cpu_us"], "counters": status["counters"],
                "views": status["views"], "latency": status["latency"], "heap": heap_calls(self.counts_file),
                "signs_of_life": signs_of_life(self.listener)}

    def run(self):
        begin = time.monotonic()
        while time.monotonic() < begin + 5:  # the start
            time.sleep(0.5)
            if self.status_file.exists() and time.monotonic() > begin + 2:
                break
        samples = []
        while not samples or samples[-1]["t_s"] < begin + self.options.seconds:
            time.sleep(min(5.0, self.options.seconds / 20))
            samples.append(self.sample())
        return begin, samples

    def stop(self):
        for child in (self.daemon, self.peer):
            child.send_signal(signal.SIGTERM)
        if self.daemon.wait(10) != 0:
            sys.exit(f"soak: outcropd ended with {self.daemon.returncode}")
        asked = json.loads(self.peer.communicate(timeout=10)[0])
        self.log.close()
        return asked


def judge(options, begin, samples, asked, pid):
    first = next(s for s in samples if s["t_s"] >= begin + options.seconds / 5)
    last = samples[-1]
    n_frames = last["counters"]["frames_in"] - first["counters"]["frames_in"]
    seconds = last["t_s"] - first["t_s"]
    others = {tid: n - first["heap"].get(tid, 0) for tid, n in last["heap"].items() if tid != pid}
    result = {
        "seconds": round(seconds), "frames": n_frames, "views": last["views"] - first["views"],
        "frames_per_second": round(n_frames / seconds, 2),
        "rss_anon_kb": last["rss_anon_kb"], "rss_anon_growth_kb": last["rss_anon_kb"] - first["rss_anon_kb"],
        "heap_calls_frame_thread": last["heap"].get(pid, 0) - first["heap"].get(pid, 0),
        "heap_calls_other_threads": sum(others.values()), "other_threads": len(others),
        "cpu_ms_a_frame": round((last["cpu_s"] - first["cpu_s"]) * 1e3 / n_frames, 2),
        "frame_thread_cpu_ms_a_frame":
            round((last["frame_thread_cpu_us"] - first["frame_thread_cpu_us"]) * 1e-3 / n_frames, 2),
        "frame_latency_ms": {k[:-3]: last["latency"]["frame"][k] / 1e3 for k in ("p50_us", "p99_us", "max_us")},
        "view_latency_ms": {k[:-3]: last["latency"]["view"][k] / 1e3 for k in ("p50_us", "p99_us", "max_us")},
        "peer": asked, "counters": {k: v for k, v in last["counters"].items() if v},
        "longest_silence_s": max(b["t_s"] - a["t_s"] for a, b in zip(samples, samples[1:]) if b["signs_of_life"] == 0)
        if any(s["signs_of_life"] == 0 for s in samples[1:]) else 0,
        "machine": about_machine.text(), "settling_s": round(options.seconds - seconds),
    }
    faults = []
    if result["rss_anon_growth_kb"] > MAX_GROWTH_KB:
        faults.append(f"RssAnon grew by {result['rss_anon_growth_kb']} kB")
    if result["heap_calls_frame_thread"] != 0:
        faults.append(f"the thread of the frames called the heap {result['heap_calls_frame_thread']} times")
    if not pid in last["heap"] or not others:
        faults.append("heap calls were not counted")
    if n_frames < 0.9 * seconds * 1000 / PERIOD_MS:
        faults.append(f"only {n_frames} frames in {seconds:.0f} s")
    if asked["patch"] == 0 or asked["overhead"] == 0 or asked["view"] < result["views"]:
        faults.append(f"the base was not answered: {asked}")
    if result["longest_silence_s"] > 0:
        faults.append("signs of life for the service manager were missing")
    return result, faults


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--site", type=pathlib.Path, default=pathlib.Path("tests/data/sites/depot"))
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--json", type=pathlib.Path)
    options = parser.parse_args()
    make_network()
    with tempfile.TemporaryDirectory() as folder:
        soak = Soak(options, pathlib.Path(folder))
        try:
            begin, samples = soak.run()
            asked = soak.stop()
        finally:
            for child in (soak.daemon, soak.peer):
                if child.poll() is None:
                    child.kill()
        result, faults = judge(options, begin, samples, asked, soak.daemon.pid)
    print(json.dumps(result, indent=1))
    if options.json:
        options.json.write_text(json.dumps(result, indent=1) + "\n")
    for fault in faults:
        print(f"soak: {fault}", file=sys.stderr)
    print(f"soak: {result['seconds']} s, {'FAILED' if faults else 'passed'}")
    sys.exit(1 if faults else 0)


main()
