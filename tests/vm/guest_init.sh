#!/bin/busybox sh
# SPDX-License-Identifier: BSD-3-Clause
# First process of the virtual machine, in its initial RAM disk: the host's root as a read-only tree, then guest_main.sh.
export PATH=/bin:/sbin
/bin/busybox --install -s /bin
. /guest.conf # visible, kernel, share, overlay

fail() { echo "vmrun: $*" >/dev/console; poweroff -f; }

mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
while read -r file; do insmod "/modules/$file" || fail "insmod $file"; done </modules/list

nine=trans=virtio,version=9p2000.L,msize=512000
mount -t tmpfs -o size=512m root /new
mkdir -p /new/.host /new/.control /new/.upper
mount -t 9p -o $nine,ro,cache=loose host /new/.host || fail "the host's root cannot be mounted"
mount -t 9p -o $nine,cache=none control /new/.control || fail "the control folder cannot be mounted"

# Changes to folders that overlay names stay in memory.
lay_over() {
    mkdir -p "/new/.upper/$1/up" "/new/.upper/$1/work" "/new/$1"
    mount -t overlay -o "lowerdir=/new/.host/$1,upperdir=/new/.upper/$1/up,workdir=/new/.upper/$1/work" over "/new/$1" ||
        fail "no overlay on /$1"
}
for entry in /new/.host/*; do
    name=${entry##*/}
    case $name in
        proc | sys | dev | run | tmp | mnt | lost+found) mkdir -p "/new/$name"; continue ;;
    esac
    case " $overlay " in
        *" $name "*) lay_over "$name"; continue ;;
    esac
    if [ -L "$entry" ]; then
        ln -s "$(readlink "$entry")" "/new/$name"
    elif [ -d "$entry" ]; then
        mkdir -p "/new/$name"
        mount -o bind "$entry" "/new/$name"
    fi
done
for folder in proc sys dev; do mount --move /$folder /new/$folder; done
mount -t tmpfs -o mode=1777 tmp /new/tmp
mount -t tmpfs -o mode=755 run /new/run
mkdir -p /new/dev/pts /new/dev/shm /new/run/lock
mount -t devpts pts /new/dev/pts
mount -t tmpfs -o mode=1777 shm /new/dev/shm

# What lies where the machine has its own folders (a tree below /tmp) comes through by name.
for folder in $visible; do
    case $folder in
        /tmp/* | /run/* | /mnt/*) mkdir -p "/new$folder" && mount -o bind "/new/.host$folder" "/new$folder" ;;
    esac
done
if [ -n "$share" ]; then
    mkdir -p "/new$share"
    mount -t 9p -o $nine,cache=none share "/new$share" || fail "$share cannot be mounted"
fi
exec switch_root /new /bin/bash /.control/guest_main.sh
