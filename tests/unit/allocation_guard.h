/* SPDX-License-Identifier: BSD-3-Clause
 * An allocator that aborts once armed: it stands in for the C library's in the whole test program, so that calls from
 * inside the library count as well. Include in one file of the program only. */
#ifndef OUTCROP_UNIT_ALLOCATION_GUARD_H
#define OUTCROP_UNIT_ALLOCATION_GUARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <unistd.h>

static volatile bool guard_is_armed;

static inline void guard_check(void)
{
    static const char text[] = "allocation guard: the heap was asked after the guard was armed\n";
    if (!guard_is_armed) return;
    guard_is_armed = false;
    if (write(STDERR_FILENO, text, sizeof text - 1u) < 0) _exit(3);
    abort();
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) /* whose own allocators have hooks */

extern int __sanitizer_install_malloc_and_free_hooks(void (*on_malloc)(const volatile void *, size_t),
                                                     void (*on_free)(const volatile void *));

static inline void guard_on_malloc(const volatile void *piece, size_t n_bytes)
{
    (void)piece;
    (void)n_bytes;
    guard_check();
}

static inline void guard_on_free(const volatile void *piece)
{
    (void)piece;
    guard_check();
}

static inline void guard_install(void)
{
    (void)__sanitizer_install_malloc_and_free_hooks(guard_on_malloc, guard_on_free);
}

#else

/* glibc's own, by their other names. */
extern void *__libc_malloc(size_t n_bytes);
extern void *__libc_calloc(size_t n, size_t n_bytes);
extern void *__libc_realloc(void *piece, size_t n_bytes);
extern void *__libc_memalign(size_t alignment, size_t n_bytes);
extern void __libc_free(void *piece);

void *malloc(size_t n_bytes)
{
    guard_check();
    return __libc_malloc(n_bytes);
}

void *calloc(size_t n, size_t n_bytes)
{
    guard_check();
    return __libc_calloc(n, n_bytes);
}

void *realloc(void *piece, size_t n_bytes)
{
    guard_check();
    return __libc_realloc(piece, n_bytes);
}

void *aligned_alloc(size_t alignment, size_t n_bytes)
{
    guard_check();
    return __libc_memalign(alignment, n_bytes);
}

int posix_memalign(void **piece, size_t alignment, size_t n_bytes)
{
    guard_check();
    *piece = __libc_memalign(alignment, n_bytes);
    return *piece ? 0 : 12; /* ENOMEM */
}

void free(void *piece)
{
    guard_check();
    __libc_free(piece);
}

static inline void guard_install(void) {}

#endif
#endif
