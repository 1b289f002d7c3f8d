#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Holds the symbols of liboutcrop_core.a and liboutcrop_vehicle.a against what the robot's code may use.

symbols.py --nm NM ARCHIVE...           prints one line per violation, exits 1 on any
symbols.py --nm NM --self-test CC       compiles violations and fails unless each is found

A library may call libm, mem*, the assert handler, compiler support and our own oc_*; it exports oc_* only; it has no
data that can be written.
"""
import argparse
import pathlib
import re
import subprocess
import sys
import tempfile

LIBM = """acos acosh asin asinh atan atan2 atanh cbrt ceil copysign cos cosh erf erfc exp exp2 expm1 fabs fdim floor fma fmax
fmin fmod frexp hypot ilogb ldexp llrint llround log log10 log1p log2 logb lrint lround modf nearbyint nextafter pow
remainder rint round scalbln scalbn sin sincos sinh sqrt tan tanh trunc""".split()
ALLOWED = re.compile(
    r"(?:oc_\w+"
    r"|(?:" + "|".join(LIBM) + r")f?"
    r"|(?:__)?(?:memcpy|memmove|memset)(?:_chk)?|memcmp|memchr"
    r"|__assert_fail|__stack_chk_fail|_GLOBAL_OFFSET_TABLE_"
    r"|__cpu_model|__cpu_indicator_init"  # which instructions there are
    r"|__(?:u?div|u?mod|mul|popcount|clz|ctz|ashl|ashr|lshr)[sdt]i[234])")  # libgcc
READ_ONLY = re.compile(r"\.(?:text|rodata|data\.rel\.ro|eh_frame|note)")


def symbols_of(nm, archive):
    """[(name, class letter, section)] of every member; 'U' means undefined."""
    out = subprocess.run([nm, "-f", "sysv", archive], check=True, capture_output=True, text=True).stdout
    rows = []
    for line in out.splitlines():
        cells = [cell.strip() for cell in line.split("|")]
        if len(cells) == 7 and cells[2] and cells[2] != "Class":
            rows.append((cells[0], cells[2], cells[6]))
    return rows


def check_archive(nm, archive):
    found, defined = [], set()
    rows = symbols_of(nm, archive)
    if not rows:
        return [f"{archive}: no symbols at all"]
    for name, kind, section in rows:
        if kind in "Uw":
            if not ALLOWED.fullmatch(name):
                found.append(f"{archive}: calls {name}")
            continue
        defined.add(name)
        if (kind.isupper() or kind in "uvw") and not name.startswith("oc_"):
            found.append(f"{archive}: exports {name}, which has no oc_ in front")
        if kind in "DdBbCGgSs" and not READ_ONLY.match(section):
            found.append(f"{archive}: {name} is data that can be written ({section})")
    return sorted(set(found))


PLANTED = {
    "malloc": "#include <stdlib.h>\nvoid *oc_a(void);\nvoid *oc_a(void) { return malloc(3); }",
    "puts": "#include <stdio.h>\nvoid oc_a(void);\nvoid oc_a(void) { puts(\"x\"); }",
    "clock_gettime": "#include <time.h>\nvoid oc_a(struct timespec *t);\n"
                     "void oc_a(struct timespec *t) { clock_gettime(CLOCK_REALTIME, t); }",
    "helper": "int helper(void);\nint helper(void) { return 3; }",
    "counter": "int oc_a(void);\nint oc_a(void) { static int counter; return ++counter; }",
}
LEGAL = "#include <math.h>\n#include <string.h>\ndouble oc_a(double x, char *p, unsigned n);\n" \
        "static const char *const names[] = {\"a\", \"b\"};\nconst char *oc_b(int i);\n" \
        "const char *oc_b(int i) { return names[i]; }\n" \
        "double oc_a(double x, char *p, unsigned n) { memset(p, 3, n); return atan2(x, sin(x)); }"


def self_test(nm, cc):
    failed = []
    with tempfile.TemporaryDirectory() as scratch:
        for name, text in {**PLANTED, "": LEGAL}.items():
            source, obj, archive = (pathlib.Path(scratch) / f"t{name}.{e}" for e in ("c", "o", "a"))
            source.write_text(text + "\n")
            subprocess.run([cc, "-D_GNU_SOURCE", "-O1", "-c", source, "-o", obj], check=True)
            subprocess.run(["ar", "rc", archive, obj], check=True)
            found = check_archive(nm, str(archive))
            if bool(name) != bool(found) or (name and not any(name in line.split(": ", 1)[1] for line in found)):
                failed.append(f"self-test: wrong verdict on '{name or 'legal code'}': {found}")
    return failed


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--nm", default="nm")
    parser.add_argument("--self-test", metavar="CC")
    parser.add_argument("archives", nargs="*")
    options = parser.parse_args()
    if options.self_test:
        found = self_test(options.nm, options.self_test)
    else:
        found = [line for archive in options.archives for line in check_archive(options.nm, archive)]
        if not options.archives:
            found = ["symbols.py: no archive given"]
    print("\n".join(found) if found else "every symbol is on the list")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
