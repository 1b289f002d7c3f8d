/* SPDX-License-Identifier: BSD-3-Clause
 * image_to_pgm DIR FILE...: the grey of pictures as binary PGM, DIR/A_B.pgm for .../A/images/B.jpg, so that a test on
 * another machine needs no decoder and sees the same pixels. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/image.h"
#include "image_file.h"

/* Start of the last n_parts parts of a path. */
static const char *tail_of(const char *path, int n_parts)
{
    const char *at = path + strlen(path);
    for (; at > path; at--) {
        if (at[-1] == '/' && --n_parts == 0) break;
    }
    return at;
}

/* "A_B" of ".../A/images/B.jpg". */
static void name_of(const char *path, char *name, size_t n_bytes)
{
    const char *site = tail_of(path, 3), *file = tail_of(path, 1);
    (void)snprintf(name, n_bytes, "%.*s_%.*s", (int)strcspn(site, "/"), site, (int)strcspn(file, "."), file);
}

static int grey_write(const char *path, const oc_image_mut_t *grey)
{
    FILE *file = fopen(path, "wb");
    if (!file) return 0;
    const size_t n = (size_t)grey->width_px * grey->height_px;
    int is_ok = fprintf(file, "P5 %u %u 255\n", (unsigned)grey->width_px, (unsigned)grey->height_px) > 0;
    is_ok = fwrite(grey->px, 1, n, file) == n && is_ok;
    return fclose(file) == 0 && is_ok;
}

static int convert(const char *directory, const char *path)
{
    char error[512] = "cannot be converted", name[256], out[1024];
    uint32_t w, h;
    if (!oc_image_file_size(path, &w, &h, error, sizeof error)) {
        fprintf(stderr, "image_to_pgm: %s\n", error);
        return 0;
    }
    const size_t n = (size_t)w * h;
    uint8_t *px = malloc(4u * n);
    if (!px) return 0;
    oc_image_mut_t rgb = {px, w, h, 3u * w, 3}, grey = {px + 3u * n, w, h, w, 1};
    const oc_image_t read = {px, w, h, 3u * w, 3};
    name_of(path, name, sizeof name);
    (void)snprintf(out, sizeof out, "%s/%s.pgm", directory, name);
    const int is_ok = oc_image_file_read(path, &rgb, error, sizeof error) && oc_image_to_grey(&read, &grey) == OC_OK &&
                      grey_write(out, &grey);
    if (!is_ok) fprintf(stderr, "image_to_pgm: %s: %s\n", path, error);
    free(px);
    return is_ok;
}

int main(int argc, char **argv)
{
    if (argc < 3) {
        fprintf(stderr, "usage: image_to_pgm DIR FILE...\n");
        return 2;
    }
    int n_bad = 0;
    for (int i = 2; i < argc; i++) n_bad += !convert(argv[1], argv[i]);
    return n_bad > 0;
}
