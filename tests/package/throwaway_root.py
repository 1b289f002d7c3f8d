# SPDX-License-Identifier: BSD-3-Clause
"""This machine's system to play with: an overlay over /, kept in memory, seen only in mount namespaces of a test's own."""
import os
import pathlib
import shutil
import stat
import subprocess
import sys


def namespaces_fault():
    """Why there is no such thing here, or None."""
    if os.geteuid() != 0:
        return "only root can install a package"
    done = subprocess.run(["unshare", "--mount", "--pid", "--fork", "--net", "--ipc", "--uts", "--propagation", "private",
                           "true"], capture_output=True, text=True)
    return None if done.returncode == 0 else f"no namespaces: {done.stderr.strip()}"


def mount_namespace():
    return os.readlink("/proc/self/ns/mnt")


class Root:
    """To be made inside the namespaces: what is mounted goes with them. outer: mount_namespace() outside."""

    def __init__(self, scratch, outer, skip):
        if mount_namespace() == outer:
            sys.exit("this would mount over the machine's own folders")
        self.top = scratch / "top"
        self.path = self.top / "root"
        self.upper = self.top / "upper"
        self.top.mkdir()
        self.mount("-t", "tmpfs", "-o", "size=256m,mode=755", "top", self.top)
        for folder in (self.path, self.upper, self.top / "work"):
            folder.mkdir()
        done = subprocess.run(["mount", "-t", "overlay", "overlay", "-o",
                               f"lowerdir=/,upperdir={self.upper},workdir={self.top / 'work'}", self.path],
                              capture_output=True, text=True)
        if done.returncode != 0:
            skip(f"no overlay over /: {done.stderr.strip()}")
        if not (self.path / "usr/bin/dpkg").exists() or not (self.path / "var/lib/dpkg/status").exists():
            skip("/usr or /var is a file system of its own, an overlay over / does not have it")
        self.furnish()

    @staticmethod
    def mount(*arguments):
        subprocess.run(["mount", *map(str, arguments)], check=True)

    def furnish(self):
        """Nothing of the running system's: its own processes, devices that do nothing, an empty /run."""
        self.mount("-t", "proc", "proc", self.path / "proc")
        self.mount("-t", "sysfs", "-o", "ro", "sys", self.path / "sys")
        for folder in ("run", "tmp", "dev"):
            self.mount("-t", "tmpfs", "-o", "mode=755", folder, self.path / folder)
        (self.path / "tmp").chmod(0o1777)
        for name, minor in (("null", 3), ("zero", 5), ("random", 8), ("urandom", 9)):
            os.mknod(self.path / "dev" / name, 0o666 | stat.S_IFCHR, os.makedev(1, minor))
            (self.path / "dev" / name).chmod(0o666)

    def call(self, *command):
        environment = {"PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL": "C.UTF-8",
                       "HOME": "/", "DEBIAN_FRONTEND": "noninteractive", "SYSTEMD_PAGER": "", "SYSTEMD_COLORS": "0"}
        return subprocess.run(["chroot", self.path, *command], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              env=environment)

    def status(self, *command):
        return self.call(*command).returncode

    def said(self, *command):
        done = self.call(*command)
        return done.returncode, (done.stdout + done.stderr).strip()

    def run(self, *command):
        done = self.call(*command)
        if done.returncode != 0:
            sys.exit(f"{' '.join(command)}: status {done.returncode}: {(done.stdout + done.stderr).strip()}")
        return done.stdout.strip()

    def dpkg(self, *arguments):
        """Without other packages' triggers, which have nothing to do with ours and take their time."""
        return self.run("dpkg", "--no-triggers", *arguments)

    def take(self, file):
        """Its path in the root, in the /tmp that is no part of the overlay."""
        shutil.copy(file, self.path / "tmp")
        return f"/tmp/{file.name}"

    def lines(self, path):
        return (self.path / path).read_text().splitlines()

    def written(self):
        """What the overlay holds: (path, lstat), folders' content too."""
        for folder, folders, files in os.walk(self.upper):
            for name in folders + files:
                path = pathlib.Path(folder) / name
                yield str(path.relative_to(self.upper)), path.lstat()

    @staticmethod
    def is_whiteout(found):
        return stat.S_ISCHR(found.st_mode) and found.st_rdev == 0

    def new_paths(self):
        return sorted(path for path, found in self.written()
                      if not self.is_whiteout(found) and not os.path.lexists(f"/{path}"))

    def lost_paths(self):
        return sorted(path for path, found in self.written() if self.is_whiteout(found) and os.path.lexists(f"/{path}"))
