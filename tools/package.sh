#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Set-up, a release build of the programs, and the Debian package of them in build/package/: package.sh
set -euo pipefail
cd "$(dirname "$0")/.."
[ $# = 0 ] || { echo "usage: tools/package.sh" >&2; exit 1; }
tools/build.sh release outcropd outcrop-base outcrop-drive outcrop-eval outcrop-pose-replay
export PATH=/usr/bin:/bin:$PATH
cpack --config build/CPackConfig.cmake
