/* SPDX-License-Identifier: BSD-3-Clause
 * The thread that keeps the lines: whatever is due next, and edges as they come. */
#include "gpio.h"

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <time.h>
#include <unistd.h>

#include "clock_map.h"
#include "doorbell.h"

#define NS_PER_US 1000LL
#define NS_PER_MS 1000000LL
#define NS_PER_S 1000000000LL
#define NEVER INT64_MAX

/* Edges can be lost in a burst: the level is read again this often. */
#define REREAD_NS NS_PER_S

/* Without a frame for so long the heartbeat stops. */
#define HEARTBEAT_PATIENCE_NS (3 * NS_PER_S)

/* Trigger pulses remembered for the frames that follow them. */
#define N_PULSES 64u

/* Edges taken at a time: an input that swings without end must not hold up the outputs. */
#define MAX_EDGES 64

/* What the thread has to do, each at its time. */
typedef enum due {
    DUE_TRIGGER_ON,
    DUE_TRIGGER_OFF,
    DUE_STROBE_ON,
    DUE_STROBE_OFF,
    DUE_HEARTBEAT,
    DUE_REREAD,
    N_DUE
} due_t;

typedef enum role { ROLE_TRIGGER, ROLE_STROBE, ROLE_HEARTBEAT, ROLE_ENABLE, ROLE_MARK, N_ROLES } role_t;

struct oc_gpio {
    oc_gpio_config_t config;
    const oc_gpio_ops_t *ops;
    oc_counters_t *counters;
    oc_gpio_line_t *lines[N_ROLES]; /* NULL: not wired */
    bool is_faulty[N_ROLES];        /* told and counted once */

    pthread_t thread;
    bool has_thread;
    int command_fd; /* a frame came, or the end */
    int news_fd;    /* for the loop */
    atomic_bool is_stopped, is_enabled, has_frame;
    _Atomic int64_t last_frame_ns; /* when one came */

    /* The thread's own. */
    int64_t due_ns[N_DUE];
    bool is_heartbeat_on;
    int64_t last_mark_edge_ns; /* up or down */

    pthread_mutex_t lock; /* of what follows */
    bool has_mark;
    int64_t mark_ns;
    int64_t pulses_ns[N_PULSES];
    uint64_t n_pulses;
};

static const char *const role_names[N_ROLES] = {"trigger", "strobe", "heartbeat", "enable", "mark"};

static const oc_gpio_name_t *name_of(const oc_gpio_config_t *config, role_t role)
{
    const oc_gpio_name_t *const names[N_ROLES] = {&config->trigger, &config->strobe, &config->heartbeat,
                                                  &config->enable, &config->mark};
    return names[role];
}

static void note_fault(oc_gpio_t *gpio, role_t role)
{
    if (gpio->is_faulty[role]) return;
    gpio->is_faulty[role] = true;
    oc_counters_add(gpio->counters, OC_COUNT_GPIO_FAULTS, 1);
    fprintf(stderr, "outcropd: gpio %s: the line does not answer any more\n", role_names[role]);
}

static bool set_line(oc_gpio_t *gpio, role_t role, bool is_active)
{
    if (!gpio->ops->set(gpio->lines[role], is_active)) {
        note_fault(gpio, role);
        return false;
    }
    gpio->is_faulty[role] = false;
    return true;
}

/* ---- outputs ---- */

static void count_missed(oc_gpio_t *gpio, int64_t n)
{
    if (n > 0) oc_counters_add(gpio->counters, OC_COUNT_PULSES_MISSED, (uint32_t)n);
}

/* One that still waits for its delay is not put off: frames that keep coming would put it off for ever. */
static void strobe_after(oc_gpio_t *gpio, int64_t begin_ns)
{
    int64_t *due_ns = &gpio->due_ns[DUE_STROBE_ON];
    if (!gpio->lines[ROLE_STROBE]) return;
    count_missed(gpio, *due_ns != NEVER);
    if (*due_ns == NEVER) *due_ns = begin_ns + gpio->config.strobe_delay_us * NS_PER_US;
}

/* Not while the pulse before lasts: a camera would see no edge, a lamp would burn too long. */
static void strobe_on(oc_gpio_t *gpio)
{
    gpio->due_ns[DUE_STROBE_ON] = NEVER;
    count_missed(gpio, gpio->due_ns[DUE_STROBE_OFF] != NEVER);
    if (gpio->due_ns[DUE_STROBE_OFF] != NEVER) return;
    (void)set_line(gpio, ROLE_STROBE, true);
    gpio->due_ns[DUE_STROBE_OFF] = oc_mono_ns() + gpio->config.strobe_pulse_us * NS_PER_US;
}

