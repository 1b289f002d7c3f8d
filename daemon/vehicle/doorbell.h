/* SPDX-License-Identifier: BSD-3-Clause
 * One thread tells another that there is something: a descriptor that is readable from a ring to the next clear. */
#ifndef OUTCROP_DAEMON_DOORBELL_H
#define OUTCROP_DAEMON_DOORBELL_H

#include <stdint.h>
#include <sys/eventfd.h>
#include <unistd.h>

/* A descriptor to close, or -1 with errno set. */
static inline int oc_doorbell_open(void)
{
    return eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
}

/* Neither blocks nor allocates. Many rings before a clear are one. */
static inline void oc_doorbell_ring(int fd)
{
    const uint64_t one = 1;
    if (write(fd, &one, sizeof one) < 0) return; /* full: it is readable already */
}

static inline void oc_doorbell_clear(int fd)
{
    uint64_t n;
    if (read(fd, &n, sizeof n) < 0) return; /* nothing to clear */
}

#endif
