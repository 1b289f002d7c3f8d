/* SPDX-License-Identifier: BSD-3-Clause
 * make_frames FOLDER PICTURE...: pictures as a camera sends them, FOLDER/K.yuyv (4:2:2, BT.601 of limited range). */
#include <stdio.h>
#include <stdlib.h>

#include "core/image.h"
#include "image_file.h"

static uint8_t byte_of(double value)
{
    return (uint8_t)(value + 0.5);
}

/* Two pixels next to each other. */
static void pair_to_yuyv(const uint8_t *rgb, uint8_t *out)
{
    double u = 0, v = 0;
    for (int i = 0; i < 2; i++) {
        const double r = rgb[3 * i], g = rgb[3 * i + 1], b = rgb[3 * i + 2];
        out[2 * i] = byte_of(16 + (65.481 * r + 128.553 * g + 24.966 * b) / 255);
        u += 0.5 * (128 + (-37.797 * r - 74.203 * g + 112.0 * b) / 255);
        v += 0.5 * (128 + (112.0 * r - 93.786 * g - 18.214 * b) / 255);
    }
    out[1] = byte_of(u);
    out[3] = byte_of(v);
}

static int write_file(const char *path, const uint8_t *bytes, size_t n)
{
    FILE *file = fopen(path, "wb");
    if (!file) return 0;
    const int is_ok = fwrite(bytes, 1, n, file) == n;
    return fclose(file) == 0 && is_ok;
}

static int convert(const char *folder, int k, const char *picture)
{
    char error[512], out[1024];
    uint32_t w, h;
    if (!oc_image_file_size(picture, &w, &h, error, sizeof error)) {
        fprintf(stderr, "make_frames: %s\n", error);
        return 0;
    }
    const size_t n_pairs = (size_t)w * h / 2;
    uint8_t *rgb = malloc(n_pairs * 10);
    if (!rgb) return 0;
    uint8_t *yuyv = rgb + n_pairs * 6;
    oc_image_mut_t image = {rgb, w, h, 3 * w, 3};
    (void)snprintf(out, sizeof out, "%s/%d.yuyv", folder, k);
    int is_ok = oc_image_file_read(picture, &image, error, sizeof error);
    if (!is_ok) fprintf(stderr, "make_frames: %s\n", error);
    for (size_t i = 0; is_ok && i < n_pairs; i++) pair_to_yuyv(rgb + 6 * i, yuyv + 4 * i);
    is_ok = is_ok && write_file(out, yuyv, n_pairs * 4);
    free(rgb);
    return is_ok;
}

int main(int argc, char **argv)
{
    if (argc < 3) {
        fprintf(stderr, "usage: make_frames FOLDER PICTURE...\n");
        return 2;
    }
    for (int i = 2; i < argc; i++) {
        if (!convert(argv[1], i - 2, argv[i])) return 1;
    }
    return 0;
}