static void forget_pulse(oc_gpio_t *gpio)
{
    pthread_mutex_lock(&gpio->lock);
    gpio->pulses_ns[--gpio->n_pulses % N_PULSES] = NEVER;
    pthread_mutex_unlock(&gpio->lock);
}

/* Dated and remembered before the line is set, so that no frame comes before its pulse. */
static void pulse_begin(oc_gpio_t *gpio)
{
    count_missed(gpio, gpio->due_ns[DUE_TRIGGER_OFF] != NEVER);
    if (gpio->due_ns[DUE_TRIGGER_OFF] != NEVER) return;
    const int64_t begin_ns = oc_mono_ns();
    pthread_mutex_lock(&gpio->lock);
    gpio->pulses_ns[gpio->n_pulses++ % N_PULSES] = begin_ns;
    pthread_mutex_unlock(&gpio->lock);
    if (!set_line(gpio, ROLE_TRIGGER, true)) forget_pulse(gpio);
    gpio->due_ns[DUE_TRIGGER_OFF] = oc_mono_ns() + gpio->config.trigger_pulse_us * NS_PER_US;
    strobe_after(gpio, begin_ns);
}

/* A pulse that is a whole period late is not given: the camera would be exposed at a time that nobody asked for. */
static void trigger_on(oc_gpio_t *gpio, int64_t now)
{
    int64_t *due_ns = &gpio->due_ns[DUE_TRIGGER_ON];
    if (gpio->config.trigger_mode == OC_TRIGGER_PER_FRAME) {
        *due_ns = NEVER;
        pulse_begin(gpio);
        return;
    }
    const int64_t period_ns = (int64_t)((double)NS_PER_S / gpio->config.trigger_rate_hz);
    const int64_t n_late = (now - *due_ns) / period_ns;
    count_missed(gpio, n_late);
    *due_ns += (n_late + 1) * period_ns;
    pulse_begin(gpio);
}

static void heartbeat(oc_gpio_t *gpio, int64_t now)
{
    const int64_t last_ns = atomic_load(&gpio->last_frame_ns);
    const bool is_alive = last_ns != 0 && now - last_ns < HEARTBEAT_PATIENCE_NS;
    gpio->is_heartbeat_on = is_alive && !gpio->is_heartbeat_on;
    (void)set_line(gpio, ROLE_HEARTBEAT, gpio->is_heartbeat_on);
    gpio->due_ns[DUE_HEARTBEAT] = now + gpio->config.heartbeat_ms * NS_PER_MS;
}

/* ---- inputs ---- */

static void set_enabled(oc_gpio_t *gpio, bool is_enabled)
{
    if (atomic_exchange(&gpio->is_enabled, is_enabled) != is_enabled) oc_doorbell_ring(gpio->news_fd);
}

/* The level itself: right even when edges were lost. Without an answer the last state stays. */
static void reread_enable(oc_gpio_t *gpio)
{
    if (!gpio->lines[ROLE_ENABLE]) return;
    const int level = gpio->ops->get(gpio->lines[ROLE_ENABLE]);
    if (level < 0) {
        note_fault(gpio, ROLE_ENABLE);
        return;
    }
    gpio->is_faulty[ROLE_ENABLE] = false;
    set_enabled(gpio, level == 1);
}

/* A contact bounces when it opens as well: any edge that was close makes this one part of the same stroke. */
static void take_mark_edge(oc_gpio_t *gpio, const oc_gpio_edge_t *edge)
{
    const int64_t last_ns = gpio->last_mark_edge_ns;
    gpio->last_mark_edge_ns = edge->mono_ns;
    if (!edge->is_active) return;
    if (last_ns != 0 && edge->mono_ns - last_ns < gpio->config.mark_debounce_ms * NS_PER_MS) return;
    pthread_mutex_lock(&gpio->lock);
    const bool is_dropped = gpio->has_mark;
    if (!is_dropped) gpio->mark_ns = edge->mono_ns;
    gpio->has_mark = true;
    pthread_mutex_unlock(&gpio->lock);
    if (is_dropped) oc_counters_add(gpio->counters, OC_COUNT_MARKS_DROPPED, 1);
    oc_doorbell_ring(gpio->news_fd);
}

/* False when the line is dead and need not be polled any more. */
static bool take_edges(oc_gpio_t *gpio, role_t role)
{
    oc_gpio_edge_t edge;
    oc_gpio_result_t result = OC_GPIO_EDGE;
    for (int i = 0; i < MAX_EDGES && result == OC_GPIO_EDGE; i++) {
        result = gpio->ops->take_edge(gpio->lines[role], &edge);
        if (result == OC_GPIO_EDGE && role == ROLE_MARK) take_mark_edge(gpio, &edge);
    }
    if (role == ROLE_ENABLE) reread_enable(gpio);
    return result != OC_GPIO_FAULT;
}

