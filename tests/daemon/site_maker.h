/* SPDX-License-Identifier: BSD-3-Clause
 * A small site folder to break: three cameras 1, 2 and 3 m above the ground that look straight down. */
#ifndef OUTCROP_TESTS_SITE_MAKER_H
#define OUTCROP_TESTS_SITE_MAKER_H

#include "unity.h"

#include <jansson.h>
#include <png.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static inline uint8_t site_maker_pixel(int view, uint32_t x, uint32_t y, uint32_t channel)
{
    return (uint8_t)(x * 3 + y * 5 + channel * 40 + (uint32_t)view * 11 + (x * y) % 17);
}

static inline void site_maker_png(const char *folder, int view, uint32_t width_px, uint32_t height_px)
{
    char path[128];
    snprintf(path, sizeof path, "%s/view_%d.png", folder, view);
    uint8_t *px = malloc(3u * width_px * height_px);
    TEST_ASSERT_NOT_NULL(px);
    for (uint32_t i = 0; i < 3 * width_px * height_px; i++)
        px[i] = site_maker_pixel(view, i / 3 % width_px, i / 3 / width_px, i % 3);
    png_image png = {.version = PNG_IMAGE_VERSION, .width = width_px, .height = height_px, .format = PNG_FORMAT_RGB};
    TEST_ASSERT_TRUE(png_image_write_to_file(&png, path, 0, px, 0, NULL));
    free(px);
}

static inline json_t *site_maker_json(void)
{
    json_t *views = json_array();
    for (int i = 0; i < 3; i++) {
        char name[32];
        snprintf(name, sizeof name, "view_%d.png", i);
        json_array_append_new(views,
                              json_pack("{s:s, s:i, s:i, s:f, s:f, s:f, s:f, s:[[i,i,i],[i,i,i],[i,i,i]],"
                                        " s:[i,i,i]}",
                                        "image", name, "width", 64, "height", 48, "fx", 60.0, "fy", 61.0, "cx", 32.0,
                                        "cy", 24.0, "R", 1, 0, 0, 0, -1, 0, 0, 0, -1, "t", 0, 0, 1000 * (i + 1)));
    }
    return json_pack("{s:s, s:o}", "units", "mm", "views", views);
}

static inline void site_maker_text(const char *folder, const char *text)
{
    char path[128];
    snprintf(path, sizeof path, "%s/cameras.json", folder);
    FILE *file = fopen(path, "w");
    TEST_ASSERT_NOT_NULL(file);
    fputs(text, file);
    fclose(file);
}

static inline void site_maker_write(const char *folder, const json_t *site)
{
    char *text = json_dumps(site, 0);
    TEST_ASSERT_NOT_NULL(text);
    site_maker_text(folder, text);
    free(text);
}

static inline void site_maker_remove(const char *folder)
{
    char path[128];
    for (int i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "%s/view_%d.png", folder, i);
        unlink(path);
    }
    snprintf(path, sizeof path, "%s/cameras.json", folder);
    unlink(path);
    rmdir(folder);
}

#endif
