# SPDX-License-Identifier: BSD-3-Clause
"""A network namespace of a test's own: nothing that is sent leaves it."""
import ctypes
import os
import pathlib
import subprocess
import sys

CLONE_NEWUSER, CLONE_NEWNET = 0x10000000, 0x40000000


def enter_private_network(name):
    """Leave the machine's network for one with lo and a multicast route; ends the program with 77 where that is refused."""
    uid, gid = os.getuid(), os.getgid()
    if ctypes.CDLL(None, use_errno=True).unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0:
        print(f"{name}: SKIPPED: no private network namespace can be made here")
        sys.exit(77)
    pathlib.Path("/proc/self/setgroups").write_text("deny")
    pathlib.Path("/proc/self/uid_map").write_text(f"0 {uid} 1")
    pathlib.Path("/proc/self/gid_map").write_text(f"0 {gid} 1")
    for command in (["ip", "link", "set", "lo", "up"], ["ip", "route", "add", "239.0.0.0/8", "dev", "lo"]):
        subprocess.run(command, check=True)
