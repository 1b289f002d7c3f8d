/* SPDX-License-Identifier: BSD-3-Clause
 * What a service manager wants to hear (systemd's notify protocol). All are
 * no-ops when nobody listens. */
#ifndef OUTCROP_DAEMON_SERVICE_H
#define OUTCROP_DAEMON_SERVICE_H

#include <stdbool.h>
#include <stdint.h>

/* Nanoseconds between two signs of life that the manager's watchdog is
 * content with (half its limit); 0 = it has none. */
int64_t oc_service_watchdog_ns(void);

void oc_service_ready(const char *status);  /* start-up is complete */
void oc_service_alive(void);                /* a sign of life; does not allocate */
void oc_service_status(const char *status); /* one line for systemctl status; does not allocate */
void oc_service_stopping(void);

#endif
