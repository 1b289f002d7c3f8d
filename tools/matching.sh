#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Measures matches, poses and steps beside their rivals and writes docs/matching.json and its part of docs/measurements.md:
# matching.sh [SITES]... folders of sites that tests/data/sites does not hold. After tools/build.sh, on a quiet machine;
# ten minutes, and four more where COLMAP is installed (tools/setup.sh --peers).
set -euo pipefail
cd "$(dirname "$0")/.."

folders=()
for folder in "${@:-../shared/sites}" tests/data/sites; do folders+=(--sites "$folder"); done
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
build/bin/outcrop-bench-matching "${folders[@]}" --json "$scratch/matching.json" >&2
tools/peer_colmap.py "${folders[@]}" --json "$scratch/colmap.json"
tools/bench_report.py --matching "$scratch"
echo "matching: docs/matching.json and docs/measurements.md written" >&2
