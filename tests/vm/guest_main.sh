#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# First process on the virtual machine's real root: loads modules, runs the command (under systemd when asked), switches off.
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8
. /.control/guest.conf # kernel, version, share, modules, with_systemd
exec </dev/null >/dev/console 2>&1

note() { read -r uptime _ </proc/uptime; echo "vmrun: $1 at $uptime s"; }

load_modules() {
    # The kernel asks for modules by itself as well (file systems, algorithms).
    printf '#!/bin/sh\nexec /sbin/modprobe -d %q "$@"\n' "$kernel" >/run/modprobe
    chmod +x /run/modprobe
    echo /run/modprobe >/proc/sys/kernel/modprobe
    local module
    for module in "${modules[@]}"; do
        # shellcheck disable=SC2086 # a module and its parameters
        /run/modprobe $module || note "modprobe $module FAILED"
    done
    # configfs is a module too: only now can it be mounted.
    [ ! -d /sys/kernel/config ] || mount -t configfs none /sys/kernel/config
    mount -t debugfs none /sys/kernel/debug
}

run_under_systemd() {
    mkdir -p /run/systemd/system
    printf '%s\n' '[Unit]' 'DefaultDependencies=no' 'Requires=vmrun.service' 'After=vmrun.service' \
        >/run/systemd/system/vmrun.target
    printf '%s\n' '[Unit]' 'DefaultDependencies=no' 'Wants=systemd-udevd.service' 'After=systemd-udevd.service' '[Service]' \
        'Type=oneshot' 'ExecStart=/bin/bash /.control/guest_command.sh' >/run/systemd/system/vmrun.service
    echo 0123456789abcdef0123456789abcdef >/run/machine-id
    exec /lib/systemd/systemd --unit=vmrun.target --log-target=console --show-status=false
}

busybox stty -F /dev/ttyS1 raw -echo
ip link set lo up
ip route add 224.0.0.0/4 dev lo # LCM's multicast
note "userland"
load_modules
note "modules"
[ "$with_systemd" = no ] || run_under_systemd
exec bash /.control/guest_command.sh
