/* SPDX-License-Identifier: BSD-3-Clause
 * systemd's notify protocol through libsystemd. */
#include "service.h"

#include <stdio.h>
#include <systemd/sd-daemon.h>

int64_t oc_service_watchdog_ns(void)
{
    uint64_t limit_us;
    return sd_watchdog_enabled(0, &limit_us) > 0 ? (int64_t)limit_us * 1000 / 2 : 0;
}

/* Whoever does not listen is no fault of ours: results are not looked at. */
void oc_service_ready(const char *status)
{
    (void)sd_notifyf(0, "READY=1\nSTATUS=%s", status);
}

void oc_service_alive(void)
{
    (void)sd_notify(0, "WATCHDOG=1");
}

void oc_service_status(const char *status)
{
    char text[256];
    snprintf(text, sizeof text, "STATUS=%s", status);
    (void)sd_notify(0, text);
}

void oc_service_stopping(void)
{
    (void)sd_notify(0, "STOPPING=1");
}
