/* SPDX-License-Identifier: BSD-3-Clause
 * The values of a calibration file as they stand there, before anything is made of them. */
#ifndef OUTCROP_DAEMON_CALIBRATION_YAML_H
#define OUTCROP_DAEMON_CALIBRATION_YAML_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define OC_MAX_CALIBRATION_BYTES 65536u
#define OC_MAX_CALIBRATION_NUMBERS 16u
#define OC_CALIBRATION_TEXT_BYTES 64u

/* Keys that mean something; all others are skipped, whatever they hold. */
typedef enum oc_calibration_key {
    OC_KEY_WIDTH,
    OC_KEY_HEIGHT,
    OC_KEY_NAME,
    OC_KEY_MODEL,
    OC_KEY_FISHEYE,
    OC_KEY_CAMERA, /* matrices from here on */
    OC_KEY_DISTORTION,
    OC_KEY_RECTIFICATION,
    OC_KEY_PROJECTION,
    OC_N_CALIBRATION_KEYS
} oc_calibration_key_t;

typedef struct oc_calibration_value {
    int line;                             /* 0: not in the file */
    const char *key;                      /* as spelt there */
    char text[OC_CALIBRATION_TEXT_BYTES]; /* of a scalar */
    uint32_t n;                           /* of a matrix */
    double number[OC_MAX_CALIBRATION_NUMBERS];
} oc_calibration_value_t;

typedef struct oc_calibration_file {
    const char *path;
    char *error;
    size_t error_bytes;
    bool is_bad; /* and error is set */
    oc_calibration_value_t value[OC_N_CALIBRATION_KEYS];
} oc_calibration_file_t;

/* One line "PATH:LINE: ..." into error; only the first fault is told. Line 0: of the whole file. */
__attribute__((format(printf, 3, 4))) void oc_calibration_refuse(oc_calibration_file_t *file, int line,
                                                                 const char *format, ...);

/* Read file->path; path and error are the caller's, the rest is filled here.
 * Numbers are finite, keys are unique, rows x cols of a matrix is its number
 * of numbers. False and error set otherwise, and for files over the limit, more than one
 * document, and aliases. */
bool oc_calibration_file_read(oc_calibration_file_t *file);

#endif
