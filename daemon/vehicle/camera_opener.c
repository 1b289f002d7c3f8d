/* SPDX-License-Identifier: BSD-3-Clause
 * The threads that open and close cameras. */
#include "camera_opener.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "doorbell.h"

typedef enum order_state { ORDER_NONE, ORDER_GIVEN, ORDER_UNDER_WAY, ORDER_DONE } order_state_t;

typedef struct order {
    order_state_t state;
    oc_video_t *video; /* to be closed */
    const oc_video_wish_t *wish;
    oc_opened_t opened;
} order_t;

/* What a thread is started with. */
typedef struct opener_thread {
    struct oc_camera_opener *opener;
    order_t *order;
    pthread_t id;
} opener_thread_t;

struct oc_camera_opener {
    const oc_video_ops_t *ops;
    pthread_mutex_t lock;
    pthread_cond_t given;
    bool is_stopped;
    int done_fd;
    uint32_t n_threads;
    opener_thread_t threads[OC_MAX_CAMERAS];
    order_t orders[OC_MAX_CAMERAS];
};

static void carry_out(const oc_video_ops_t *ops, order_t *order)
{
    memset(&order->opened, 0, sizeof order->opened);
    if (order->video) {
        ops->close(order->video);
    } else {
        order->opened.video =
            ops->open(order->wish, &order->opened.mode, order->opened.error, sizeof order->opened.error);
    }
}

static void *thread_main(void *user)
{
    const opener_thread_t *thread = user;
    oc_camera_opener_t *opener = thread->opener;
    order_t *order = thread->order;
    pthread_mutex_lock(&opener->lock);
    while (!opener->is_stopped) {
        if (order->state != ORDER_GIVEN) {
            pthread_cond_wait(&opener->given, &opener->lock);
            continue;
        }
        order->state = ORDER_UNDER_WAY;
        pthread_mutex_unlock(&opener->lock);
        carry_out(opener->ops, order);
        pthread_mutex_lock(&opener->lock);
        order->state = ORDER_DONE;
        oc_doorbell_ring(opener->done_fd);
    }
    pthread_mutex_unlock(&opener->lock);
    return NULL;
}

oc_camera_opener_t *oc_camera_opener_create(const oc_video_ops_t *ops, uint32_t n_cameras)
{
    oc_camera_opener_t *opener = calloc(1, sizeof *opener);
    if (!opener) return NULL;
    opener->ops = ops;
    opener->done_fd = oc_doorbell_open();
    pthread_mutex_init(&opener->lock, NULL);
    pthread_cond_init(&opener->given, NULL);
    bool is_ok = opener->done_fd >= 0;
    for (uint32_t i = 0; is_ok && i < n_cameras; i++) {
        opener_thread_t *thread = &opener->threads[i];
        thread->opener = opener;
        thread->order = &opener->orders[i];
        is_ok = pthread_create(&thread->id, NULL, thread_main, thread) == 0;
        opener->n_threads += is_ok;
    }
    if (is_ok) return opener;
    oc_camera_opener_destroy(opener);
    return NULL;
}

void oc_camera_opener_destroy(oc_camera_opener_t *opener)
{
    if (!opener) return;
    pthread_mutex_lock(&opener->lock);
    opener->is_stopped = true;
    pthread_cond_broadcast(&opener->given);
    pthread_mutex_unlock(&opener->lock);
    for (uint32_t i = 0; i < opener->n_threads; i++) pthread_join(opener->threads[i].id, NULL);
    for (uint32_t i = 0; i < OC_MAX_CAMERAS; i++) {
        order_t *order = &opener->orders[i];
        if (order->state == ORDER_GIVEN && order->video) opener->ops->close(order->video);
        if (order->state == ORDER_DONE && order->opened.video) opener->ops->close(order->opened.video);
    }
    if (opener->done_fd >= 0) close(opener->done_fd);
    pthread_cond_destroy(&opener->given);
    pthread_mutex_destroy(&opener->lock);
    free(opener);
}

void oc_camera_opener_order(oc_camera_opener_t *opener, uint32_t camera, oc_video_t *video, const oc_video_wish_t *wish)
{
    pthread_mutex_lock(&opener->lock);
    order_t *order = &opener->orders[camera];
    order->state = ORDER_GIVEN;
    order->video = video;
    order->wish = wish;
    pthread_cond_broadcast(&opener->given);
    pthread_mutex_unlock(&opener->lock);
}

bool oc_camera_opener_collect(oc_camera_opener_t *opener, uint32_t camera, oc_opened_t *opened)
{
    pthread_mutex_lock(&opener->lock);
    order_t *order = &opener->orders[camera];
    const bool is_done = order->state == ORDER_DONE;
    if (is_done) {
        *opened = order->opened;
        order->state = ORDER_NONE;
    }
    pthread_mutex_unlock(&opener->lock);
    return is_done;
}

int oc_camera_opener_fd(const oc_camera_opener_t *opener)
{
    return opener->done_fd;
}

void oc_camera_opener_clear(oc_camera_opener_t *opener)
{
    oc_doorbell_clear(opener->done_fd);
}
