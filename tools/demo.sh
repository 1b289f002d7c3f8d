#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Set-up, build, and the depot site driven through outcropd and outcrop-base: demo.sh [DIR], DIR being out/ if not given.
set -euo pipefail
out=$(realpath -m "${1:-"$(dirname "$0")/../out"}")
cd "$(dirname "$0")/.."
site=tests/data/sites/depot

tools/build.sh release

echo "demo: driving $site (14 views) through outcropd and outcrop-base"
started=$(date +%s)
build/bin/outcrop-drive "$site" --out "$out" --as boxes
echo "demo: holding the result against the site's truth"
build/bin/outcrop-eval "$site" "$out"

printf '\nLook at\n'
for picture in sequence/boxes.mp4 sequence/boxes/frame_00.png overhead.png model/ground.png report.json link.lcm; do
    [ ! -e "$out/$picture" ] || echo "  $out/$picture"
done
echo "demo: $(($(date +%s) - started)) s after the build"
