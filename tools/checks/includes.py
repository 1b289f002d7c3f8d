#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Holds every #include of our sources against tools/checks/includes.txt.

includes.py [ROOT]    checks the tree, prints one line per violation, exits 1 on any
includes.py --self-test    plants violations in a scratch tree and fails unless each is found
"""
import fnmatch
import os
import pathlib
import re
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
PLACES = ("lib", "daemon", "tools", "tests")
SUFFIXES = {".c", ".h", ".cpp", ".hpp"}
INCLUDE = re.compile(r'^\s*#\s*include\s*(?:(<)([^>]+)>|(")([^"]+)"|(\S+))', re.MULTILINE)


def read_table(path):
    """[(glob, set of allowed)], groups expanded."""
    groups, rows = {}, []
    for line in path.read_text().splitlines():
        line = line.split("#", 1)[0].strip()
        if not line:
            continue
        if line.startswith("@"):
            name, _, items = line.partition("=")
            groups.setdefault(name.strip(), set()).update(items.split())
            continue
        glob, _, items = line.partition(":")
        allowed = set()
        for item in items.split():
            allowed |= groups[item] if item.startswith("@") else {item}
        rows.append((glob.strip(), allowed))
    return rows


def is_allowed(name, allowed):
    return any(name.startswith(a) if a.endswith("/") else name == a for a in allowed)


def check_file(root, path, rows):
    """Violations of one file, as text lines."""
    where = path.relative_to(root).as_posix()
    matching = [allowed for glob, allowed in rows if fnmatch.fnmatchcase(where, glob)]
    if not matching:
        return [f"{where}: no line of includes.txt covers this file"]
    allowed = set().union(*matching)
    found = []
    text = path.read_text(errors="replace")
    for match in INCLUDE.finditer(text):
        line = text.count("\n", 0, match.start(match.lastindex)) + 1
        name = match.group(2) or match.group(4)
        if name is None:
            found.append(f"{where}:{line}: #include of a macro hides what it includes")
            continue
        is_beside = match.group(3) and "/" not in name and (path.parent / name).is_file()
        wanted = name
        if name.startswith("../"):  # judged by where it leads
            wanted = os.path.relpath((path.parent / name).resolve(), root)
        if not (is_beside or is_allowed(wanted, allowed)):
            found.append(f"{where}:{line}: may not include {name}")
    return found


def check_tree(root, rows):
    found = []
    for place in PLACES:
        for path in sorted((root / place).rglob("*")):
            if path.suffix in SUFFIXES and path.is_file():
                found += check_file(root, path, rows)
    return found


def self_test(rows):
    """Each planted line must be found, each legal one must pass."""
    bad = {
        "lib/core/a.c": "#include <stdlib.h>", "lib/core/b.h": '#include "vehicle/arena.h"',
        "lib/core/c.c": "#include <time.h>", "lib/vehicle/a.c": "#include <stdio.h>",
        "lib/vehicle/b.c": '#include "site/view.h"', "lib/site/a.cpp": '#include "vehicle/judoca.h"',
        "lib/site/b.cpp": "#  include <lcm/lcm.h>", "daemon/vehicle/main.c": '#include "site/view.h"',
        "daemon/vehicle/b.c": "#include <linux/videodev2.h>", "daemon/vehicle/d.c": "#include <gpiod.h>",
        "daemon/base/a.cpp": "#include <lcm/lcm-cpp.hpp>", "lib/core/d.c": '#include "../site/view.h"',
        "lib/core/e.c": "#define X <stdio.h>\n#include X", "lib/vehicle/deep/c.c": "#include <malloc.h>",
    }
    good = {
        "lib/core/ok.c": '#include <math.h>\n#include "core/camera.h"', "daemon/vehicle/capture_v4l2.c":
        "#include <linux/videodev2.h>", "daemon/vehicle/gpio_line.c": "#include <gpiod.h>",
        "daemon/base/link_lcm.cpp": "#include <lcm/lcm-cpp.hpp>", "lib/site/ok.cpp": "#include <vector>",
        "daemon/base/ok.cpp": '#include "vehicle/vehicle.h"\n#include "site/view.h"',
    }
    with tempfile.TemporaryDirectory() as scratch:
        root = pathlib.Path(scratch).resolve()
        for name, text in {**bad, **good}.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text + "\n")
        found = {line.split(":")[0] for line in check_tree(root, rows)}
    failed = sorted(set(bad) - found) + sorted(found - set(bad))
    for name in failed:
        print(f"self-test: wrong verdict on {name}")
    return failed


def main():
    rows = read_table(HERE / "includes.txt")
    if sys.argv[1:] == ["--self-test"]:
        return 1 if self_test(rows) else 0
    root = pathlib.Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else HERE.parent.parent
    found = check_tree(root, rows)
    print("\n".join(found) if found else "every include is on the list")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
