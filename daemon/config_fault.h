/* SPDX-License-Identifier: BSD-3-Clause
 * How a configuration file's faults are told, one call each. */
#ifndef OUTCROP_DAEMON_CONFIG_FAULT_H
#define OUTCROP_DAEMON_CONFIG_FAULT_H

#ifdef __cplusplus
extern "C" {
#endif

/* One fault of a configuration file: "FILE:LINE: key: what is wrong", without control characters. */
typedef void (*oc_config_fault_t)(void *user, const char *line);

#ifdef __cplusplus
}
#endif
#endif
