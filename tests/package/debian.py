#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The Debian package, made and installed for real: debian.py --source DIR --build DIR --cpack PROGRAM

This machine's own system is seen through an overlay in a namespace of its own, where the package is installed, used, put
over itself, removed and purged. All that is written there is gone at the end. Status 77 where that cannot be had.
"""
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

from throwaway_root import Root, mount_namespace, namespaces_fault

PROGRAMS = ("outcropd", "outcrop-base", "outcrop-drive", "outcrop-eval", "outcrop-pose-replay")
FILES = {
    "/etc/outcrop/outcropd.yaml", "/usr/lib/systemd/system/outcropd.service", "/usr/lib/sysusers.d/outcrop.conf",
    "/usr/lib/udev/rules.d/60-outcrop.rules", "/usr/share/doc/outcrop/LICENSE", "/usr/share/doc/outcrop/copyright",
    "/usr/share/doc/outcrop/operating.md", "/usr/share/doc/outcrop/examples/outcropd.yaml",
    "/usr/share/man/man5/outcropd.yaml.5", "/usr/share/man/man8/outcropd.8", "/usr/share/man/man8/outcrop-base.8",
    "/usr/share/outcrop/lcmtypes/packet_t.lcm", *(f"/usr/bin/{program}" for program in PROGRAMS),
}
UNIT = "outcropd.service"
CONFIG = "etc/outcrop/outcropd.yaml"
# What dpkg and the tools round it keep for themselves.
BOOKS = ("var/lib/dpkg/", "var/log/", "var/cache/", "etc/.pwd.lock", "etc/passwd-", "etc/group-", "etc/shadow-",
         "etc/gshadow-", "etc/subuid-", "etc/subgid-")
ACCOUNTS = ("passwd", "group", "shadow", "gshadow")

n_checks = 0


def check(condition, *what):
    global n_checks
    n_checks += 1
    if not condition:
        sys.exit("debian: " + " ".join(str(w) for w in what))


def skip(why):
    print(f"debian: SKIPPED: {why}", flush=True)
    sys.exit(77)


def make_package(cpack, build, folder):
    done = subprocess.run([cpack, "--config", build / "CPackConfig.cmake", "-G", "DEB", "-B", folder],
                          capture_output=True, text=True)
    check(done.returncode == 0, "cpack:", done.stdout[-2000:], done.stderr[-2000:])
    made = list(folder.glob("*.deb"))
    check(len(made) == 1, "packages made:", made)
    return made[0]


def field(package, name):
    return subprocess.run(["dpkg-deb", "-f", package, name], capture_output=True, text=True, check=True).stdout.strip()


def check_control(package):
    check(field(package, "Package") == "outcrop", "its name is", field(package, "Package"))
    depends = field(package, "Depends")
    for library in ("libc6", "libgpiod2", "libcyaml1", "libopencv-core"):
        check(library in depends, "does not depend on", library, "but on", depends)
    check("libgtest" not in depends and "-dev" not in depends, "depends on what tests and builds need:", depends)
    listed = subprocess.run(["dpkg-deb", "-c", package], capture_output=True, text=True, check=True).stdout.splitlines()
    paths = {line.split(" ./", 1)[1].rstrip("/"): line for line in listed if " ./" in line}
    files = {"/" + path for path, line in paths.items() if not line.startswith("d")}
    check(FILES <= files, "missing:", sorted(FILES - files))
    extra = {path for path in files - FILES if path.startswith("/usr/bin/") or "bench" in path or "soak" in path}
    check(not extra, "should stay at home:", sorted(extra))
    for path, line in paths.items():
        check(" root/root " in line and line[5] == "-" and line[8] == "-", "somebody else may write to it:", line)


def check_account(root, before):
    groups = set(root.run("id", "-nG", "outcrop").split())
    check({"outcrop", "video", "gpio"} <= groups, "groups of outcrop:", groups)
    for name in ACCOUNTS:
        lost = set(before[name]) - set(root.lines(f"etc/{name}"))
        check(all(line.startswith(("video:", "gpio:")) for line in lost), "accounts of others changed:", lost)


def check_unit(root):
    check(root.status("systemctl", "is-enabled", "--quiet", UNIT) != 0, "enabled without being asked")
    said = root.said("systemd-analyze", "verify", f"/usr/lib/systemd/system/{UNIT}")
    check(said == (0, ""), "verify, man pages included:", said)
    status, said = root.said("systemd-analyze", "security", "--offline=true", "--threshold=20",
                             f"/usr/lib/systemd/system/{UNIT}")
    check(status == 0, "too exposed:", said[-200:])


def check_rules(root):
    """udev reads the rules, and those of the examples, without complaint."""
    text = (root.path / "usr/lib/udev/rules.d/60-outcrop.rules").read_text()
    examples = [line[1:] for line in text.splitlines() if line.startswith("#SUBSYSTEM")]
    check(len(examples) >= 2 and all('ATTR{index}=="0"' in line for line in examples), "examples:", examples)
    mine = root.path / "etc/udev/rules.d/61-outcrop-cameras.rules"
    mine.write_text("\n".join(examples) + "\n")

    def complaints():
        _, said = root.said("udevadm", "test", "--action=add", "/sys/class/mem/null")
        check("60-outcrop.rules" in said, "udev did not read the rules:", said[-500:])
        return [line for line in said.splitlines() if "outcrop" in line and not line.startswith("Reading rules file:")]

    check(not complaints(), "udev says", complaints())
    mine.write_text('SUBSYSTEM=="gpio", ATTTR{index}=="0"\n')
    check(complaints(), "a planted fault in a rule is not seen")
    mine.unlink()


def check_use(root, source):
    """As the service's own user."""
    as_user = ("setpriv", "--reuid=outcrop", "--regid=outcrop", "--init-groups", "--no-new-privs")
    for program in PROGRAMS:
        check(root.status(program, "--help") == 0, program, "--help fails")
    version = root.run(*as_user, "outcropd", "--version")
    check(version.startswith("outcropd "), "version:", version)
    check(version.split()[1] == root.run("dpkg-query", "-W", "-f", "${Version}", "outcrop"), "version:", version)
    shutil.copytree(source / "tests/data/sites/depot", root.path / "srv/site")
    # The sample as it is installed, with another site; the rest is as the package has it.
    sample = (root.path / CONFIG).read_text()
    config = root.path / "srv/outcropd.yaml"
    config.write_text(sample.replace("tests/data/sites/depot", "/srv/site"))
    check("/srv/site" in config.read_text(), "the sample's site is another")
    said = root.said(*as_user, "outcropd", "--config", "/srv/outcropd.yaml", "--check")
    check(said[0] == 0, "--check of the sample:", said)
    config.write_text(sample.replace("vehicle: 1", "vehicle: 1000"))
    check(root.status(*as_user, "outcropd", "--config", "/srv/outcropd.yaml", "--check") == 1, "a fault is not told")
    for page in ("8", "outcropd"), ("8", "outcrop-base"), ("5", "outcropd.yaml"):
        check(root.status("man", "-w", *page) == 0, "no man page", *page)
    shutil.rmtree(root.path / "srv/site")
    config.unlink()


