/* SPDX-License-Identifier: BSD-3-Clause
 * Lines through libgpiod 1.6. */
#include "gpio_line.h"

#include <errno.h>
#include <fcntl.h>
#include <gpiod.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CONSUMER "outcropd"

struct oc_gpio_line {
    struct gpiod_chip *chip;
    struct gpiod_line *line;
    bool is_output;
};

typedef struct complaint {
    const char *role;
    const oc_gpio_name_t *name;
    char *error;
    size_t error_bytes;
} complaint_t;

/* "gpio mark: line "estop": what"; false, so that a function may end with it. */
static bool complain(const complaint_t *c, const char *what)
{
    char which[2 * OC_GPIO_NAME_BYTES + 32];
    if (c->name->line[0]) {
        snprintf(which, sizeof which, "line \"%s\"", c->name->line);
    } else {
        snprintf(which, sizeof which, "line %u of %s", c->name->offset, c->name->chip);
    }
    snprintf(c->error, c->error_bytes, "gpio %s: %s: %s", c->role, which, what);
    return false;
}

/* ---- finding ---- */

/* Names need not be unique: take the only one, refuse to guess among several. */
static bool find_by_name(const complaint_t *c, oc_gpio_line_t *out)
{
    struct gpiod_chip_iter *chips = gpiod_chip_iter_new();
    if (!chips) return complain(c, errno == ENOENT ? "this machine has no GPIO chip" : strerror(errno));
    char first[OC_GPIO_NAME_BYTES] = "", what[160] = "";
    struct gpiod_chip *chip;
    while (!what[0] && (chip = gpiod_chip_iter_next(chips))) {
        struct gpiod_line *line = gpiod_chip_find_line(chip, c->name->line);
        if (!line) continue;
        if (first[0])
            snprintf(what, sizeof what, "%s and %s both have one of that name: say chip and offset", first,
                     gpiod_chip_name(chip));
        snprintf(first, sizeof first, "%s", gpiod_chip_name(chip));
    }
    gpiod_chip_iter_free(chips);
    if (what[0]) return complain(c, what);
    if (!first[0]) return complain(c, "no chip has a line of that name (gpioinfo lists them)");
    out->chip = gpiod_chip_open_by_name(first);
    out->line = out->chip ? gpiod_chip_find_line(out->chip, c->name->line) : NULL;
    return out->line || complain(c, strerror(errno));
}

static bool find_by_offset(const complaint_t *c, oc_gpio_line_t *out)
{
    char what[160];
    out->chip = gpiod_chip_open_lookup(c->name->chip);
    if (!out->chip) {
        snprintf(what, sizeof what, "the chip cannot be opened: %s", strerror(errno));
        return complain(c, what);
    }
    const unsigned n = gpiod_chip_num_lines(out->chip);
    if (c->name->offset >= n) {
        snprintf(what, sizeof what, "the chip has %u lines only", n);
        return complain(c, what);
    }
    out->line = gpiod_chip_get_line(out->chip, c->name->offset);
    return out->line || complain(c, strerror(errno));
}

static void line_free(oc_gpio_line_t *line)
{
    if (line->chip) gpiod_chip_close(line->chip); /* releases the line */
    free(line);
}

static oc_gpio_line_t *line_find(const complaint_t *c)
{
    oc_gpio_line_t *out = calloc(1, sizeof *out);
    if (!out) {
        complain(c, "out of memory");
        return NULL;
    }
    if (c->name->line[0] ? find_by_name(c, out) : find_by_offset(c, out)) return out;
    line_free(out);
    return NULL;
}

/* ---- requesting ---- */

static bool complain_request(const complaint_t *c, struct gpiod_line *line)
{
    const int fault = errno;
    char what[160];
    const char *holder = gpiod_line_consumer(line);
    if (fault == EBUSY) {
        snprintf(what, sizeof what, "is held by \"%s\"", holder ? holder : "the kernel");
    } else {
        snprintf(what, sizeof what, "cannot be had: %s", strerror(fault));
    }
    return complain(c, what);
}

static int flags_of(const oc_gpio_name_t *name)
{
    static const int biases[] = {
        [OC_GPIO_BIAS_AS_IS] = 0,
        [OC_GPIO_BIAS_OFF] = GPIOD_LINE_REQUEST_FLAG_BIAS_DISABLE,
        [OC_GPIO_BIAS_UP] = GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP,
        [OC_GPIO_BIAS_DOWN] = GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN,
    };
    return biases[name->bias] | (name->is_active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0);
}

static oc_gpio_line_t *open_output(const char *role, const oc_gpio_name_t *name, bool is_active, char *error,
                                   size_t error_bytes)
{
    const complaint_t c = {role, name, error, error_bytes};
    oc_gpio_line_t *line = line_find(&c);
    if (!line) return NULL;
    line->is_output = true;
    if (gpiod_line_request_output_flags(line->line, CONSUMER, flags_of(name), is_active) == 0) return line;
    complain_request(&c, line->line);
    line_free(line);
    return NULL;
}

static oc_gpio_line_t *open_input(const char *role, const oc_gpio_name_t *name, char *error, size_t error_bytes)
{
    const complaint_t c = {role, name, error, error_bytes};
    oc_gpio_line_t *line = line_find(&c);
    if (!line) return NULL;
    if (gpiod_line_request_both_edges_events_flags(line->line, CONSUMER, flags_of(name)) == 0) {
        const int fd = gpiod_line_event_get_fd(line->line);
        if (fd >= 0 && fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK) == 0) return line;
    }
    complain_request(&c, line->line);
    line_free(line);
    return NULL;
}

/* ---- using ---- */

static bool line_set(oc_gpio_line_t *line, bool is_active)
{
    return gpiod_line_set_value(line->line, is_active) == 0;
}

static int line_get(oc_gpio_line_t *line)
{
    return gpiod_line_get_value(line->line);
}

static int line_fd(const oc_gpio_line_t *line)
{
    return gpiod_line_event_get_fd(line->line);
}

static oc_gpio_result_t line_take_edge(oc_gpio_line_t *line, oc_gpio_edge_t *edge)
{
    struct gpiod_line_event event;
    errno = 0;
    if (gpiod_line_event_read(line->line, &event) < 0) {
        return errno == EAGAIN || errno == EINTR ? OC_GPIO_NONE : OC_GPIO_FAULT;
    }
    /* The kernel has turned an active-low line round already. */
    *edge = (oc_gpio_edge_t){.is_active = event.event_type == GPIOD_LINE_EVENT_RISING_EDGE,
                             .mono_ns = (int64_t)event.ts.tv_sec * 1000000000 + event.ts.tv_nsec};
    return OC_GPIO_EDGE;
}

static void line_close(oc_gpio_line_t *line)
{
    if (!line) return;
    if (line->is_output) (void)line_set(line, false);
    line_free(line);
}

const oc_gpio_ops_t oc_gpio_libgpiod = {open_output, open_input,     line_set,  line_get,
                                        line_fd,     line_take_edge, line_close};
