/* SPDX-License-Identifier: BSD-3-Clause
 * junctions.json with jansson. */
#include "debug_dump.h"

#include <errno.h>
#include <jansson.h>
#include <stdio.h>
#include <string.h>

static const char *const label_names[] = {"unknown", "obstacle", "ground"};

static json_t *junction_json(const oc_junction_t *junction)
{
    json_t *branches = json_array();
    double strength = 1;
    for (uint32_t i = 0; i < junction->n_branches; i++) {
        json_array_append_new(branches, json_real((double)junction->branch[i].angle_rad));
        if ((double)junction->branch[i].strength < strength) strength = (double)junction->branch[i].strength;
    }
    return json_pack("{s:f, s:f, s:o, s:f, s:f, s:s, s:f}", "x", (double)junction->x_px, "y", (double)junction->y_px,
                     "branches", branches, "strength", strength, "score", (double)junction->score, "label",
                     label_names[junction->label <= OC_LABEL_GROUND ? junction->label : 0], "confidence",
                     junction->confidence / 255.0);
}

bool oc_debug_dump(const oc_vehicle_t *vehicle, const char *folder, char *error, size_t error_bytes)
{
    json_t *views = json_array();
    for (uint32_t view = 0; view < UINT16_MAX; view++) {
        const oc_junction_t *junctions = NULL;
        uint32_t n = 0;
        if (oc_vehicle_junctions(vehicle, (uint16_t)view, &junctions, &n) != OC_OK) continue;
        json_t *list = json_array();
        for (uint32_t i = 0; i < n; i++) json_array_append_new(list, junction_json(&junctions[i]));
        json_array_append_new(views, json_pack("{s:i, s:o}", "view", (int)view, "junctions", list));
    }
    json_t *root = json_pack("{s:o}", "views", views);
    char path[1024], part[1040];
    snprintf(path, sizeof path, "%s/junctions.json", folder);
    snprintf(part, sizeof part, "%s.part", path);
    const bool is_ok =
        root && json_dump_file(root, part, JSON_INDENT(1) | JSON_REAL_PRECISION(9)) == 0 && rename(part, path) == 0;
    if (!is_ok) snprintf(error, error_bytes, "%s: cannot write: %s", path, strerror(errno));
    json_decref(root);
    return is_ok;
}
