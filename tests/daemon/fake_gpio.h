/* SPDX-License-Identifier: BSD-3-Clause
 * Lines that a test plays: every call that sets one is kept with its time, edges come through a pipe. */
#ifndef OUTCROP_DAEMON_FAKE_GPIO_H
#define OUTCROP_DAEMON_FAKE_GPIO_H

#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "gpio_line.h"
#include "unity.h"

#define FAKE_MAX_SETS 8192
#define FAKE_DEADLINE_NS 120000000000LL

typedef enum fake_role { FAKE_TRIGGER, FAKE_STROBE, FAKE_HEARTBEAT, FAKE_ENABLE, FAKE_MARK, FAKE_N_ROLES } fake_role_t;

struct oc_gpio_line {
    bool is_open, is_output, is_active;
    oc_gpio_name_t name;
    int level;                           /* what get answers */
    bool is_stuck, is_dead, is_swinging; /* set fails; take_edge fails; edges without end */
    int pipe_fds[2];
    uint32_t n_opened, n_closed, n_gets, n_edges, n_nones, n_takes;
};

typedef struct fake_set {
    fake_role_t role;
    bool is_active;
    int64_t at_ns;
} fake_set_t;

static const char *const fake_names[FAKE_N_ROLES] = {"trigger", "strobe", "heartbeat", "enable", "mark"};

/* Held by a test: the thread stands still in its next call of set. */
static pthread_mutex_t fake_gate = PTHREAD_MUTEX_INITIALIZER;
static bool fake_is_held;

static pthread_mutex_t fake_lock = PTHREAD_MUTEX_INITIALIZER; /* of what follows */
static oc_gpio_line_t fake_lines[FAKE_N_ROLES];
static fake_set_t fake_sets[FAKE_MAX_SETS];
static uint32_t fake_n_sets;
static int fake_opens_left; /* then opening fails; < 0: never */

static inline int64_t fake_now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static inline void fake_hold(void)
{
    pthread_mutex_lock(&fake_gate);
    fake_is_held = true;
}

/* Also for tearDown, when a test failed while it held the thread. */
static inline void fake_release(void)
{
    if (fake_is_held) pthread_mutex_unlock(&fake_gate);
    fake_is_held = false;
}

static inline void fake_reset(void)
{
    memset(fake_lines, 0, sizeof fake_lines);
    fake_n_sets = 0;
    fake_opens_left = -1;
}

static inline oc_gpio_line_t *fake_open(const char *role, const oc_gpio_name_t *name, bool is_output, char *error,
                                        size_t error_bytes)
{
    int i = 0;
    while (i < FAKE_N_ROLES && strcmp(fake_names[i], role) != 0) i++;
    TEST_ASSERT_TRUE_MESSAGE(i < FAKE_N_ROLES, role);
    oc_gpio_line_t *line = &fake_lines[i];
    if (fake_opens_left == 0) {
        snprintf(error, error_bytes, "gpio %s: refused", role);
        return NULL;
    }
    if (fake_opens_left > 0) fake_opens_left--;
    TEST_ASSERT_FALSE(line->is_open);
    TEST_ASSERT_EQUAL(0, pipe2(line->pipe_fds, O_NONBLOCK | O_CLOEXEC));
    line->is_open = true;
    line->is_output = is_output;
    line->name = *name;
    line->n_opened++;
    return line;
}

static inline oc_gpio_line_t *fake_open_output(const char *role, const oc_gpio_name_t *name, bool is_active,
                                               char *error, size_t error_bytes)
{
    TEST_ASSERT_FALSE(is_active);
    return fake_open(role, name, true, error, error_bytes);
}

static inline oc_gpio_line_t *fake_open_input(const char *role, const oc_gpio_name_t *name, char *error,
                                              size_t error_bytes)
{
    return fake_open(role, name, false, error, error_bytes);
}

static inline bool fake_line_set(oc_gpio_line_t *line, bool is_active)
{
    pthread_mutex_lock(&fake_gate);
    pthread_mutex_unlock(&fake_gate);
    pthread_mutex_lock(&fake_lock);
    const bool is_set = line->is_open && line->is_output && !line->is_stuck && fake_n_sets < FAKE_MAX_SETS;
    if (is_set) {
        fake_sets[fake_n_sets++] = (fake_set_t){(fake_role_t)(line - fake_lines), is_active, fake_now_ns()};
        line->is_active = is_active;
    }
    pthread_mutex_unlock(&fake_lock);
    return is_set;
}

