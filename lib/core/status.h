/* SPDX-License-Identifier: BSD-3-Clause
 * Status codes and the contract assert that every C module of Outcrop uses. */
#ifndef OUTCROP_CORE_STATUS_H
#define OUTCROP_CORE_STATUS_H

#include <assert.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The caller broke the contract (NULL, unset workspace). Never used on
 * anything that comes from a wire, a camera or a file. */
#ifndef OC_ASSERT
#define OC_ASSERT(condition) assert(condition)
#endif

#if defined(__GNUC__)
#define OC_CHECKED __attribute__((warn_unused_result))
#else
#define OC_CHECKED
#endif

/* What the data said. 0 is success, failures are negative, so a function may
 * return a count and an error in one int where that helps. Finding nothing is
 * OC_OK with a count of 0. */
typedef enum oc_status {
    OC_OK = 0,
    OC_E_ARG = -1,        /* a value is not a number, out of range, or of the wrong shape */
    OC_E_LIMIT = -2,      /* more than a configured maximum */
    OC_E_DEGENERATE = -3, /* legal input without a solution (parallel rays, points on a line) */
    OC_E_FORMAT = -4,     /* a packet that is cut, of another version, or ill-formed */
    OC_E_SPACE = -5,      /* the caller's buffer or arena is too small */
    OC_E_STATE = -6       /* not now: nothing stored yet, or the thing asked for has gone */
} oc_status_t;

/* One lower-case phrase for a status, never NULL; static storage. */
const char *oc_status_text(oc_status_t status);

#ifdef __cplusplus
}
#endif
#endif
