/* SPDX-License-Identifier: BSD-3-Clause
 * Ground tiles through the worker: what the codec gives by itself, in the order they were posted. */
#include "unity.h"

#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "pixel_codec.h"
#include "tile_worker.h"

static oc_tile_worker_t *worker;

void setUp(void)
{
    worker = oc_tile_worker_create();
    TEST_ASSERT_NOT_NULL(worker);
}

void tearDown(void)
{
    oc_tile_worker_destroy(worker);
}

static void fill(oc_tile_job_t *job, uint16_t n, uint16_t tile_px, size_t max_bytes)
{
    job->view = n;
    job->tile_px = tile_px;
    job->quality = 60;
    job->max_bytes = max_bytes;
    uint32_t state = n + 1u;
    for (size_t i = 0; i < 3u * tile_px * tile_px; i++) {
        state = state * 1664525u + 1013904223u;
        job->px[i] = (uint8_t)(state >> 26 | (i & 127u));
    }
}

static const oc_tile_job_t *await_oldest(void)
{
    for (;;) {
        const oc_tile_job_t *job = oc_tile_worker_oldest_done(worker);
        if (job) return job;
        struct pollfd fd = {oc_tile_worker_fd(worker), POLLIN, 0};
        TEST_ASSERT_EQUAL_MESSAGE(1, poll(&fd, 1, 60000), "the worker has not called");
    }
}

static void check_against_codec(const oc_tile_job_t *job)
{
    uint8_t expected[OC_MAX_DATAGRAM_BYTES];
    size_t n_bytes = 0;
    const oc_image_t image = {job->px, job->tile_px, job->tile_px, 3u * job->tile_px, 3};
    const bool is_encoded = oc_pixel_encode_within(&image, job->quality, expected, job->max_bytes, &n_bytes);
    TEST_ASSERT_EQUAL(is_encoded, job->is_encoded);
    if (!is_encoded) return;
    TEST_ASSERT_EQUAL(n_bytes, job->n_bytes);
    TEST_ASSERT_EQUAL_MEMORY(expected, job->bytes, n_bytes);
}

static void tiles_come_back_in_order_as_the_codec_makes_them(void)
{
    uint16_t n_posted = 0, n_back = 0, n_encoded = 0;
    while (n_back < 60) {
        oc_tile_job_t *job;
        while (n_posted < 60 && (job = oc_tile_worker_next_free(worker))) {
            fill(job, n_posted, (uint16_t)(16 + n_posted % 5 * 16), n_posted % 7 == 3 ? 40 : 1200);
            oc_tile_worker_post(worker);
            n_posted++;
        }
        const oc_tile_job_t *done = await_oldest();
        TEST_ASSERT_EQUAL(n_back, done->view);
        check_against_codec(done);
        n_encoded += done->is_encoded;
        oc_tile_worker_release(worker);
        n_back++;
    }
    TEST_ASSERT_TRUE(n_encoded > 30 && n_encoded < 60); /* both kinds were met */
    TEST_ASSERT_NULL(oc_tile_worker_oldest_done(worker));
}

static void no_more_jobs_than_there_is_room_for(void)
{
    for (uint16_t i = 0; i < OC_TILE_JOBS; i++) {
        oc_tile_job_t *job = oc_tile_worker_next_free(worker);
        TEST_ASSERT_NOT_NULL(job);
        fill(job, i, 32, 1200);
        oc_tile_worker_post(worker);
    }
    TEST_ASSERT_NULL(oc_tile_worker_next_free(worker));
    (void)await_oldest();
    TEST_ASSERT_NULL(oc_tile_worker_next_free(worker)); /* done, but still being read */
    oc_tile_worker_release(worker);
    TEST_ASSERT_NOT_NULL(oc_tile_worker_next_free(worker));
}

static void it_ends_with_work_on_its_table(void)
{
    for (uint16_t i = 0; i < OC_TILE_JOBS; i++) {
        fill(oc_tile_worker_next_free(worker), i, 256, 1200);
        oc_tile_worker_post(worker);
    } /* tearDown */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(tiles_come_back_in_order_as_the_codec_makes_them);
    RUN_TEST(no_more_jobs_than_there_is_room_for);
    RUN_TEST(it_ends_with_work_on_its_table);
    return UNITY_END();
}
