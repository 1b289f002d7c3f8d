/* SPDX-License-Identifier: BSD-3-Clause
 * The vehicle's lines: trigger, strobe and heartbeat out, capture-enable and
 * mark in. A thread of its own does the waiting, so that a pulse is not late
 * because a frame is being looked at. */
#ifndef OUTCROP_DAEMON_GPIO_H
#define OUTCROP_DAEMON_GPIO_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "counters.h"
#include "gpio_line.h"

/* What starts a trigger pulse. */
typedef enum oc_trigger_mode {
    OC_TRIGGER_PER_FRAME, /* a frame has come: others follow the camera; none while the pulse before lasts */
    OC_TRIGGER_PERIODIC   /* a clock: hardware-triggered cameras follow the line */
} oc_trigger_mode_t;

typedef struct oc_gpio_config {
    oc_gpio_name_t trigger, strobe, heartbeat, enable, mark; /* is_used false: not wired */
    oc_trigger_mode_t trigger_mode;
    double trigger_rate_hz;    /* periodic; 0.1..240 */
    uint32_t trigger_pulse_us; /* 10..100000 */
    uint32_t strobe_delay_us;  /* after the start of the trigger pulse or the arrival of the frame; 0..100000 */
    uint32_t strobe_pulse_us;  /* 10..100000 */
    uint32_t heartbeat_ms;     /* half a period of the LED, 50..10000; still when frames stop coming */
    uint32_t mark_debounce_ms; /* no mark this soon after another edge of the line, up or down; 0..10000 */
} oc_gpio_config_t;

typedef struct oc_gpio oc_gpio_t;

/* Request all lines that are used and start the thread. A line that is
 * missing, busy or of the wrong kind is one line in error that names it (and
 * who holds it); then nothing is left requested. */
oc_gpio_t *oc_gpio_open(const oc_gpio_config_t *config, const oc_gpio_ops_t *ops, oc_counters_t *counters, char *error,
                        size_t error_bytes);
void oc_gpio_close(oc_gpio_t *gpio); /* outputs are left inactive */

/* Readable when the enable input changed or a mark came; clear it before asking. */
int oc_gpio_fd(const oc_gpio_t *gpio);
void oc_gpio_clear(oc_gpio_t *gpio);

/* The capture-enable input; true when it is not wired. */
bool oc_gpio_is_enabled(const oc_gpio_t *gpio);

/* A mark that nobody has taken yet: its monotonic time. Marks that come
 * faster than they are taken become one, the first, and are counted. */
bool oc_gpio_take_mark(oc_gpio_t *gpio, int64_t *mono_ns);

/* A frame has come: per-frame trigger, strobe, heartbeat. Does not block. One
 * that comes before the last one's pulse was over starts none: PULSES_MISSED. */
void oc_gpio_frame(oc_gpio_t *gpio);

/* Periodic trigger: the start of the pulse that belongs to a frame which came
 * at mono_ns, the last one before it within a period. False when there is none,
 * and per frame, where the frame comes first. */
bool oc_gpio_pulse_of(const oc_gpio_t *gpio, int64_t mono_ns, int64_t *pulse_ns);

#endif
