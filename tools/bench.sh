#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Runs all programs of the bench and writes figures, tables and pictures into docs/: bench.sh [--quick] [SITES [REAL]]
# SITES: folder of sites that tests/data/sites does not hold; REAL: folder of photographs. With --quick the tables go
# to standard output and docs/ is left alone. After tools/build.sh, on a quiet machine; a minute without the speed part.
set -euo pipefail
cd "$(dirname "$0")/.."

quick=()
if [ "${1-}" = --quick ]; then quick=(--quick); shift; fi
sites=${1-../shared/sites}
real=${2-../shared/real}
bin=build/bin
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

junctions() {
    local name=$1
    shift
    echo "bench: $name" >&2
    "$bin/outcrop-bench-junctions" "$name" --json "$scratch/$name.json" "$@" >"$scratch/$name.txt"
    grep -E 'SKIPPED|targets:' "$scratch/$name.txt" >&2 || true
}

if [ ! -x "$bin/outcrop-bench-junctions" ]; then
    echo "bench: no $bin/outcrop-bench-junctions: run tools/build.sh first" >&2
    exit 1
fi
junctions accuracy "${quick[@]}"
junctions repeatability "${quick[@]}" --natural tests/bench/natural.json --sites tests/data/sites --sites "$sites"
junctions thesis --sites tests/data/sites --sites "$sites"
junctions chess-stereo --real "$real/chess_stereo"

# Programs that may not be built: speed writes Google Benchmark's JSON, ground {"seed", "result": {"tables": [...]}}.
skipped=()
if [ -x "$bin/outcrop-bench-speed" ]; then
    echo "bench: speed" >&2
    "$bin/outcrop-bench-speed" --benchmark_format=json >"$scratch/speed.json"
else
    skipped+=(--skipped outcrop-bench-speed)
fi
if [ -x "$bin/outcrop-bench-ground" ]; then
    echo "bench: ground" >&2
    "$bin/outcrop-bench-ground" --json "$scratch/ground.json" >"$scratch/ground.txt"
else
    skipped+=(--skipped outcrop-bench-ground)
fi
for name in "${skipped[@]}"; do [ "$name" = --skipped ] || echo "bench: SKIPPED: $name is not built" >&2; done

if [ ${#quick[@]} -gt 0 ]; then
    tools/bench_report.py --from "$scratch" --print "${skipped[@]}"
else
    tools/bench_report.py --from "$scratch" "${skipped[@]}"
    echo "bench: docs/bench.json, docs/pictures/bench_*.svg and docs/measurements.md written" >&2
fi
