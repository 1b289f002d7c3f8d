#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Instructions that the junction detector executes per frame, on x86-64 and on aarch64.

instructions.py [--x86 PROGRAM] [--aarch64 PROGRAM] [--method NAME] [--json FILE] FILE.pgm...

Adds what it counts to the JSON in FILE.

PROGRAM is a build's tests/bin/junction_digest. What a run with one frame executes less what a run without any does is
what one frame takes. No counter of the machine's is needed: on x86-64 valgrind's callgrind counts, for aarch64 QEMU's
user mode logs every block of instructions as it is translated and every execution of one, and their products are added
up here (both ways agree to 1e-5 where both can run; the log takes a second per half a million blocks).
"""
import argparse
import collections
import json
import os
import pathlib
import re
import subprocess
import sys
import threading

TRANSLATED = re.compile(rb"^IN:.*\n((?:0x.*\n)+)", re.MULTILINE)
EXECUTED = re.compile(rb"^Trace 0: 0x[0-9a-f]+ \[[0-9a-f]+/0*([0-9a-f]+)/", re.MULTILINE)
CHUNK = 1 << 22

QEMU = ["qemu-aarch64-static", "-L", "/usr/aarch64-linux-gnu", "-d", "in_asm,exec,nochain"]
CALLGRIND = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"]


def n_instructions(lines):
    """A long instruction's bytes go on in a line without a mnemonic."""
    return sum(any(len(cell) != 2 for cell in line.split()[1:]) for line in lines)


def add_up(pipe, result):
    """Blocks by address: their length as last translated, how often they ran."""
    length, runs, rest = {}, collections.Counter(), b""
    while True:
        data = pipe.read(CHUNK)
        text = rest + data
        # Up to the last separator, so that no block is cut in two.
        end = text.rfind(b"\nTrace ") + 1 if data else len(text)
        text, rest = text[:end], text[end:]
        for block in TRANSLATED.finditer(text):
            lines = block.group(1).splitlines()
            length[lines[0].split(b":")[0][2:].lstrip(b"0")] = n_instructions(lines)
        runs.update(EXECUTED.findall(text))
        if not data:
            break
    result.append(sum(n * length[at] for at, n in runs.items()))


def count_aarch64(command):
    read_end, write_end = os.pipe()
    result = []
    with os.fdopen(read_end, "rb") as pipe:
        reader = threading.Thread(target=add_up, args=(pipe, result))
        reader.start()
        try:
            subprocess.run([*QEMU, "-D", f"/dev/fd/{write_end}", *command], check=True, pass_fds=[write_end],
                           stdout=subprocess.DEVNULL)
        finally:
            os.close(write_end)
            reader.join()
    return result[0]


def count_x86(command):
    done = subprocess.run([*CALLGRIND, *command], check=True, capture_output=True, text=True)
    return int(re.search(r"Collected : (\d+)", done.stderr).group(1))


COUNTERS = {"x86": count_x86, "aarch64": count_aarch64}


def per_frame(count, program, method, picture):
    one, none = (count([program, "--method", method, "--frames", n, picture]) for n in ("1", "0"))
    return one - none


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--x86")
    parser.add_argument("--aarch64")
    parser.add_argument("--method", default="fixed", help="as junction_digest's")
    parser.add_argument("--json")
    parser.add_argument("pictures", nargs="+")
    options = parser.parse_args()
    rows = []
    for picture in options.pictures:
        row = {"image": os.path.splitext(os.path.basename(picture))[0], "method": options.method}
        for machine, count in COUNTERS.items():
            if program := getattr(options, machine):
                row[f"{machine}_instructions"] = per_frame(count, program, options.method, picture)
        print(" ".join(str(value) for value in row.values()))
        rows.append(row)
    if options.json:
        path = pathlib.Path(options.json)
        figures = json.loads(path.read_text()) if path.exists() else {}
        path.write_text(json.dumps({**figures, "instructions": rows}, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
