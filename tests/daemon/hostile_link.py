#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What strangers can send to outcropd: hostile_link.py --bin DIR --site DIR

Datagrams that are no packets, packets for another vehicle and more requests than anybody could mean, from a socket of
our own in a private network namespace. outcropd must go on, and every one of them must be in its counters.
"""
import argparse
import json
import pathlib
import random
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

from private_network import enter_private_network

DOWN, UP = ("239.255.76.67", 7667), ("239.255.76.68", 7668)
VEHICLE = 1
PACKET_HASH = None  # learnt from what the vehicle sends


def fail(*what):
    sys.exit("hostile_link: " + " ".join(str(w) for w in what))


def crc16(data):
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


class Sender:
    def __init__(self):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        self.sequence = 0

    def raw(self, data):
        self.socket.sendto(data, UP)

    def message(self, channel, payload):
        """An LCM short message."""
        self.raw(struct.pack(">II", 0x4C433032, self.sequence) + channel.encode() + b"\0" + payload)
        self.sequence += 1

    def packet(self, packet):
        self.message("OCU", PACKET_HASH + struct.pack(">H", len(packet)) + packet)


def listen():
    s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    s.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    s.bind(DOWN)
    s.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(DOWN[0]) + socket.inet_aton("127.0.0.1"))
    s.settimeout(20)
    return s


def counters(status_file):
    return json.loads(status_file.read_text())["counters"]


def await_counters(status_file, expected, what):
    """expected: name -> least value; told what was found when it does not come."""
    found = {}
    for _ in range(100):
        found = counters(status_file)
        if all(found[name] >= n for name, n in expected.items()):
            return found
        time.sleep(0.1)
    fail(what, "counters", {name: found[name] for name in expected}, "instead of", expected)


def resend_of(vehicle, view, sequence, spoil=False):
    """A resend request, as docs/protocol.md has it: head, view u(16), parts u(32), CRC."""
    body = bytes([16, vehicle]) + struct.pack(">HHI", sequence & 0xFFFF, view, 0xFFFFFFFF)
    return body + struct.pack(">H", crc16(body) ^ (1 if spoil else 0))


def attack(sender, status_file, daemon):
    rng = random.Random(20261125)
    print("hostile_link: seed 20261125")
    start = counters(status_file)

    # A request of our own making is understood: the rest of the test says something.
    sender.packet(resend_of(VEHICLE, 0, 0))
    time.sleep(0.3)
    if counters(status_file)["packets_bad"] != start["packets_bad"]:
        fail("a proper request was taken for a bad one")

    for i in range(200):
        sender.packet(resend_of(VEHICLE, 0, i, spoil=True))
        time.sleep(0.001)
    found = await_counters(status_file, {"packets_bad": start["packets_bad"] + 200}, "packets with a wrong checksum:")
    for i in range(100):
        sender.packet(resend_of(VEHICLE + 1, 0, i))
        time.sleep(0.001)
    await_counters(status_file, {"packets_foreign": 100}, "packets for another vehicle:")

    for i in range(100):  # not the type's fingerprint, wrong length, nothing at all
        sender.message("OCU", rng.choice([b"", rng.randbytes(rng.randrange(1, 60)), PACKET_HASH + b"\xff\xff" + b"x" * 20]))
        time.sleep(0.001)
    await_counters(status_file, {"packets_bad": found["packets_bad"] + 100}, "messages that are no packets:")

    for _ in range(300):  # not even LCM
        sender.raw(rng.randbytes(rng.randrange(0, 1400)))
    for i in range(3000):  # a flood, without a pause
        sender.packet(resend_of(VEHICLE, rng.randrange(0, 4), i))
    time.sleep(2.5)
    after = counters(status_file)
    if daemon.poll() is not None:
        fail("outcropd ended with", daemon.returncode)
    sender.packet(resend_of(VEHICLE, 60000, 1))  # a view that never was
    await_counters(status_file, {"requests_gone": after["requests_gone"] + 1}, "after the flood a request:")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--site", type=pathlib.Path, required=True)
    options = parser.parse_args()
    enter_private_network("hostile_link")
    global PACKET_HASH
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        status_file, config = folder / "status.json", folder / "outcropd.yaml"
        config.write_text(f'vehicle: {VEHICLE}\nstatus_file: "{status_file}"\nlink:\n'
                          f'  down_url: "udpm://{DOWN[0]}:{DOWN[1]}?ttl=0"\n  up_url: "udpm://{UP[0]}:{UP[1]}?ttl=0"\n'
                          f'source:\n  site: "{options.site.resolve()}"\n  period_ms: 20\n')
        receiver = listen()
        daemon = subprocess.Popen([options.bin / "outcropd", "--config", config], stdout=subprocess.DEVNULL)
        try:
            datagram = receiver.recv(65536)
            PACKET_HASH = datagram[8 + len("OCD\0"):][:8]
            for _ in range(100):
                if status_file.exists() and json.loads(status_file.read_text())["source_done"]:
                    break
                time.sleep(0.1)
            attack(Sender(), status_file, daemon)
            shown = subprocess.run([options.bin / "outcropd", "--status", "--file", status_file], capture_output=True,
                                   text=True)
            if shown.returncode != 0 or "running" not in shown.stdout or "packets_foreign" not in shown.stdout:
                fail("--status:", shown.returncode, shown.stdout, shown.stderr)
            daemon.send_signal(signal.SIGTERM)
            if daemon.wait(10) != 0:
                fail("outcropd ended with", daemon.returncode)
        finally:
            if daemon.poll() is None:
                daemon.kill()
        shown = subprocess.run([options.bin / "outcropd", "--status", "--file", status_file], capture_output=True, text=True)
        if shown.returncode != 1 or "NOT RUNNING" not in shown.stdout:
            fail("--status of a daemon that has ended:", shown.returncode, shown.stdout)
    print("hostile_link: passed")


main()
