#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Runs clang-tidy 14 over our sources (slow, so not part of the tests): tidy.sh [-p BUILD_DIR] [FILE...]
set -euo pipefail
cd "$(dirname "$0")/../.."

build=build
if [ "${1-}" = -p ]; then build=$2; shift 2; fi
command -v clang-tidy-14 >/dev/null || { echo "tidy: clang-tidy-14 is missing: tools/setup.sh --dev" >&2; exit 1; }
[ -e "$build/compile_commands.json" ] || { echo "tidy: configure first: cmake --preset release" >&2; exit 1; }

if [ $# -gt 0 ]; then
    files=("$@")
else
    mapfile -t files < <(find lib daemon tools -name '*.c' -o -name '*.cpp' | sort)
fi
printf '%s\0' "${files[@]}" | xargs -0 -n 1 -P "$(nproc)" clang-tidy-14 -p "$build" --quiet --warnings-as-errors='*'
