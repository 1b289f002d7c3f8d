/* SPDX-License-Identifier: BSD-3-Clause
 * packet_replay DIR: the fuzz target over a kept corpus, with every prefix of every file, and over the examples.
 * packet_replay --seeds DIR: write the examples there, without CRC, as seeds for the fuzzer. */
#include <dirent.h>
#include <stdio.h>

#include "packet_examples.h"
#include "fuzz_target.h"

static example_packet_t packets[N_EXAMPLES];

static int replay_file(const char *path)
{
    static uint8_t bytes[OC_MAX_DATAGRAM_BYTES + 64];
    FILE *file = fopen(path, "rb");
    if (!file) {
        perror(path);
        return 1;
    }
    const size_t n = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    for (size_t size = 0; size <= n; size++) {
        LLVMFuzzerTestOneInput(bytes, size);
    }
    return 0;
}

static int replay_directory(const char *directory)
{
    DIR *entries = opendir(directory);
    if (!entries) {
        perror(directory);
        return 1;
    }
    int n_files = 0, n_bad = 0;
    for (const struct dirent *entry = readdir(entries); entry; entry = readdir(entries)) {
        char path[1024];
        if (entry->d_name[0] == '.') continue;
        if (snprintf(path, sizeof path, "%s/%s", directory, entry->d_name) >= (int)sizeof path) continue;
        n_bad += replay_file(path);
        n_files++;
    }
    closedir(entries);
    for (int i = 0; i < N_EXAMPLES; i++) {
        LLVMFuzzerTestOneInput(packets[i].bytes, packets[i].n_bytes - 2u);
    }
    printf("%d corpus files and %d examples hold the invariants\n", n_files, N_EXAMPLES);
    return n_files == 0 || n_bad > 0;
}

static int write_seeds(const char *directory)
{
    for (int i = 0; i < N_EXAMPLES; i++) {
        char path[1024];
        if (snprintf(path, sizeof path, "%s/%s", directory, packets[i].name) >= (int)sizeof path) return 1;
        FILE *file = fopen(path, "wb");
        if (!file) {
            perror(path);
            return 1;
        }
        const size_t n = packets[i].n_bytes - 2u;
        const size_t written = fwrite(packets[i].bytes, 1, n, file);
        if (fclose(file) != 0 || written != n) return 1;
    }
    return 0;
}

int main(int argc, char **argv)
{
    if (example_packets(packets) != N_EXAMPLES) {
        fprintf(stderr, "packet_replay: an example packet cannot be encoded\n");
        return 1;
    }
    if (argc == 3 && strcmp(argv[1], "--seeds") == 0) return write_seeds(argv[2]);
    if (argc == 2) return replay_directory(argv[1]);
    fprintf(stderr, "usage: packet_replay DIR | packet_replay --seeds DIR\n");
    return 2;
}
