/* SPDX-License-Identifier: BSD-3-Clause
 * What the tests of the lines share: lines that the test plays, a configuration, the thread over them. */
#ifndef OUTCROP_TESTS_DAEMON_GPIO_RIG_H
#define OUTCROP_TESTS_DAEMON_GPIO_RIG_H

#include "fake_gpio.h"
#include "gpio.h"

#define NS_PER_MS 1000000LL
#define NS_PER_S 1000000000LL

static oc_counters_t counters;
static oc_gpio_config_t config;
static oc_gpio_t *gpio;
static char error[256];

static inline void rig_set_up(void)
{
    fake_reset();
    memset(&counters, 0, sizeof counters);
    config = (oc_gpio_config_t){.trigger_mode = OC_TRIGGER_PERIODIC,
                                .trigger_rate_hz = 50,
                                .trigger_pulse_us = 1000,
                                .strobe_pulse_us = 1000,
                                .heartbeat_ms = 50,
                                .mark_debounce_ms = 50};
}

static inline void rig_tear_down(void)
{
    fake_release();
    oc_gpio_close(gpio);
    gpio = NULL;
}

static inline void open_all_right(void)
{
    gpio = oc_gpio_open(&config, &fake_ops, &counters, error, sizeof error);
    TEST_ASSERT_NOT_NULL_MESSAGE(gpio, error);
}

static inline void close_now(void)
{
    oc_gpio_close(gpio);
    gpio = NULL;
}

static inline uint32_t count_of(oc_counter_t counter)
{
    return oc_counters_get(&counters, counter);
}

#endif
