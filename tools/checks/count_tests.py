#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Counts the test cases of a ctest run: count_tests.py RESULTS.xml (from ctest --output-junit), or --self-test.

A ctest entry that is a Unity or GoogleTest program counts as its cases, any other entry as one. Prints
"N passed, N failed, N skipped" as the last line; exits 1 when anything failed or nothing passed.
"""
import re
import sys
import xml.etree.ElementTree as ElementTree

UNITY = re.compile(r"^(\d+) Tests (\d+) Failures (\d+) Ignored", re.MULTILINE)
GTEST_RAN = re.compile(r"^\[==========\] (\d+) tests? from \d+ test suites? ran", re.MULTILINE)
GTEST_FAILED = re.compile(r"^\[  FAILED  \] (\d+) tests?, listed below", re.MULTILINE)
GTEST_SKIPPED = re.compile(r"^\[  SKIPPED \] (\d+) tests?, listed below", re.MULTILINE)


def sum_of(pattern, text):
    return sum(int(number) for number in pattern.findall(text))


def count_entry(status, output, reason=""):
    """(passed, failed, skipped) of one ctest entry; reason is ctest's why of one that did not run."""
    if status == "disabled" or (status == "notrun" and reason.startswith("SKIP_")):
        return 0, 0, 1
    if status == "notrun":  # its program is missing, or what it depends on failed
        return 0, 1, 0
    total = failed = skipped = 0
    for tests, failures, ignored in UNITY.findall(output):
        total, failed, skipped = total + int(tests), failed + int(failures), skipped + int(ignored)
    total += sum_of(GTEST_RAN, output)
    failed += sum_of(GTEST_FAILED, output)
    skipped += sum_of(GTEST_SKIPPED, output)
    if status == "fail":
        # A crash, a time-out or a sanitizer's finding comes without a summary or after a clean one.
        failed, total = max(failed, 1), max(total, 1, failed)
    elif total == 0:
        total = 1
    return max(total - failed - skipped, 0), failed, skipped


def count_run(root):
    totals = [0, 0, 0]
    for case in root.iter("testcase"):
        output = case.findtext("system-out") or ""
        skipped = case.find("skipped")
        reason = skipped.get("message", "") if skipped is not None else ""
        for i, n in enumerate(count_entry(case.get("status"), output, reason)):
            totals[i] += n
    return tuple(totals)


def self_test():
    gtest = "[==========] 9 tests from 2 test suites ran. (3 ms total)\n[  PASSED  ] 6 tests.\n" \
            "[  SKIPPED ] 1 test, listed below:\n[  FAILED  ] 2 tests, listed below:\n"
    cases = [
        (("run", "5 Tests 0 Failures 1 Ignored \nOK"), (4, 0, 1)), (("fail", "5 Tests 2 Failures 0 Ignored \nFAIL"), (3, 2, 0)),
        (("run", "every include is on the list"), (1, 0, 0)), (("fail", "Segmentation fault"), (0, 1, 0)),
        (("fail", "5 Tests 0 Failures 0 Ignored \nOK\nLeakSanitizer"), (4, 1, 0)),
        (("notrun", "", "SKIP_RETURN_CODE=77"), (0, 0, 1)), (("notrun", "", "Unable to find executable"), (0, 1, 0)),
        (("fail", gtest), (6, 2, 1)),
    ]
    wrong = [(entry, count_entry(*entry)) for entry, expected in cases if count_entry(*entry) != expected]
    for entry in wrong:
        print("self-test: wrong count", entry)
    return 1 if wrong else 0


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    passed, failed, skipped = count_run(ElementTree.parse(sys.argv[1]).getroot())
    print(f"{passed} passed, {failed} failed, {skipped} skipped")
    return 1 if failed or not passed else 0


if __name__ == "__main__":
    sys.exit(main())