def check_reinstall(root, package):
    """What the operator wrote stays."""
    with open(root.path / CONFIG, "a") as config:
        config.write("# mine\n")
    accounts = {name: root.lines(f"etc/{name}") for name in ACCOUNTS}
    root.dpkg("-i", package)
    check(root.lines(CONFIG)[-1] == "# mine", "the configuration was overwritten")
    check(accounts == {name: root.lines(f"etc/{name}") for name in ACCOUNTS}, "accounts changed")
    changed = [line for line in root.said("dpkg", "-V", "outcrop")[1].splitlines() if CONFIG not in line]
    check(not changed, "dpkg -V:", changed)


def check_removed(root):
    """Enabled before: nothing may point to what is gone; the configuration stays until purged."""
    root.run("systemctl", "enable", "--quiet", UNIT)
    link = root.path / "etc/systemd/system/multi-user.target.wants" / UNIT
    check(link.is_symlink(), "was not enabled")
    state = root.path / "var/lib/outcrop"
    state.mkdir()
    (state / "junctions.json").write_text("{}\n")
    root.dpkg("-r", "outcrop")
    check(not link.is_symlink(), "still enabled")
    left = [path for path in FILES if os.path.lexists(root.path / path[1:])]
    check(left == ["/" + CONFIG], "left by removing:", left)
    check(state.exists(), "removing took what the service wrote")