/* Where a line's chip went away, poll would come back at once for ever. */
static void serve_input(oc_gpio_t *gpio, role_t role, struct pollfd *fd)
{
    if (!fd->revents) return;
    const bool is_gone = (fd->revents & (POLLERR | POLLHUP | POLLNVAL)) != 0;
    if (take_edges(gpio, role) && !is_gone) return;
    note_fault(gpio, role);
    fd->fd = -1;
}

/* ---- the thread ---- */

static void carry_out(oc_gpio_t *gpio, due_t due, int64_t now)
{
    switch (due) {
    case DUE_TRIGGER_ON: trigger_on(gpio, now); return;
    case DUE_TRIGGER_OFF: (void)set_line(gpio, ROLE_TRIGGER, false); break;
    case DUE_STROBE_ON: strobe_on(gpio); return;
    case DUE_STROBE_OFF: (void)set_line(gpio, ROLE_STROBE, false); break;
    case DUE_HEARTBEAT: heartbeat(gpio, now); return;
    case DUE_REREAD:
        reread_enable(gpio);
        gpio->due_ns[DUE_REREAD] = now + REREAD_NS;
        return;
    case N_DUE: return;
    }
    gpio->due_ns[due] = NEVER;
}

static due_t next_due(const oc_gpio_t *gpio)
{
    due_t next = 0;
    for (int i = 1; i < N_DUE; i++) {
        if (gpio->due_ns[i] < gpio->due_ns[next]) next = (due_t)i;
    }
    return next;
}

static void on_command(oc_gpio_t *gpio)
{
    oc_doorbell_clear(gpio->command_fd);
    if (!atomic_exchange(&gpio->has_frame, false)) return;
    if (gpio->lines[ROLE_TRIGGER]) {
        if (gpio->config.trigger_mode == OC_TRIGGER_PER_FRAME) gpio->due_ns[DUE_TRIGGER_ON] = oc_mono_ns();
    } else {
        strobe_after(gpio, oc_mono_ns());
    }
}

static void *thread_main(void *user)
{
    oc_gpio_t *gpio = user;
    (void)prctl(PR_SET_TIMERSLACK, 1UL); /* pulses as exact as the kernel can */
    struct pollfd fds[3] = {{gpio->command_fd, POLLIN, 0}, {-1, POLLIN, 0}, {-1, POLLIN, 0}};
    const role_t inputs[3] = {N_ROLES, ROLE_ENABLE, ROLE_MARK};
    for (int i = 1; i < 3; i++) {
        if (gpio->lines[inputs[i]]) fds[i].fd = gpio->ops->fd(gpio->lines[inputs[i]]);
    }
    while (!atomic_load(&gpio->is_stopped)) {
        const due_t due = next_due(gpio);
        const int64_t now = oc_mono_ns();
        if (gpio->due_ns[due] <= now) {
            carry_out(gpio, due, now);
            continue;
        }
        const int64_t wait_ns = gpio->due_ns[due] == NEVER ? REREAD_NS : gpio->due_ns[due] - now;
        const struct timespec timeout = {wait_ns / NS_PER_S, wait_ns % NS_PER_S};
        if (ppoll(fds, 3, &timeout, NULL) <= 0) continue;
        if (fds[0].revents) on_command(gpio);
        for (int i = 1; i < 3; i++) serve_input(gpio, inputs[i], &fds[i]);
    }
    return NULL;
}

/* ---- opening ---- */

static bool open_lines(oc_gpio_t *gpio, char *error, size_t error_bytes)
{
    for (int i = 0; i < N_ROLES; i++) {
        const oc_gpio_name_t *name = name_of(&gpio->config, (role_t)i);
        if (!name->is_used) continue;
        gpio->lines[i] = i == ROLE_ENABLE || i == ROLE_MARK
                             ? gpio->ops->open_input(role_names[i], name, error, error_bytes)
                             : gpio->ops->open_output(role_names[i], name, false, error, error_bytes);
        if (!gpio->lines[i]) return false;
    }
    return true;
}

static void schedule(oc_gpio_t *gpio)
{
    const int64_t now = oc_mono_ns();
    for (int i = 0; i < N_DUE; i++) gpio->due_ns[i] = NEVER;
    if (gpio->lines[ROLE_TRIGGER] && gpio->config.trigger_mode == OC_TRIGGER_PERIODIC)
        gpio->due_ns[DUE_TRIGGER_ON] = now;
    if (gpio->lines[ROLE_HEARTBEAT]) gpio->due_ns[DUE_HEARTBEAT] = now;
    if (gpio->lines[ROLE_ENABLE]) gpio->due_ns[DUE_REREAD] = now + REREAD_NS;
}

