#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Set-up and build, nothing that is already there twice: build.sh [release|debug-asan|debug-tsan|aarch64|fuzz] [TARGET]...
# aarch64 is the vehicle's half for 64-bit Arm, fuzz the fuzzers, with clang.
set -euo pipefail
cd "$(dirname "$0")/.."

preset=${1:-release}
shift $(($# > 0 ? 1 : 0))
case "$preset" in
    release) build=build ;;
    debug-asan | debug-tsan) build=build-${preset#debug-} ;;
    aarch64 | fuzz) build=build-$preset ;;
    *) echo "usage: tools/build.sh [release|debug-asan|debug-tsan|aarch64|fuzz] [TARGET]..." >&2; exit 1 ;;
esac

tools/setup.sh

# Not the python3 or cmake of some environment: Debian's.
export PATH=/usr/bin:/bin:$PATH

if [ ! -e "$build/build.ninja" ]; then
    echo "build: configuring $build"
    mkdir -p "$build"
    cmake --preset "$preset" >"$build/configure.log" 2>&1 || { tail -n 30 "$build/configure.log" >&2; exit 1; }
fi
echo "build: building $build"
cmake --build --preset "$preset" ${1:+--target "$@"}
