/* SPDX-License-Identifier: BSD-3-Clause
 * A ring of jobs: filled and released by one thread, done in order by the other. */
#include "tile_worker.h"

#include <pthread.h>
#include <stdlib.h>
#include <unistd.h>

#include "doorbell.h"
#include "pixel_codec.h"

struct oc_tile_worker {
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t posted;
    bool is_stopped;
    int done_fd;
    uint64_t n_posted, n_done, n_released; /* n_released <= n_done <= n_posted <= n_released + OC_TILE_JOBS */
    oc_tile_job_t jobs[OC_TILE_JOBS];
};

static void encode(oc_tile_job_t *job)
{
    const oc_image_t image = {job->px, job->tile_px, job->tile_px, 3u * job->tile_px, 3};
    job->is_encoded = oc_pixel_encode_within(&image, job->quality, job->bytes, job->max_bytes, &job->n_bytes);
}

static void *thread_main(void *user)
{
    oc_tile_worker_t *w = user;
    pthread_mutex_lock(&w->lock);
    for (;;) {
        while (!w->is_stopped && w->n_done == w->n_posted) pthread_cond_wait(&w->posted, &w->lock);
        if (w->is_stopped) break;
        oc_tile_job_t *job = &w->jobs[w->n_done % OC_TILE_JOBS];
        pthread_mutex_unlock(&w->lock);
        encode(job);
        pthread_mutex_lock(&w->lock);
        w->n_done++;
        oc_doorbell_ring(w->done_fd);
    }
    pthread_mutex_unlock(&w->lock);
    return NULL;
}

oc_tile_worker_t *oc_tile_worker_create(void)
{
    oc_tile_worker_t *w = calloc(1, sizeof *w);
    if (!w) return NULL;
    w->done_fd = oc_doorbell_open();
    if (w->done_fd < 0) {
        free(w);
        return NULL;
    }
    pthread_mutex_init(&w->lock, NULL);
    pthread_cond_init(&w->posted, NULL);
    if (pthread_create(&w->thread, NULL, thread_main, w) == 0) return w;
    close(w->done_fd);
    free(w);
    return NULL;
}

void oc_tile_worker_destroy(oc_tile_worker_t *w)
{
    if (!w) return;
    pthread_mutex_lock(&w->lock);
    w->is_stopped = true;
    pthread_cond_signal(&w->posted);
    pthread_mutex_unlock(&w->lock);
    pthread_join(w->thread, NULL);
    close(w->done_fd);
    pthread_cond_destroy(&w->posted);
    pthread_mutex_destroy(&w->lock);
    free(w);
}

oc_tile_job_t *oc_tile_worker_next_free(oc_tile_worker_t *w)
{
    pthread_mutex_lock(&w->lock);
    oc_tile_job_t *job = w->n_posted - w->n_released < OC_TILE_JOBS ? &w->jobs[w->n_posted % OC_TILE_JOBS] : NULL;
    pthread_mutex_unlock(&w->lock);
    return job;
}

void oc_tile_worker_post(oc_tile_worker_t *w)
{
    pthread_mutex_lock(&w->lock);
    w->n_posted++;
    pthread_cond_signal(&w->posted);
    pthread_mutex_unlock(&w->lock);
}

const oc_tile_job_t *oc_tile_worker_oldest_done(oc_tile_worker_t *w)
{
    oc_doorbell_clear(w->done_fd);
    pthread_mutex_lock(&w->lock);
    const oc_tile_job_t *job = w->n_released < w->n_done ? &w->jobs[w->n_released % OC_TILE_JOBS] : NULL;
    pthread_mutex_unlock(&w->lock);
    return job;
}

void oc_tile_worker_release(oc_tile_worker_t *w)
{
    pthread_mutex_lock(&w->lock);
    w->n_released++;
    pthread_mutex_unlock(&w->lock);
}

int oc_tile_worker_fd(const oc_tile_worker_t *w)
{
    return w->done_fd;
}
