/* SPDX-License-Identifier: BSD-3-Clause
 * outcrop-base's configuration file (YAML, checked against a schema and a table of keys).
 * Every key with unit, range and default: docs/outcrop-base.yaml. */
#ifndef OUTCROP_DAEMON_BASE_CONFIG_H
#define OUTCROP_DAEMON_BASE_CONFIG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "config_fault.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OC_BASE_TEXT_BYTES 512

typedef struct oc_base_config {
    int vehicle;                       /* -1: the first that is heard */
    char down_url[OC_BASE_TEXT_BYTES]; /* LCM group that carries vehicle to base */
    char up_url[OC_BASE_TEXT_BYTES];   /* LCM group that carries base to vehicle */
    char lan_url[OC_BASE_TEXT_BYTES];  /* where readable types go out again; "" = nowhere */
    uint32_t datagram_bytes;
    uint32_t patch_quality;
    char out[OC_BASE_TEXT_BYTES];       /* folder that is written whenever the model settles */
    char represent[OC_BASE_TEXT_BYTES]; /* "boxes", "voxels" or "none" */
    bool with_textures;
    char path[OC_BASE_TEXT_BYTES]; /* path file, "" = a loop round the obstacles */
    char method[16];               /* "best" or "thesis" */
    bool has_area;
    double area[5]; /* x_min, x_max, y_min, y_max, z_max; metres */
    bool resume;    /* go on from out/link.lcm */
    bool exit_when_settled;
} oc_base_config_t;

/* Read and check a file. Every fault goes to `on_fault`, in the order of lines;
 * false when there was any, and config is then untouched. */
bool oc_base_config_load(const char *path, oc_base_config_t *config, oc_config_fault_t on_fault, void *user);

/* docs/outcrop-base.yaml, made from the table of keys. False when out cannot be written. */
bool oc_base_config_print_sample(FILE *out);

#ifdef __cplusplus
}
#endif
#endif
