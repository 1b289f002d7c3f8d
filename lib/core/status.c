/* SPDX-License-Identifier: BSD-3-Clause
 * A phrase for each status code.
 */
#include "core/status.h"

const char *oc_status_text(oc_status_t status)
{
    switch (status) {
    case OC_OK: return "ok";
    case OC_E_ARG: return "a value is out of range or not a number";
    case OC_E_LIMIT: return "more than a configured maximum";
    case OC_E_DEGENERATE: return "no solution for this input";
    case OC_E_FORMAT: return "packet is cut, ill-formed or of another version";
    case OC_E_SPACE: return "buffer or arena is too small";
    case OC_E_STATE: return "not available now";
    }
    return "unknown status";
}
