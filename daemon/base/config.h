/* SPDX-License-Identifier: BSD-3-Clause
 * outcrop-base's configuration file (YAML, checked against a schema). Keys: docs/operating.md. */
#ifndef OUTCROP_DAEMON_BASE_CONFIG_H
#define OUTCROP_DAEMON_BASE_CONFIG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

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
    char represent[OC_BASE_TEXT_BYTES]; /* "boxes" or "none" */
    char path[OC_BASE_TEXT_BYTES];      /* path file, "" = a loop round the obstacles */
    char method[16];                    /* "best" or "thesis" */
    bool has_area;
    double area[5]; /* x_min, x_max, y_min, y_max, z_max; metres */
    bool exit_when_settled;
} oc_base_config_t;

/* Read and check a file; false and one line in error otherwise. */
bool oc_base_config_load(const char *path, oc_base_config_t *config, char *error, size_t error_bytes);

#ifdef __cplusplus
}
#endif
#endif
