/* SPDX-License-Identifier: BSD-3-Clause
 * judoca_replay DIR: the fuzz target over a kept corpus and over inputs made here. */
#include <dirent.h>
#include <stdio.h>
#include <string.h>

#include "fuzz_target.h"

#define N_MADE 400u

static uint8_t bytes[4096];

static int replay_directory(const char *directory)
{
    DIR *entries = opendir(directory);
    if (!entries) {
        perror(directory);
        return -1;
    }
    int n_files = 0;
    for (const struct dirent *entry = readdir(entries); entry; entry = readdir(entries)) {
        char path[1024];
        if (entry->d_name[0] == '.') continue;
        if (snprintf(path, sizeof path, "%s/%s", directory, entry->d_name) >= (int)sizeof path) continue;
        FILE *file = fopen(path, "rb");
        if (!file) continue;
        const size_t n = fread(bytes, 1, sizeof bytes, file);
        fclose(file);
        LLVMFuzzerTestOneInput(bytes, n);
        n_files++;
    }
    closedir(entries);
    return n_files;
}

/* Random bytes, with an even hand for short and long inputs. */
static void replay_made(void)
{
    uint32_t state = 1;
    for (uint32_t i = 0; i < N_MADE; i++) {
        const size_t n = i % 300u;
        for (size_t k = 0; k < n; k++) {
            state = state * 1664525u + 1013904223u;
            bytes[k] = (uint8_t)(state >> 24);
        }
        LLVMFuzzerTestOneInput(bytes, n);
    }
}

int main(int argc, char **argv)
{
    if (argc != 2) {
        fprintf(stderr, "usage: judoca_replay DIR\n");
        return 2;
    }
    const int n_files = replay_directory(argv[1]);
    if (n_files <= 0) return 1;
    replay_made();
    printf("%d corpus files and %u made inputs hold the invariants\n", n_files, N_MADE);
    return 0;
}
