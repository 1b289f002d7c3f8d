/* SPDX-License-Identifier: BSD-3-Clause
 * Single GPIO lines: a seam over libgpiod 1.6 where version 2 or a test's
 * stand-in fits. Only gpio_line.c includes gpiod.h. */
#ifndef OUTCROP_DAEMON_GPIO_LINE_H
#define OUTCROP_DAEMON_GPIO_LINE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define OC_GPIO_NAME_BYTES 64

typedef enum oc_gpio_bias { OC_GPIO_BIAS_AS_IS, OC_GPIO_BIAS_OFF, OC_GPIO_BIAS_UP, OC_GPIO_BIAS_DOWN } oc_gpio_bias_t;

/* Which line: by its name, or by chip ("gpiochip0", a path or a label) and offset. */
typedef struct oc_gpio_name {
    bool is_used;
    char line[OC_GPIO_NAME_BYTES]; /* "" = by chip and offset */
    char chip[OC_GPIO_NAME_BYTES];
    uint32_t offset;
    bool is_active_low;
    oc_gpio_bias_t bias; /* inputs */
} oc_gpio_name_t;

typedef enum oc_gpio_result { OC_GPIO_FAULT = -1, OC_GPIO_NONE = 0, OC_GPIO_EDGE = 1 } oc_gpio_result_t;

typedef struct oc_gpio_edge {
    bool is_active; /* the line became active (active_low already considered) */
    int64_t mono_ns;
} oc_gpio_edge_t;

typedef struct oc_gpio_line oc_gpio_line_t;
typedef struct oc_gpio_ops {
    /* NULL and one line in error: `gpio mark: no line is named "x"`, `... is held by "y"`. role names the line's use. */
    oc_gpio_line_t *(*open_output)(const char *role, const oc_gpio_name_t *name, bool is_active, char *error,
                                   size_t error_bytes);
    oc_gpio_line_t *(*open_input)(const char *role, const oc_gpio_name_t *name, char *error, size_t error_bytes);
    bool (*set)(oc_gpio_line_t *line, bool is_active);
    int (*get)(oc_gpio_line_t *line);      /* 0, 1, -1 */
    int (*fd)(const oc_gpio_line_t *line); /* inputs: readable when an edge waits */
    oc_gpio_result_t (*take_edge)(oc_gpio_line_t *line, oc_gpio_edge_t *edge);
    void (*close)(oc_gpio_line_t *line); /* an output is set inactive first */
} oc_gpio_ops_t;

extern const oc_gpio_ops_t oc_gpio_libgpiod;

#endif
