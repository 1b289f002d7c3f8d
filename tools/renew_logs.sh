#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Makes tests/data/logs anew: a captured clean drive over the depot, two broken copies of it, and what replaying each must
# give. renew_logs.sh [BUILD]
#
# Only while the wire's version is 0 (docs/protocol.md, section 8): then a change of the wire, or of the algorithms that moves
# the boxes, may renew logs and expectations in the same commit. From version 1 on logs and expectations are never
# overwritten; a new wire version adds logs beside the old ones.
set -euo pipefail
cd "$(dirname "$0")/.."

build=$(realpath "${1:-build}")
logs=tests/data/logs
version=$(sed -n 's/^#define OC_WIRE_VERSION \([0-9]*\)u$/\1/p' lib/core/packet.h)
[ "$version" = 0 ] || { echo "renew_logs: the wire's version is $version: captured logs stay as they are" >&2; exit 1; }

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
"$build/bin/outcrop-drive" tests/data/sites/depot --out "$scratch/run" --as none
mkdir -p "$logs"
cp "$scratch/run/link.lcm" "$logs/depot_clean.lcm"
/usr/bin/python3 tests/link/make_bad_logs.py "$logs"/depot_{clean,cut,garbage}.lcm
/usr/bin/python3 tests/link/replay_logs.py --bin "$build/bin" --renew "$logs"
