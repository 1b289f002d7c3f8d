/* SPDX-License-Identifier: BSD-3-Clause
 * The daemon's state as a small JSON file, rewritten every second, and its reader, `outcropd --status`. */
#ifndef OUTCROP_DAEMON_STATUS_FILE_H
#define OUTCROP_DAEMON_STATUS_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "capture.h"
#include "core/packet.h"
#include "latency.h"

/* Where an installed service writes it. */
#define OC_STATUS_FILE "/run/outcrop/outcropd.json"

typedef struct oc_status_report {
    const oc_vehicle_status_t *status; /* all counters already summed */
    uint8_t vehicle;
    int64_t utime_us;
    uint64_t bytes_sent;
    int64_t frame_cpu_us;             /* of the thread of the frames, since the start */
    const oc_latency_t *frame, *view; /* arrival to end of processing: frames that became no view, and those that did */
    const oc_capture_t *capture;
} oc_status_report_t;

/* Write the file whole, beside it first, then renamed. Does not allocate. False, errno set, when it cannot. */
bool oc_status_file_write(const char *path, const oc_status_report_t *report);

/* Print a file's content for people, or as it is with is_json. Returns an exit
 * status: 0 when the daemon that wrote it runs, 1 when it does not or there is
 * no readable file (one line on stderr). */
int oc_status_file_print(const char *path, bool is_json);

#endif
