/* SPDX-License-Identifier: BSD-3-Clause
 * outcropd's configuration file (YAML, checked against a schema). Every key
 * with unit, range and default: docs/operating.md. */
#ifndef OUTCROP_DAEMON_CONFIG_H
#define OUTCROP_DAEMON_CONFIG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "capture.h"
#include "vehicle/vehicle.h"

#define OC_CONFIG_TEXT_BYTES 512

/* What crosses the link: layers on request, or every keyframe whole (the null rival). */
typedef enum oc_link_mode { OC_LINK_LAYERS, OC_LINK_IMAGES } oc_link_mode_t;

typedef struct oc_config {
    char down_url[OC_CONFIG_TEXT_BYTES]; /* LCM group that carries vehicle to base */
    char up_url[OC_CONFIG_TEXT_BYTES];   /* LCM group that carries base to vehicle */
    uint32_t rate_kbit_s;                /* pace of sending, bytes on the wire */
    oc_link_mode_t mode;
    oc_codec_t image_codec;
    int image_quality;

    char site[OC_CONFIG_TEXT_BYTES]; /* folder or cameras file */
    uint32_t period_ms;              /* between two frames of a site folder */
    oc_margin_option_t margin;
    char debug_dump[OC_CONFIG_TEXT_BYTES]; /* folder for junctions.json, "" = none */

    oc_vehicle_config_t vehicle; /* image size and area are filled from the source */
} oc_config_t;

/* Read and check a file. False, and one line in error that names file, line
 * and key, when it is unreadable, has an unknown key or a value out of range. */
bool oc_config_load(const char *path, oc_config_t *config, char *error, size_t error_bytes);

#endif