static bool gpio_open(oc_gpio_t *gpio, char *error, size_t error_bytes)
{
    gpio->command_fd = oc_doorbell_open();
    gpio->news_fd = oc_doorbell_open();
    if (gpio->command_fd < 0 || gpio->news_fd < 0) {
        snprintf(error, error_bytes, "eventfd: %s", strerror(errno));
        return false;
    }
    if (!open_lines(gpio, error, error_bytes)) return false;
    const int level = gpio->lines[ROLE_ENABLE] ? gpio->ops->get(gpio->lines[ROLE_ENABLE]) : 1;
    if (level < 0) {
        snprintf(error, error_bytes, "gpio enable: the level of the line cannot be read");
        return false;
    }
    atomic_store(&gpio->is_enabled, level == 1);
    schedule(gpio);
    const int failed = pthread_create(&gpio->thread, NULL, thread_main, gpio);
    if (failed) snprintf(error, error_bytes, "cannot start the thread of the lines: %s", strerror(failed));
    gpio->has_thread = failed == 0;
    return gpio->has_thread;
}

oc_gpio_t *oc_gpio_open(const oc_gpio_config_t *config, const oc_gpio_ops_t *ops, oc_counters_t *counters, char *error,
                        size_t error_bytes)
{
    oc_gpio_t *gpio = calloc(1, sizeof *gpio);
    if (!gpio) {
        snprintf(error, error_bytes, "out of memory");
        return NULL;
    }
    gpio->config = *config;
    gpio->ops = ops;
    gpio->counters = counters;
    gpio->command_fd = gpio->news_fd = -1;
    pthread_mutex_init(&gpio->lock, NULL);
    if (gpio_open(gpio, error, error_bytes)) return gpio;
    oc_gpio_close(gpio);
    return NULL;
}

void oc_gpio_close(oc_gpio_t *gpio)
{
    if (!gpio) return;
    if (gpio->has_thread) {
        atomic_store(&gpio->is_stopped, true);
        oc_doorbell_ring(gpio->command_fd);
        pthread_join(gpio->thread, NULL);
    }
    for (int i = 0; i < N_ROLES; i++) {
        if (gpio->lines[i]) gpio->ops->close(gpio->lines[i]);
    }
    if (gpio->command_fd >= 0) close(gpio->command_fd);
    if (gpio->news_fd >= 0) close(gpio->news_fd);
    pthread_mutex_destroy(&gpio->lock);
    free(gpio);
}

/* ---- the loop's side ---- */

int oc_gpio_fd(const oc_gpio_t *gpio)
{
    return gpio->news_fd;
}

void oc_gpio_clear(oc_gpio_t *gpio)
{
    oc_doorbell_clear(gpio->news_fd);
}

bool oc_gpio_is_enabled(const oc_gpio_t *gpio)
{
    return atomic_load(&((oc_gpio_t *)(uintptr_t)gpio)->is_enabled);
}

bool oc_gpio_take_mark(oc_gpio_t *gpio, int64_t *mono_ns)
{
    pthread_mutex_lock(&gpio->lock);
    const bool has_mark = gpio->has_mark;
    if (has_mark) *mono_ns = gpio->mark_ns;
    gpio->has_mark = false;
    pthread_mutex_unlock(&gpio->lock);
    return has_mark;
}

void oc_gpio_frame(oc_gpio_t *gpio)
{
    atomic_store(&gpio->last_frame_ns, oc_mono_ns());
    const bool is_awaited = gpio->lines[ROLE_TRIGGER] ? gpio->config.trigger_mode == OC_TRIGGER_PER_FRAME
                                                      : gpio->lines[ROLE_STROBE] != NULL;
    if (!is_awaited) return;
    count_missed(gpio, atomic_exchange(&gpio->has_frame, true)); /* the thread has not come round to the one before */
    oc_doorbell_ring(gpio->command_fd);
}

bool oc_gpio_pulse_of(const oc_gpio_t *gpio, int64_t mono_ns, int64_t *pulse_ns)
{
    oc_gpio_t *g = (oc_gpio_t *)(uintptr_t)gpio;
    if (g->config.trigger_mode != OC_TRIGGER_PERIODIC) return false;
    const int64_t period_ns = (int64_t)((double)NS_PER_S / g->config.trigger_rate_hz);
    bool is_found = false;
    pthread_mutex_lock(&g->lock);
    const uint64_t n = g->n_pulses < N_PULSES ? g->n_pulses : N_PULSES;
    for (uint64_t i = 1; i <= n && !is_found; i++) {
        const int64_t begin_ns = g->pulses_ns[(g->n_pulses - i) % N_PULSES];
        if (begin_ns > mono_ns) continue;
        is_found = mono_ns - begin_ns <= period_ns;
        *pulse_ns = begin_ns;
        break;
    }
    pthread_mutex_unlock(&g->lock);
    return is_found;
}
