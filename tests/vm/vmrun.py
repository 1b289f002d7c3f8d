#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Boots a throw-away virtual machine, runs one command in it and returns its output and exit status.

vmrun.py --kernel FOLDER [options] -- COMMAND ARGUMENT...

QEMU without KVM, one CPU whose clock counts instructions (a busy host slows it down and loses no frame). The host's
root is there, read-only; the network is lo alone. FOLDER comes from kernel.sh. Exit status: the command's, 124 when the
time is over, 125 when the machine did not come up, 126 when the kernel complained (BUG, WARNING, Oops ...).
"""
import argparse
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import threading

HERE = pathlib.Path(__file__).resolve().parent
GUEST = ("guest_main.sh", "guest_command.sh")
COMPLAINT = re.compile(r"BUG:|WARNING: CPU|Oops|general protection|soft lockup|rcu_.*stall|Kernel panic|vmrun: .*FAILED")


def parse(arguments):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kernel", type=pathlib.Path, required=True, help="what kernel.sh printed")
    parser.add_argument("--module", action="append", default=[], help='to load, with parameters: "vivid n_devs=2"')
    parser.add_argument("--share", type=pathlib.Path, help="folder that the machine may write to, under the same path")
    parser.add_argument("--visible", action="append", default=[], type=pathlib.Path,
                        help="folder below /tmp, /run or /mnt that the machine shall see as well")
    parser.add_argument("--systemd", action="store_true", help="systemd and udevd; /etc, /usr and /var may be written to")
    parser.add_argument("--seconds", type=int, default=300, help="wall time after which it is given up")
    parser.add_argument("--memory", type=int, default=1024, help="MiB")
    parser.add_argument("--verbose", action="store_true", help="the console and the kernel's messages on stderr")
    parser.add_argument("command", nargs="+")
    return parser.parse_args(arguments)


def module_files(kernel, names):
    """Files of modules and of what they need, in the order to load them."""
    files = []
    for name in names:
        told = subprocess.run(["/sbin/modprobe", "-d", kernel, "-S", kernel.name, "--show-depends", name],
                              capture_output=True, text=True, check=True).stdout
        for line in told.splitlines():
            kind, path = line.split()[:2]
            if kind == "insmod" and path not in files:
                files.append(path)
    return files


def make_initial_disk(scratch, settings, modules):
    """busybox, the modules that mount the root, and guest_init.sh."""
    root = scratch / "initial"
    for folder in ("bin", "sbin", "proc", "sys", "dev", "new", "modules"):
        (root / folder).mkdir(parents=True)
    shutil.copy(shutil.which("busybox"), root / "bin/busybox")
    shutil.copy(HERE / "guest_init.sh", root / "init")
    (root / "init").chmod(0o755)
    (root / "guest.conf").write_text(settings)
    names = []
    for path in map(pathlib.Path, modules):
        name = path.name.removesuffix(".xz")
        data = path.read_bytes()
        if path.suffix == ".xz":
            data = subprocess.run(["xz", "-dc"], input=data, capture_output=True, check=True).stdout
        (root / "modules" / name).write_bytes(data)
        names.append(name + "\n")
    (root / "modules/list").write_text("".join(names))
    listing = "\n".join(str(path.relative_to(root)) for path in sorted(root.rglob("*")))
    archive = subprocess.run(["cpio", "-o", "-H", "newc", "--quiet"], input=listing.encode(), cwd=root,
                             capture_output=True, check=True).stdout
    (scratch / "initrd").write_bytes(archive)


def settings_of(options):
    """Shell variables of guest_init.sh and guest_main.sh."""
    def array(words):
        return "(" + " ".join(shlex.quote(str(word)) for word in words) + ")"

    overlay = "etc usr var" if options.systemd else ""
    init = (f"visible={shlex.quote(' '.join(map(str, [*options.visible, options.kernel])))}\n"
            f"share={shlex.quote(str(options.share or ''))}\noverlay='{overlay}'\n")
    main = (f"kernel={shlex.quote(str(options.kernel))}\nshare={shlex.quote(str(options.share or ''))}\n"
            f"modules={array(options.module)}\nwith_systemd={'yes' if options.systemd else 'no'}\n"
            f"command={array(options.command)}\n")
    return init, main


def qemu_command(options, scratch):
    version = options.kernel.name
    command = ["qemu-system-x86_64", "-accel", "tcg,thread=single", "-icount", "shift=1,sleep=on", "-cpu", "Nehalem",
               "-smp", "1", "-m", str(options.memory), "-nodefaults", "-no-user-config", "-no-reboot", "-display", "none",
               "-nic", "none", "-monitor", "none", "-kernel", options.kernel / f"boot/vmlinuz-{version}",
               "-initrd", scratch / "initrd",
               "-append", "console=ttyS0 panic=-1 quiet loglevel=4 mitigations=off random.trust_cpu=on",
               "-serial", f"file:{scratch / 'console'}", "-serial", "file:/dev/stdout",
               "-virtfs", "local,path=/,mount_tag=host,security_model=none,readonly=on,multidevs=remap",
               "-virtfs", f"local,path={scratch / 'control'},mount_tag=control,security_model=none"]
    if options.share:
        command += ["-virtfs", f"local,path={options.share},mount_tag=share,security_model=none,multidevs=remap"]
    return list(map(str, command))


def copy_stream(source, out):
    while data := source.read1(65536):
        out.buffer.write(data)
        out.buffer.flush()


def run_machine(command, seconds, log):
    """True when it ended by itself."""
    with open(log, "wb") as errors:
        machine = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=errors)
    reader = threading.Thread(target=copy_stream, args=(machine.stdout, sys.stdout))
    reader.start()
    try:
        machine.wait(timeout=seconds)
        return True
    except subprocess.TimeoutExpired:
        return False
    finally:
        machine.kill()
        machine.wait()
        reader.join()


def text_of(path):
    return path.read_text(errors="replace").replace("\r", "") if path.exists() else ""


def verdict(options, scratch, ended):
    """Exit status, and what there is to say on stderr."""
    console, kernel = text_of(scratch / "console"), text_of(scratch / "control/dmesg")
    status = text_of(scratch / "control/status").strip()
    complaints = [line for line in (kernel + console).splitlines() if COMPLAINT.search(line)]
    for line in complaints[:5]:
        print(f"vmrun: KERNEL COMPLAINT: {line}", file=sys.stderr)
    if options.verbose or complaints or not status:
        print(f"{text_of(scratch / 'qemu')}--- console\n{console[-20000:]}--- kernel\n{kernel[-20000:]}", file=sys.stderr)
    if not ended:
        print(f"vmrun: not done within {options.seconds} s", file=sys.stderr)
        return 124
    if not status:
        return 125
    return int(status) or (126 if complaints else 0)


def main():
    options = parse(sys.argv[1:])
    options.kernel = options.kernel.resolve()
    with tempfile.TemporaryDirectory(prefix="outcrop-vm.") as name:
        scratch = pathlib.Path(name)
        (scratch / "control").mkdir()
        init_settings, main_settings = settings_of(options)
        needed = ["virtio_pci", "9pnet_virtio", "9p"] + (["overlay"] if options.systemd else [])
        make_initial_disk(scratch, init_settings, module_files(options.kernel, needed))
        for script in GUEST:
            shutil.copy(HERE / script, scratch / "control" / script)
        (scratch / "control/guest.conf").write_text(main_settings)
        ended = run_machine(qemu_command(options, scratch), options.seconds, scratch / "qemu")
        sys.stdout.flush()
        return verdict(options, scratch, ended)


if __name__ == "__main__":
    sys.exit(main())
