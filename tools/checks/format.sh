#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Checks our C and C++ files against .clang-format, or rewrites them: format.sh [--fix] [FILE...]
set -euo pipefail
cd "$(dirname "$0")/../.."

mode=(--dry-run --Werror)
if [ "${1-}" = --fix ]; then mode=(-i); shift; fi
if [ $# -gt 0 ]; then
    files=("$@")
else
    mapfile -t files < <(find lib daemon tools tests -name '*.[ch]' -o -name '*.cpp' -o -name '*.hpp' | sort)
fi
clang-format-14 "${mode[@]}" "${files[@]}"
