#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""outcrop-pose-replay as a program: what it publishes, and what it says of bad files: pose_replay.py --bin DIR --site DIR"""
import argparse
import json
import math
import pathlib
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

from private_network import enter_private_network

GROUP = ("239.255.76.69", 7669)


def fail(*what):
    sys.exit("pose_replay: " + " ".join(str(w) for w in what))


def listen():
    s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    s.bind(GROUP)
    s.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(GROUP[0]) + socket.inet_aton("127.0.0.1"))
    s.settimeout(10)
    return s


def poses(listener, channel, layout, n):
    """The next n messages of an LCM channel, fingerprint taken off."""
    lead = b"LC02"
    out = []
    while len(out) < n:
        datagram = listener.recv(65536)
        name, _, payload = datagram[8:].partition(b"\0")
        if datagram[:4] != lead or name.decode() != channel:
            fail("an unexpected message on", name)
        if len(payload) != 8 + struct.calcsize(layout):
            fail(len(payload), "bytes of", channel)
        out.append(struct.unpack(layout, payload[8:]))
    return out


def centres(site):
    """Camera centres, metres, and margins of the site."""
    root = json.loads((site / "cameras.json").read_text())
    scale = 1e-3 if root["units"] == "mm" else 1
    out = []
    for view in root["views"]:
        R, t = view["R"], view["t"]
        out.append([-scale * sum(R[j][i] * t[j] for j in range(3)) for i in range(3)])
    return out


def check_site(program, site):
    """All views at a hundred times the pace: dense, in order, through every camera's place."""
    listener = listen()
    child = subprocess.Popen([program, site, "--speed", "20", "--rate", "100", "--now"], stdout=subprocess.PIPE, text=True)
    wanted = centres(site)
    begin = time.time()
    told = poses(listener, "OUTCROP_POSE", ">q3d4db36d", 5 * (len(wanted) - 1) + 1)
    times = [p[0] for p in told]
    if times != sorted(set(times)) or abs(times[0] / 1e6 - begin) > 5:
        fail("times", times[:5], "at", begin)
    for n, centre in enumerate(wanted):
        best = min(math.dist(p[1:4], centre) for p in told)
        if best > 1e-6:
            fail("view", n, "is passed by", best, "m")
    for p in told:
        if abs(sum(q * q for q in p[4:8]) - 1) > 1e-9:
            fail("a quaternion of length", sum(q * q for q in p[4:8]))
    out = child.communicate(timeout=20)[0]
    if child.returncode != 0 or "poses sent" not in out:
        fail("ends with", child.returncode, out)
    listener.close()


def check_mount_and_bot_core(program, site):
    """A camera a metre above its body: the body is a metre below; bot_core's z points down."""
    listener = listen()
    child = subprocess.Popen([program, site, "--hold", "2", "--rate", "50", "--as", "bot_core", "--mount", "0,0,0,0,0,0"],
                             stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    wanted = centres(site)
    first = poses(listener, "POSE", ">q3d3d4d3d3d", 3)
    if math.dist(first[-1][1:4], wanted[2]) > 1e-6:
        fail("view 2 is held at", first[-1][1:4])
    child.stdin.write("0\n")
    child.stdin.flush()
    later = poses(listener, "POSE", ">q3d3d4d3d3d", 15)
    if math.dist(later[-1][1:4], wanted[0]) > 1e-6:
        fail("view 0 is held at", later[-1][1:4])
    w, x, y, z = later[-1][7:11]
    down = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
    # The camera looks down at the ground, so the housing's z (up) has a part that is up, and bot_core's the opposite.
    if down[2] >= 0:
        fail("bot_core's z points up:", down)
    child.send_signal(signal.SIGTERM)
    if child.wait(10) != 0:
        fail("ends with", child.returncode)
    listener.close()


def check_csv(program, folder):
    good = "1000000,1,2,3,1,0,0,0\n"
    covariance = ",".join("1" if i % 7 == 0 else "0" for i in range(36))
    bad = [("", "holds no pose"), ("# nothing\n", "holds no pose"), ("utime,x\n", "holds no pose"),
           (good + "1000001,1,2,3,1,0,0\n", ":2: has 7 numbers"), (good + good, ":2: time does not ascend"),
           ("1,2,3,x,1,0,0,0\n", ':1: "x,1,0,0,0" is not a number'), (good + "\n1000001;1\n", ":3: numbers must be divided"),
           ("1,2,3,4,1,1,0,0\n", ":1: is no pose"), ("1,nan,3,4,1,0,0,0\n", ":1: is no pose"),
           ("-1,2,3,4,1,0,0,0\n", ":1: is no pose"), ("1,2,3,4,1,0,0,0," + covariance + ",5\n", ":1: has 45 numbers"),
           ("1,2,3,4,1,0,0,0," + covariance.replace("1", "-1") + "\n", ":1: is no pose")]
    for text, what in bad:
        file = folder / "poses.csv"
        file.write_text(text)
        done = subprocess.run([program, file], capture_output=True, text=True, timeout=20)
        if done.returncode != 1 or what not in done.stderr or done.stderr.count("\n") != 1:
            fail(repr(text), "gives", done.returncode, done.stderr)
    file.write_text("utime_us,x,y,z\n" + good + "1500000,2,2,3,1,0,0,0," + covariance + "\n")
    listener = listen()
    child = subprocess.Popen([program, file, "--rate", "10"], stdout=subprocess.DEVNULL)
    told = poses(listener, "OUTCROP_POSE", ">q3d4db36d", 6)
    if [p[0] for p in told] != [1000000 + 100000 * i for i in range(6)] or abs(told[2][1] - 1.4) > 1e-9:
        fail("a table gives", [p[:2] for p in told])
    if [p[8] for p in told] != [0, 0, 0, 0, 0, 1]:
        fail("covariance where there is none:", [p[8] for p in told])
    child.wait(10)


def check_usage(program, site):
    for options, code in ((["/nowhere"], 1), ([], 2), ([site, "--loop"], 2), ([site, "--hold", "99"], 1),
                          ([site, "--rate", "0"], 2), ([site, "-l", "udpm://10.0.0.1:5"], 1)):
        done = subprocess.run([program, *options], capture_output=True, text=True, timeout=20)
        if done.returncode != code or not done.stderr:
            fail(options, "gives", done.returncode, done.stderr)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--site", type=pathlib.Path, required=True)
    options = parser.parse_args()
    enter_private_network("pose_replay")
    program = options.bin / "outcrop-pose-replay"
    check_usage(program, options.site)
    check_site(program, options.site)
    check_mount_and_bot_core(program, options.site)
    with tempfile.TemporaryDirectory() as folder:
        check_csv(program, pathlib.Path(folder))
    print("pose_replay: passed")


main()
