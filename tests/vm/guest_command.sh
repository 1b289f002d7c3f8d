#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# In the virtual machine: runs the command with its output on the second serial port, leaves its exit status and the
# kernel's messages in the control folder, switches off.
. /.control/guest.conf
cd "${share:-/tmp}" || exit 1
status=0
("${command[@]}") </dev/null >/dev/ttyS1 2>&1 || status=$?
busybox stty -F /dev/ttyS1 >/dev/null # waits until all is out
dmesg >/.control/dmesg
echo "$status" >/.control/status
sync
exec busybox poweroff -f