static inline int fake_get(oc_gpio_line_t *line)
{
    pthread_mutex_lock(&fake_lock);
    line->n_gets++;
    const int level = line->level;
    pthread_mutex_unlock(&fake_lock);
    return level;
}

static inline int fake_fd(const oc_gpio_line_t *line)
{
    return line->pipe_fds[0];
}

static inline oc_gpio_result_t fake_take_edge(oc_gpio_line_t *line, oc_gpio_edge_t *edge)
{
    pthread_mutex_lock(&fake_lock);
    oc_gpio_result_t result = OC_GPIO_EDGE;
    line->n_takes++;
    if (line->is_dead) {
        result = OC_GPIO_FAULT;
    } else if (line->is_swinging) {
        *edge = (oc_gpio_edge_t){line->n_edges % 2 == 0, fake_now_ns()};
    } else if (read(line->pipe_fds[0], edge, sizeof *edge) != (ssize_t)sizeof *edge) {
        result = OC_GPIO_NONE;
    }
    line->n_edges += result == OC_GPIO_EDGE;
    line->n_nones += result == OC_GPIO_NONE;
    pthread_mutex_unlock(&fake_lock);
    return result;
}

static inline void fake_close(oc_gpio_line_t *line)
{
    pthread_mutex_lock(&fake_lock);
    TEST_ASSERT_TRUE(line->is_open);
    line->is_open = line->is_active = false; /* as the contract of close has it */
    line->n_closed++;
    close(line->pipe_fds[0]);
    if (line->pipe_fds[1] >= 0) close(line->pipe_fds[1]);
    pthread_mutex_unlock(&fake_lock);
}

static const oc_gpio_ops_t fake_ops = {fake_open_output, fake_open_input, fake_line_set, fake_get,
                                       fake_fd,          fake_take_edge,  fake_close};

/* ---- what a test does to the lines and asks of them ---- */

#define FAKE_CHANGE(role, field, value)                                                                                \
    do {                                                                                                               \
        pthread_mutex_lock(&fake_lock);                                                                                \
        fake_lines[role].field = (value);                                                                              \
        pthread_mutex_unlock(&fake_lock);                                                                              \
    } while (0)

static inline void fake_edge(fake_role_t role, bool is_active, int64_t mono_ns)
{
    oc_gpio_edge_t edge;
    memset(&edge, 0, sizeof edge);
    edge.is_active = is_active;
    edge.mono_ns = mono_ns;
    TEST_ASSERT_EQUAL(sizeof edge, write(fake_lines[role].pipe_fds[1], &edge, sizeof edge));
}

static inline oc_gpio_line_t fake_look(fake_role_t role)
{
    pthread_mutex_lock(&fake_lock);
    const oc_gpio_line_t line = fake_lines[role];
    pthread_mutex_unlock(&fake_lock);
    return line;
}

/* The calls of set of one line, oldest first; returns how many. */
static inline uint32_t fake_sets_of(fake_role_t role, fake_set_t out[FAKE_MAX_SETS])
{
    uint32_t n = 0;
    pthread_mutex_lock(&fake_lock);
    for (uint32_t i = 0; i < fake_n_sets; i++) {
        if (fake_sets[i].role == role) out[n++] = fake_sets[i];
    }
    pthread_mutex_unlock(&fake_lock);
    return n;
}

static inline uint32_t fake_count(fake_role_t role, bool is_active)
{
    uint32_t n = 0;
    pthread_mutex_lock(&fake_lock);
    for (uint32_t i = 0; i < fake_n_sets; i++) n += fake_sets[i].role == role && fake_sets[i].is_active == is_active;
    pthread_mutex_unlock(&fake_lock);
    return n;
}

static inline void fake_sleep_us(long us)
{
    const struct timespec t = {us / 1000000, us % 1000000 * 1000};
    nanosleep(&t, NULL);
}

/* Waits for something that the other thread must do some time; only a hang fails. */
#define FAKE_AWAIT(condition)                                                                                          \
    do {                                                                                                               \
        const int64_t deadline_ns = fake_now_ns() + FAKE_DEADLINE_NS;                                                  \
        while (!(condition)) {                                                                                         \
            TEST_ASSERT_TRUE_MESSAGE(fake_now_ns() < deadline_ns, #condition);                                         \
            fake_sleep_us(500);                                                                                        \
        }                                                                                                              \
    } while (0)

#endif
