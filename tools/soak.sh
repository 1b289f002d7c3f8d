#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Runs outcropd for a while on a site folder paced in real time, and holds its memory, heap calls, CPU and latency against
# bounds: soak.sh [--seconds S] [--json FILE]. Ten minutes if not told; see tools/soak/soak.py.
set -euo pipefail
cd "$(dirname "$0")/.."
tools/build.sh release outcropd outcrop-soak-peer outcrop_alloc_counts >/dev/null
# A private network: nothing that is sent leaves it.
exec unshare --user --map-root-user --net /usr/bin/python3 tools/soak/soak.py --bin build/bin "$@"
