#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""House rules a script can see: licence line, include guards, file length, nothing left for later.

house.py [ROOT]    checks the tree, prints one line per violation, exits 1 on any
house.py --self-test    plants violations in a scratch tree and fails unless each is found
"""
import pathlib
import re
import sys
import tempfile

PLACES = ("lib", "daemon", "lcmtypes", "tools", "tests", "docs", ".ci")
CODE = {".c", ".h", ".cpp", ".hpp", ".py", ".sh", ".cmake", ".lcm"}
MAX_LINES = 600
LATER = re.compile(r"\b(?:TO" r"DO|FIX" r"ME|XX" r"X|HA" r"CK)\b")


def guard_of(where):
    """OUTCROP_CORE_CAMERA_H for lib/core/camera.h."""
    parts = pathlib.PurePosixPath(where).with_suffix("").parts
    return "OUTCROP_" + "_".join(re.sub(r"\W", "_", part).upper() for part in parts[1:]) + "_H"


def check_file(root, path):
    where = path.relative_to(root).as_posix()
    lines = path.read_text(errors="replace").splitlines()
    found = []
    if not any("SPDX-License-Identifier: BSD-3-Clause" in line for line in lines[:2]):
        found.append(f"{where}:1: no licence line")
    if len(lines) > MAX_LINES:
        found.append(f"{where}: {len(lines)} lines, more than {MAX_LINES}")
    for number, line in enumerate(lines, 1):
        if LATER.search(line):
            found.append(f"{where}:{number}: left for later: {line.strip()}")
    if path.suffix == ".h" and where.startswith("lib/"):
        guard = guard_of(where)
        is_once = "#pragma once" in lines and where.startswith("lib/site/")  # C++ only
        if not is_once and (f"#ifndef {guard}" not in lines or f"#define {guard}" not in lines):
            found.append(f"{where}: include guard is not {guard}")
    return found


def check_tree(root):
    found = []
    for place in PLACES:
        for path in sorted((root / place).rglob("*")):
            if "data" in path.relative_to(root).parts:  # test sites and captured logs, which end in .lcm as well
                continue
            if path.is_file() and (path.suffix in CODE or path.name == "CMakeLists.txt"):
                found += check_file(root, path)
    return found


def self_test():
    licence = "/* SPDX-License-Identifier: BSD-3-Clause */\n"
    bad = {
        "lib/core/a.c": "int x;\n", "lib/core/b.h": licence + "#ifndef B_H\n#define B_H\n#endif\n",
        "lib/site/c.cpp": licence + "// TO" "DO\n", "tools/long.py": "# " + licence + "\n" * MAX_LINES,
    }
    good = {"lib/core/d.h": licence + "#ifndef OUTCROP_CORE_D_H\n#define OUTCROP_CORE_D_H\n#endif\n"}
    with tempfile.TemporaryDirectory() as scratch:
        root = pathlib.Path(scratch)
        for name, text in {**bad, **good}.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text)
        found = {line.split(":")[0] for line in check_tree(root)}
    wrong = sorted(found ^ set(bad))
    for name in wrong:
        print(f"self-test: wrong verdict on {name}")
    return 1 if wrong else 0


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    root = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parent.parent.parent
    found = check_tree(root.resolve())
    print("\n".join(found) if found else "the house is in order")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
