#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Bounds the stack that lib/core and lib/vehicle take: each function alone, and the deepest chain of calls.

stack.py BUILD_DIR           compiles the two libraries as the build does and holds them against the limits
stack.py --self-test CC      plants violations and fails unless each is found

A chain is a way through the calls that the compiler reports, sizes added up; what it calls outside (libm, mem*, the
assert handler) counts as EXTERNAL_BYTES. A call through a pointer counts as the worst of the functions whose address is
taken, and of the static ones that nobody calls by name. Recursion and stack of unknown size are violations.
"""
import argparse
import json
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

MAX_FUNCTION_BYTES = 32 * 1024
MAX_CHAIN_BYTES = 32 * 1024
EXTERNAL_BYTES = 1024
N_SHOWN = 10

NODE = re.compile(r'^node: \{ title: "([^"]+)" label: "([^"]*)"')
EDGE = re.compile(r'^edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"')
RELOCATION = re.compile(r"^[0-9a-f]+ +(R_\w+) +(\w+)", re.MULTILINE)
SIZE = re.compile(r"\\n(\d+) bytes \(([a-z,]+)\)")
INDIRECT = "__indirect_call"


class Graph:
    """Functions with their bytes, and who calls whom. Static functions are told apart by their object file."""

    def __init__(self):
        self.bytes, self.calls, self.unbounded, self.referred = {}, {}, [], set()

    def read(self, path, unit):
        text = path.read_text()

        def name_of(title):  # "file.c:name" when static
            return f"{title.rsplit('/', 1)[-1]} in {unit}" if ":" in title else title

        for line in text.splitlines():
            node, edge = NODE.match(line), EDGE.match(line)
            if node and (size := SIZE.search(node.group(2))):
                name = name_of(node.group(1))
                self.bytes[name] = int(size.group(1))
                self.calls.setdefault(name, set())
                if size.group(2) == "dynamic":
                    self.unbounded.append(name)
            elif edge:
                self.calls.setdefault(name_of(edge.group(1)), set()).add(name_of(edge.group(2)))

    def resolve_pointers(self):
        """A call through a pointer may reach whatever is referred to without being called."""
        called = set().union(*self.calls.values()) if self.calls else set()
        open_ended = {name for name in self.bytes if name not in called and " in " in name}
        open_ended |= self.referred & set(self.bytes)
        for targets in self.calls.values():
            if INDIRECT in targets:
                targets.remove(INDIRECT)
                targets |= open_ended

    def deepest(self):
        """{function: (bytes of its deepest chain, next function or None)} and the functions that recurse."""
        depth, loops = {}, set()

        def visit(name, above):
            if name in above:
                loops.add(name)
                return 0
            if name not in self.bytes:
                return EXTERNAL_BYTES
            if name not in depth:
                best, best_next = 0, None
                for target in sorted(self.calls[name]):
                    below = visit(target, above | {name})
                    if below > best:
                        best, best_next = below, target
                depth[name] = (self.bytes[name] + best, best_next)
            return depth[name][0]

        for name in sorted(self.bytes):
            visit(name, frozenset())
        return depth, loops


def chain_text(graph, depth, name):
    parts = []
    while name:
        parts.append(f"{name.split(' in ')[0]} {graph.bytes.get(name, EXTERNAL_BYTES)}")
        name = depth[name][1] if name in depth else None
    return " > ".join(parts)


def judge(graph):
    """Violations, and lines that describe what there is."""
    graph.resolve_pointers()
    depth, loops = graph.deepest()
    found = [f"{name} takes {size} bytes, more than {MAX_FUNCTION_BYTES}"
             for name, size in sorted(graph.bytes.items()) if size > MAX_FUNCTION_BYTES]
    found += [f"{name} takes stack without a bound" for name in sorted(graph.unbounded)]
    found += [f"{name} calls itself, directly or through others" for name in sorted(loops)]
    largest = sorted(graph.bytes.items(), key=lambda item: -item[1])[:N_SHOWN]
    shown = ["largest functions:"] + [f"  {size:6} {name}" for name, size in largest]
    if not depth:
        return ["no function was found"], shown
    worst = max(depth, key=lambda name: depth[name][0])
    shown += [f"deepest chain, {depth[worst][0]} bytes:", "  " + chain_text(graph, depth, worst)]
    if depth[worst][0] > MAX_CHAIN_BYTES:
        found.append(f"the chain from {worst} takes {depth[worst][0]} bytes, more than {MAX_CHAIN_BYTES}")
    return found, shown


def compile_into(graph, command, directory, out, unit):
    out.mkdir(parents=True)
    subprocess.run(command + ["-fcallgraph-info=su", "-o", out / "unit.o"], check=True, cwd=directory)
    for path in out.glob("*.ci"):
        graph.read(path, unit)
    relocations = subprocess.run(["objdump", "-r", out / "unit.o"], check=True, capture_output=True, text=True).stdout
    graph.referred |= {name for kind, name in RELOCATION.findall(relocations) if "PLT32" not in kind}  # those are calls


def read_build(build):
    """The graph of everything that the build compiles for the two libraries."""
    graph = Graph()
    entries = json.loads((build / "compile_commands.json").read_text())
    with tempfile.TemporaryDirectory() as scratch:
        for number, entry in enumerate(entries):
            command = shlex.split(entry["command"])
            if "ccache" in pathlib.Path(command[0]).name:  # which does not know the option
                command = command[1:]
            at = command.index("-o")
            unit = command[at + 1]
            if not re.search(r"\boutcrop_(core|vehicle)\.dir/", unit):
                continue
            compile_into(graph, command[:at] + command[at + 2:], entry["directory"],
                         pathlib.Path(scratch) / str(number), pathlib.Path(unit).name)
    return graph


USE = "void use(char *p);\n"
BIG = "static __attribute__((noinline)) void {0}(int n) {{ char a[{1}]; a[n] = 0; use(a); {2} }}\n"
PLANTED = {
    "more than 32768": USE + BIG.format("f", 40000, "") + "void oc_a(int n) { f(n); }\n",
    "the chain from": USE + BIG.format("g", 20000, "") + BIG.format("f", 20000, "g(n + 1);") +
                      "void oc_a(int n) { f(n); }\n",
    "chain from oc_a": USE + BIG.format("f", 20000, "") + "void (*const table[])(int) = {f};\n" +
                       "void oc_a(int n) { char a[20000]; use(a); table[n](n); use(a); }\n",
    "chain from oc_b": USE + "void oc_g(int n);\nvoid oc_f(int n) { char a[20000]; a[n] = 0; use(a); }\n" +
                       "void (*const table[])(int) = {oc_f, oc_g};\n" +
                       "void oc_b(int n) { char a[20000]; use(a); table[n](n); use(a); }\n",
    "calls itself": USE + "int oc_a(int n) { char a[9]; use(a); return n ? oc_a(n - a[1]) + a[0] : 0; }\n",
    "without a bound": USE + "void oc_a(int n) { char a[n]; use(a); }\n",
}
LEGAL = USE + BIG.format("g", 10000, "") + BIG.format("f", 10000, "g(n + 1);") + "void oc_a(int n) { f(n); }\n"


def self_test(cc):
    failed = []
    with tempfile.TemporaryDirectory() as scratch:
        for number, (expected, text) in enumerate({**PLANTED, "": LEGAL}.items()):
            source = pathlib.Path(scratch) / f"t{number}.c"
            source.write_text(text)
            graph = Graph()
            compile_into(graph, [cc, "-O2", "-c", source], scratch, pathlib.Path(scratch) / f"o{number}", "t.o")
            found, _ = judge(graph)
            if bool(found) != bool(expected) or not all(expected in line for line in found[:1]):
                failed.append(f"self-test: wrong verdict on '{expected or 'legal code'}': {found}")
    return failed


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--self-test", metavar="CC")
    parser.add_argument("build", nargs="?", type=pathlib.Path)
    options = parser.parse_args()
    if options.self_test:
        found = self_test(options.self_test)
    else:
        found, shown = judge(read_build(options.build))
        print("\n".join(shown))
    print("\n".join(found) if found else "the stack is within its limits")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
