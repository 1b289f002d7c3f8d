#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Broken copies of a clean log: make_bad_logs.py CLEAN.lcm CUT.lcm GARBAGE.lcm. The same log gives the same copies."""
import pathlib
import random
import sys

import wire


def cut(data):
    """Ends in the payload of the event at three quarters of the log."""
    places = list(wire.events(data))
    at, channel, payload = places[len(places) * 3 // 4]
    return data[:at + 28 + len(channel) + len(payload) // 2]


def garbage(data):
    """Noise between events at a tenth, and inside the payloads of three events."""
    noise = random.Random(20)
    places = [place for place in wire.events(data)]
    inserts = [(places[len(places) // 10][0], 137), (places[len(places) // 2][0], 4000)]
    for share in (0.3, 0.6, 0.9):
        at, channel, payload = places[int(len(places) * share)]
        inserts.append((at + 28 + len(channel) + len(payload) // 2, 50))
    for at, n in sorted(inserts, reverse=True):
        data = data[:at] + noise.randbytes(n) + data[at:]
    return data


def main():
    clean, cut_file, garbage_file = map(pathlib.Path, sys.argv[1:])
    data = clean.read_bytes()
    cut_file.write_bytes(cut(data))
    garbage_file.write_bytes(garbage(data))


if __name__ == "__main__":
    main()
