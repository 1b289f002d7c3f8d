#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Set-up, build and tests; the last line counts test cases: test.sh [release|debug-asan|debug-tsan|aarch64|fuzz] [LABEL]
# LABEL (unit, site, threads, vm) builds and runs only that kind; without one all run but vm, which takes minutes by itself.
set -euo pipefail
cd "$(dirname "$0")/.."

export PATH=/usr/bin:/bin:$PATH # Debian's ctest
preset=${1:-release}
label=${2-}
case "$preset" in
    release) build=build ;;
    debug-asan | debug-tsan) build=build-${preset#debug-} ;;
    *) build=build-$preset ;; # which build.sh knows or refuses
esac
tools/build.sh "$preset" ${label:+"tests_$label"}

only=(-LE '^vm$')
[ -z "$label" ] || only=(-L "^$label\$")
results=$PWD/$build/test_results.xml
rm -f "$results"
status=0
ctest --preset "$preset" -j "$(nproc)" --no-tests=error "${only[@]}" --output-junit "$results" \
    --test-output-size-passed 1000000 --test-output-size-failed 1000000 || status=$?
[ -e "$results" ] || { echo "test: ctest wrote no results" >&2; exit 1; }
/usr/bin/python3 tools/checks/count_tests.py "$results" || status=1
exit "$status"
