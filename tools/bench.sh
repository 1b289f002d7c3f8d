#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Runs all programs of the bench and writes figures, tables and pictures into docs/: bench.sh [--quick] [SITES [REAL]]
# SITES: folder of sites that tests/data/sites does not hold; REAL: folder of photographs. With --quick the tables go
# to standard output and docs/ is left alone. After tools/build.sh, on a quiet machine; some five minutes.
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

# Each writes the JSON of its figures; tables and pictures are made of them below.
given=()
for site in depot two_obstacles cubes; do
    for folder in "$sites/$site" "tests/data/sites/$site"; do
        if [ -e "$folder/cameras.json" ]; then given+=("$folder"); break; fi
    done
done
echo "bench: speed" >&2
"$bin/outcrop-bench-speed" --no-rows --sites tests/data/sites "$sites" --json "$scratch/speed.json" \
    >"$scratch/speed.txt" 2>&1 || { cat "$scratch/speed.txt" >&2; exit 1; }
grep SKIPPED "$scratch/speed.txt" >&2 || true
"$bin/outcrop-bench-speed" --no-pairs --sites tests/data/sites "$sites" --benchmark_min_time=0.1 \
    --benchmark_out="$scratch/rivals.json" --benchmark_out_format=json >"$scratch/rivals.txt" 2>&1 ||
    { cat "$scratch/rivals.txt" >&2; exit 1; }
if [ ${#quick[@]} -eq 0 ] && command -v valgrind >/dev/null && [ -x build-aarch64/tests/bin/junction_digest ]; then
    echo "bench: instructions" >&2
    build/tests/bin/image_to_pgm "$scratch" tests/data/sites/depot/images/view_00.jpg
    tools/bench/instructions.py --x86 build/tests/bin/junction_digest \
        --aarch64 build-aarch64/tests/bin/junction_digest --json "$scratch/instructions.json" "$scratch"/*.pgm \
        >"$scratch/instructions.txt" 2>&1 || { cat "$scratch/instructions.txt" >&2; exit 1; }
fi
echo "bench: ground" >&2
"$bin/outcrop-bench-ground" labels "${given[@]}" --poses exact 1 2 3 1:drift 1:mount 1:height \
    --json "$scratch/ground_labels.json" >"$scratch/ground.txt"
"$bin/outcrop-bench-ground" speed "${given[@]}" --json "$scratch/ground_speed.json" >>"$scratch/ground.txt"
if [ -e "$sites/cubes/cameras.json" ]; then
    "$bin/outcrop-bench-ground" table "$sites/cubes" --poses exact --json "$scratch/ground_table.json" \
        >>"$scratch/ground.txt"
else
    echo "bench: SKIPPED: table 4.1, no $sites/cubes" >&2
fi

if [ ${#quick[@]} -gt 0 ]; then
    tools/bench_report.py --from "$scratch" --print
else
    tools/bench_report.py --from "$scratch"
    echo "bench: docs/bench.json, docs/pictures/bench_*.svg and docs/measurements.md written" >&2
fi