def check_purged(root, before):
    root.dpkg("-P", "outcrop")
    check(root.status("dpkg-query", "-W", "outcrop") != 0, "dpkg still knows it")
    left = [path for path in root.new_paths() if not path.startswith(BOOKS)]
    check(not left, "left by purging:", left)
    gone = [path for path in root.lost_paths() if not path.startswith(BOOKS)]
    check(not gone, "taken from the system:", gone)
    for name in ACCOUNTS:  # the group gpio may be others' by now
        lines = [line for line in root.lines(f"etc/{name}") if not line.startswith("gpio:")]
        check(lines == [line for line in before[name] if not line.startswith("gpio:")], name, "is", lines)


def check_running(root, package):
    """Where systemd runs: what it is told, by a systemctl that writes down its arguments."""
    (root.path / "run/systemd/system").mkdir(parents=True)
    recorder = root.path / "usr/local/bin/systemctl"
    recorder.write_text('#!/bin/sh\necho "$*" >>/run/told\n')
    recorder.chmod(0o755)

    def told(*arguments):
        (root.path / "run/told").write_text("")
        root.dpkg(*arguments)
        return root.lines("run/told")

    installed = ["daemon-reload", f"try-restart {UNIT}"]
    for arguments, expected in ((("-i", package), installed), (("-i", package), installed),
                                (("-r", "outcrop"), [f"stop {UNIT}", f"disable --quiet {UNIT}", "daemon-reload"]),
                                (("-P", "outcrop"), ["daemon-reload"])):
        said = told(*arguments)
        check(said == expected, *arguments, "tells systemd", said)


def inside(scratch, outer, source):
    root = Root(scratch, outer, skip)
    if root.status("dpkg-query", "-W", "outcrop") == 0:
        skip("the package is installed on this machine")
    before = {name: root.lines(f"etc/{name}") for name in ACCOUNTS}
    package = root.take(next(scratch.glob("*.deb")))
    root.dpkg("-i", package)
    check_account(root, before)
    check_unit(root)
    check_rules(root)
    check_use(root, source)
    check_reinstall(root, package)
    check_removed(root)
    check_purged(root, before)
    check_running(root, package)
    print(f"debian: {n_checks} checks in the throw-away root")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--source", type=pathlib.Path, required=True)
    parser.add_argument("--build", type=pathlib.Path)
    parser.add_argument("--cpack")
    parser.add_argument("--inside", nargs=2, metavar=("DIR", "OUTER"),
                        help="of the test itself: go on in the namespaces, in this folder, which OUTER is not")
    options = parser.parse_args()
    os.environ["PATH"] += ":/usr/sbin:/sbin"
    if options.inside:
        inside(pathlib.Path(options.inside[0]), options.inside[1], options.source.resolve())
        return 0
    missing = [program for program in ("dpkg", "dpkg-deb", "dpkg-shlibdeps", "systemd-analyze", "udevadm", "man",
                                       "setpriv", "unshare") if not shutil.which(program)]
    if missing:
        skip(f"not installed: {', '.join(missing)}")
    with tempfile.TemporaryDirectory(prefix="outcrop-debian-test.") as name:
        scratch = pathlib.Path(name)
        package = make_package(options.cpack, options.build, scratch)
        check_control(package)
        print(f"debian: {n_checks} checks of the package, {package.stat().st_size} bytes", flush=True)
        fault = namespaces_fault()
        if fault:
            skip(fault)
        shutil.rmtree(scratch / "_CPack_Packages", ignore_errors=True)
        return subprocess.run(["unshare", "--mount", "--pid", "--fork", "--kill-child", "--net", "--ipc", "--uts",
                               "--propagation", "private", sys.executable, __file__, "--source", options.source,
                               "--inside", scratch, mount_namespace()]).returncode


if __name__ == "__main__":
    sys.exit(main())
