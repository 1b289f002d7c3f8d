#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""outcropd in a virtual machine with real drivers: cameras, GPIO lines, systemd. One boot per group.

vm_test.py --build FOLDER --group vivid|usb|gpio|service    status 77, and a line that says why, where it cannot run
"""
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
SITE = HERE.parent / "data/sites/depot"
PROGRAMS = ("qemu-system-x86_64", "busybox", "cpio", "xz", "modprobe", "v4l2-ctl", "udevadm", "systemctl")
USB = ("uvcvideo nodrop=1", "dummy_hcd", "gadgetfs")  # nodrop: damaged frames come through, flagged

# Modules, and whether systemd and udevd are wanted.
GROUPS = {"vivid": (("vivid n_devs=2 node_types=0x1,0x1",), False), "usb": (USB, True),
          "gpio": ((*USB, "gpio-sim"), True), "service": (USB, True)}


def skip(reason):
    print(f"vm: SKIPPED: {reason}", flush=True)
    sys.exit(77)


def kernel_folder():
    done = subprocess.run([HERE / "kernel.sh"], stdout=subprocess.PIPE, text=True)
    if done.returncode == 77:
        sys.exit(77)  # it has said why
    if done.returncode != 0:
        sys.exit(1)
    return pathlib.Path(done.stdout.strip())


def make_frames(build, folder):
    """The site's pictures as the USB camera sends them."""
    folder.mkdir()
    pictures = sorted((SITE / "images").glob("*.jpg"))
    subprocess.run([build / "tests/bin/vm_make_frames", folder, *pictures], check=True)
    for k, picture in enumerate(pictures):
        shutil.copy(picture, folder / f"{k}.jpg")


def install(build, folder):
    subprocess.run(["cmake", "--install", build], check=True, stdout=subprocess.DEVNULL,
                   env={**os.environ, "DESTDIR": str(folder)})


def machine(build, group, scratch):
    """Command line of vmrun.py."""
    modules, with_systemd = GROUPS[group]
    command = [HERE / "vmrun.py", "--kernel", kernel_folder(), "--seconds", "900"]
    for module in modules:
        command += ["--module", module]
    for folder in (HERE.parent.parent, build, scratch):
        command += ["--visible", folder]
    if with_systemd:
        command += ["--systemd"]
    return [*command, "--", "env", f"OUTCROP_VM_INSTALLED={scratch / 'installed'}", "PYTHONDONTWRITEBYTECODE=1",
            HERE / "guest_scenarios.py", group, build, SITE, scratch / "frames"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--group", choices=GROUPS, required=True)
    options = parser.parse_args()
    os.environ["PATH"] += ":/usr/sbin:/sbin"
    missing = [program for program in PROGRAMS if not shutil.which(program)]
    if missing:
        skip(f"not installed: {', '.join(missing)}")
    build = options.build.resolve()
    with tempfile.TemporaryDirectory(prefix="outcrop-vm-test.") as name:
        scratch = pathlib.Path(name)
        scratch.chmod(0o755)
        make_frames(build, scratch / "frames")
        if options.group == "service":
            install(build, scratch / "installed")
        return subprocess.run(list(map(str, machine(build, options.group, scratch)))).returncode


if __name__ == "__main__":
    sys.exit(main())
