# SPDX-License-Identifier: BSD-3-Clause
"""The machine that a figure comes from."""
import os
import pathlib
import platform
import re


def cpu():
    try:
        found = re.search(r"^model name\s*:\s*(.*)$", pathlib.Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    except OSError:
        found = None
    return found.group(1) if found else platform.machine()


def cores():
    return len(os.sched_getaffinity(0))


def text():
    return f"{cpu()}, {cores()} cores"
