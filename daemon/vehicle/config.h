/* SPDX-License-Identifier: BSD-3-Clause
 * outcropd's configuration file (YAML, checked against a schema and a table of
 * keys). Every key with unit, range and default: docs/outcropd.yaml. */
#ifndef OUTCROP_DAEMON_CONFIG_H
#define OUTCROP_DAEMON_CONFIG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "camera_source.h"
#include "capture.h"
#include "config_fault.h"
#include "gpio.h"
#include "pose_lcm.h"
#include "vehicle/vehicle.h"

#define OC_CONFIG_TEXT_BYTES 512

/* What crosses the link: layers on request, or every keyframe whole (the null rival). */
typedef enum oc_link_mode { OC_LINK_LAYERS, OC_LINK_IMAGES } oc_link_mode_t;

/* Where frames come from. */
typedef enum oc_source { OC_SOURCE_SITE, OC_SOURCE_CAMERAS } oc_source_t;

typedef struct oc_config {
    char down_url[OC_CONFIG_TEXT_BYTES]; /* LCM group that carries vehicle to base */
    char up_url[OC_CONFIG_TEXT_BYTES];   /* LCM group that carries base to vehicle */
    uint32_t rate_kbit_s;                /* pace of sending, bytes on the wire */
    oc_link_mode_t mode;
    oc_codec_t image_codec;
    int image_quality;

    oc_source_t source;
    char site[OC_CONFIG_TEXT_BYTES]; /* folder or cameras file */
    oc_site_option_t site_option;
    oc_margin_option_t margin;

    oc_camera_source_config_t cameras; /* lenses already read from their calibration files */
    char pose_url[OC_CONFIG_TEXT_BYTES];
    char pose_channel[64];
    oc_pose_type_t pose_type;
    uint32_t pose_max_gap_ms; /* poses farther apart do not bracket a frame */

    oc_gpio_config_t gpio;

    bool has_held_views;                    /* views are announced, and wait for a mark or a request */
    uint32_t pre_event_s;                   /* how far back a mark or a request reaches */
    char status_file[OC_CONFIG_TEXT_BYTES]; /* rewritten every second, for --status; "" = none */
    char debug_dump[OC_CONFIG_TEXT_BYTES];  /* folder for junctions.json, "" = none */

    oc_vehicle_config_t vehicle; /* image size and, for a site, area are filled from the source */
} oc_config_t;

/* Read and check a file and the calibration files it names. Every fault goes to `on_fault`, in the order of
 * lines; false when there was any, and config is then untouched. */
bool oc_config_load(const char *path, oc_config_t *config, oc_config_fault_t on_fault, void *user);

/* docs/outcropd.yaml and docs/man/outcropd.yaml.5, made from the table of keys. False when out cannot be written. */
bool oc_config_print_sample(FILE *out);
bool oc_config_print_manual(FILE *out);

#endif
