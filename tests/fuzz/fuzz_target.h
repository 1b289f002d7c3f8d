/* SPDX-License-Identifier: BSD-3-Clause
 * The entry point that libFuzzer and the replays share. */
#ifndef OUTCROP_TESTS_FUZZ_TARGET_H
#define OUTCROP_TESTS_FUZZ_TARGET_H

#include <stddef.h>
#include <stdint.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
