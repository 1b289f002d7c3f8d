#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Man pages format without a warning and name the very options the programs have: manual.py --source DIR --bin DIR

Planted faults in copies of the pages have to be found.
"""
import argparse
import pathlib
import re
import shutil
import subprocess
import sys

SUBCOMMANDS = ("live", "replay", "recall")
n_checks = 0


def check(condition, *what):
    global n_checks
    n_checks += 1
    if not condition:
        sys.exit("manual: " + " ".join(str(w) for w in what))


def warnings(page):
    done = subprocess.run(["groff", "-mandoc", "-ww", "-Tutf8"], input=page, capture_output=True, text=True)
    return done.stderr + ("" if done.returncode == 0 else f"exit status {done.returncode}")


def options_of_page(page):
    """Those with an item of their own, where they are explained: {subcommand or "": {options}}."""
    found, section = {"": set()}, ""
    for line in page.splitlines():
        if line.startswith(".Ss ") and line[4:] in SUBCOMMANDS:
            section = line[4:]
            found[section] = set()
        elif line.startswith(".Sh "):
            section = ""
        elif line.startswith(".It "):
            for flag in re.findall(r"\bFl (\S+)", line):
                found[section].add("-" + flag)
    return found


def options_of_synopsis(page):
    synopsis = page.split(".Sh SYNOPSIS\n")[1].split(".Sh ")[0]
    return {"-" + flag for flag in re.findall(r"\bFl (\S+)", synopsis)}


def options_of_help(text):
    """At the beginning of a line, "-h,--help" or "-h, --help" or "--help"."""
    found = set()
    for line in text.splitlines():
        listed = re.match(r"\s+((?:-\w,\s*)?--[a-z][a-z-]*)", line)
        if listed:
            found.update(re.findall(r"--?[A-Za-z][a-z-]*", listed[1]))
    return found


def help_of(program, *subcommand):
    done = subprocess.run([program, *subcommand, "--help"], capture_output=True, text=True)
    check(done.returncode == 0, program.name, *subcommand, "--help fails:", done.stderr)
    return done.stdout


def difference(page, told):
    """told: {subcommand or "": help}."""
    listed = options_of_page(page)
    wrong = [f"the program has no subcommand {name}" for name in sorted(listed.keys() - told.keys())]
    for name, text in told.items():
        of_help, of_page = options_of_help(text), listed.get(name, set())
        if name:  # said once, for all
            of_help -= {"-h", "--help"}
        wrong += [f"{name} {option} is not in the page" for option in sorted(of_help - of_page)]
        wrong += [f"{name} {option} is not in --help" for option in sorted(of_page - of_help)]
    everything = set().union(*map(options_of_help, told.values()))
    wrong += [f"{option} of the synopsis is not in --help" for option in sorted(options_of_synopsis(page) - everything)]
    return wrong


def check_options(page, told):
    wrong = difference(page, told)
    check(not wrong, "; ".join(wrong))
    for name, text in told.items():
        check(len(options_of_help(text)) >= 2, "no options seen in --help of", name)
    item = ".It Fl -check\n"
    check(item in page, "no item to take out")
    for planted in (page.replace(item, item + ".It Fl -checks\n", 1), page.replace(item, "", 1),
                    page.replace(".Op Fl -check\n", ".Op Fl -chick\n", 1)):
        check(difference(planted, told), "a planted difference is not seen")


def check_page(page):
    said = warnings(page)
    check(said == "", said)
    check(".Sh NAME" in page and ".Nd " in page, "no name")
    check(warnings(page + ".Bl -tag\n.Xyzzy\n") != "", "a planted fault is not seen")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--source", type=pathlib.Path, required=True)
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    options = parser.parse_args()
    folder = options.source / "docs/man"
    vehicle, base = options.bin / "outcropd", options.bin / "outcrop-base"
    check_options((folder / "outcropd.8").read_text(), {"": help_of(vehicle)})
    told = {name: help_of(base, *name.split()) for name in ("", *SUBCOMMANDS)}
    listed = set(re.findall(r"^  (\w+) {2,}\S", told[""].split("Subcommands:")[1], re.M))
    check(listed == set(SUBCOMMANDS), "subcommands are", sorted(listed))
    check_options((folder / "outcrop-base.8").read_text(), told)
    if not shutil.which("groff"):
        print("manual: SKIPPED: groff is not installed")
        sys.exit(77)
    pages = sorted([*folder.glob("*.5"), *folder.glob("*.8")])
    check(len(pages) >= 3, "pages:", pages)
    for page in pages:
        check_page(page.read_text())
    print(f"manual: {n_checks} checks")


if __name__ == "__main__":
    main()
