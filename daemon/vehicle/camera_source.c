/* SPDX-License-Identifier: BSD-3-Clause
 * Several cameras as one source: the oldest frame whose pose is known comes out first. */
#include "camera_source.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "live_camera.h"

#define NS_PER_MS 1000000LL
#define CLOCK_STEP_NS 1000000000LL

typedef struct camera_source {
    oc_capture_t base;
    oc_camera_source_config_t config;
    oc_camera_source_parts_t parts;
    oc_camera_opener_t *opener;
    oc_clock_map_t clock;
    int64_t now_ns; /* of the last call, for --status */
    bool is_step_untold;
    oc_live_camera_t cameras[OC_MAX_CAMERAS];
} camera_source_t;

/* ---- poses ---- */

/* The pose of a camera's oldest frame; frames that will never have one are dropped on the way. */
static bool find_pose(camera_source_t *source, oc_live_camera_t *camera, int64_t now_ns, oc_body_pose_t *pose)
{
    while (camera->n_waiting > 0) {
        const oc_waiting_frame_t *first = &camera->waiting[0];
        const oc_pose_answer_t answer = oc_pose_track_at(source->parts.poses, first->utime_us, pose);
        if (answer == OC_POSE_OK) return true;
        const bool is_late = now_ns - first->arrived_ns >= source->config.pose_wait_ms * NS_PER_MS;
        if (answer == OC_POSE_NOT_YET && !is_late) return false;
        oc_live_camera_drop_oldest(camera, OC_COUNT_FRAMES_NO_POSE, now_ns);
    }
    return false;
}

static oc_live_camera_t *choose(camera_source_t *source, int64_t now_ns, oc_body_pose_t *pose)
{
    oc_live_camera_t *oldest = NULL;
    for (uint32_t i = 0; i < source->config.n_cameras; i++) {
        oc_live_camera_t *camera = &source->cameras[i];
        oc_body_pose_t found;
        if (!find_pose(source, camera, now_ns, &found)) continue;
        if (oldest && oldest->waiting[0].utime_us <= camera->waiting[0].utime_us) continue;
        oldest = camera;
        *pose = found;
    }
    return oldest;
}

/* ---- frames ---- */

static bool is_same_camera(const oc_intrinsics_t *a, const oc_intrinsics_t *b)
{
    return a->fx_px == b->fx_px && a->fy_px == b->fy_px && a->cx_px == b->cx_px && a->cy_px == b->cy_px &&
           a->width_px == b->width_px && a->height_px == b->height_px;
}

static void fill(const camera_source_t *source, const oc_live_camera_t *camera, const oc_waiting_frame_t *waiting,
                 const oc_body_pose_t *pose, oc_captured_t *frame)
{
    const oc_lens_t *lens = &camera->config->lens;
    frame->lens = *lens;
    frame->camera.k = lens->rectified;
    frame->camera.pose = oc_pose_of_camera(pose, &camera->config->body_from_optical);
    frame->margin = source->config.margin;
    if (!source->config.has_fixed_margin)
        frame->margin = oc_margin_of_camera(pose, &camera->config->body_from_optical, &source->config.margin);
    frame->has_distortion = lens->model == OC_LENS_PLUMB_BOB && is_same_camera(&lens->raw, &lens->rectified);
    if (frame->has_distortion) memcpy(frame->distortion.k, lens->k, sizeof frame->distortion.k);
    frame->utime_us = waiting->utime_us;
    frame->arrived_ns = waiting->arrived_ns;
    frame->camera_index = (uint8_t)camera->index;
    frame->is_forced = waiting->is_forced;
}

static bool take_message(camera_source_t *source, char *error, size_t error_bytes)
{
    if (source->is_step_untold) {
        snprintf(error, error_bytes, "the clock has been set: times before and after do not fit together");
        source->is_step_untold = false;
        return true;
    }
    for (uint32_t i = 0; i < source->config.n_cameras; i++) {
        oc_live_camera_t *camera = &source->cameras[i];
        if (!camera->message[0]) continue;
        snprintf(error, error_bytes, "camera %s: %s", camera->config->name, camera->message);
        camera->message[0] = '\0';
        return true;
    }
    return false;
}

static void serve_all(camera_source_t *source, int64_t now_ns)
{
    source->now_ns = now_ns;
    oc_camera_opener_clear(source->opener);
    oc_pose_track_clear(source->parts.poses);
    if (oc_clock_map_update(&source->clock, now_ns, CLOCK_STEP_NS, source->parts.read_clock)) {
        oc_counters_add(source->parts.counters, OC_COUNT_CLOCK_STEPS, 1);
        source->is_step_untold = true;
    }
    int64_t mark_ns;
    if (source->parts.gpio) {
        oc_gpio_clear(source->parts.gpio);
        while (oc_gpio_take_mark(source->parts.gpio, &mark_ns)) {
            oc_counters_add(source->parts.counters, OC_COUNT_MARKS, 1);
            for (uint32_t i = 0; i < source->config.n_cameras; i++) oc_live_camera_mark(&source->cameras[i], mark_ns);
        }
    }
    for (uint32_t i = 0; i < source->config.n_cameras; i++)
        oc_live_camera_serve(&source->cameras[i], now_ns, &source->clock);
}

static oc_capture_result_t source_next(oc_capture_t *self, int64_t now_ns, oc_captured_t *frame, char *error,
                                       size_t error_bytes)
{
    camera_source_t *source = (camera_source_t *)self;
    serve_all(source, now_ns);
    if (take_message(source, error, error_bytes)) return OC_CAPTURE_ERROR;
    oc_body_pose_t pose;
    oc_live_camera_t *camera;
    while ((camera = choose(source, now_ns, &pose))) {
        const oc_waiting_frame_t waiting = camera->waiting[0];
        oc_raw_image_t raw;
        if (!oc_live_camera_hand_out(camera, now_ns, &raw)) continue;
        *frame = (oc_captured_t){.raw = raw};
        fill(source, camera, &waiting, &pose, frame);
        return OC_CAPTURE_FRAME;
    }
    return OC_CAPTURE_NONE;
}

static uint32_t source_wait(oc_capture_t *self, struct pollfd *fds, int64_t *wake_ns)
{
    camera_source_t *source = (camera_source_t *)self;
    uint32_t n = 0;
    fds[n++] = (struct pollfd){oc_camera_opener_fd(source->opener), POLLIN, 0};
    fds[n++] = (struct pollfd){oc_pose_track_fd(source->parts.poses), POLLIN, 0};
    if (source->parts.gpio) fds[n++] = (struct pollfd){oc_gpio_fd(source->parts.gpio), POLLIN, 0};
    *wake_ns = INT64_MAX;
    for (uint32_t i = 0; i < source->config.n_cameras; i++) {
        const oc_live_camera_t *camera = &source->cameras[i];
        int64_t at_ns = oc_live_camera_wake_ns(camera);
        if (camera->state == OC_CAMERA_STREAMING)
            fds[n++] = (struct pollfd){source->parts.video->fd(camera->video), POLLIN, 0};
        if (camera->n_waiting > 0) {
            const int64_t late_ns = camera->waiting[0].arrived_ns + source->config.pose_wait_ms * NS_PER_MS;
            if (late_ns < at_ns) at_ns = late_ns;
        }
        if (at_ns < *wake_ns) *wake_ns = at_ns;
    }
    return n;
}

static size_t source_describe(const oc_capture_t *self, char *text, size_t text_bytes)
{
    const camera_source_t *source = (const camera_source_t *)self;
    size_t n = 0;
    for (uint32_t i = 0; i < source->config.n_cameras && n + 1 < text_bytes; i++) {
        const size_t comma = n > 0;
        const size_t written =
            oc_live_camera_describe(&source->cameras[i], source->now_ns, text + n + comma, text_bytes - n - comma);
        if (written == 0) break;
        if (comma) text[n] = ',';
        n += comma + written;
    }
    return n;
}

static void source_close(oc_capture_t *self)
{
    camera_source_t *source = (camera_source_t *)self;
    oc_camera_opener_destroy(source->opener);
    for (uint32_t i = 0; i < source->config.n_cameras; i++) {
        oc_live_camera_t *camera = &source->cameras[i];
        if (camera->video) source->parts.video->close(camera->video);
        oc_mjpeg_destroy(camera->mjpeg);
    }
    free(source);
}

static void note_size(oc_capture_t *base, const oc_intrinsics_t *k)
{
    if (k->width_px > base->max_width_px) base->max_width_px = k->width_px;
    if (k->height_px > base->max_height_px) base->max_height_px = k->height_px;
}

static bool camera_open(camera_source_t *source, uint32_t index)
{
    oc_live_camera_t *camera = &source->cameras[index];
    const oc_camera_config_t *config = &source->config.cameras[index];
    *camera = (oc_live_camera_t){.config = config,
                                 .parts = &source->parts,
                                 .opener = source->opener,
                                 .index = index,
                                 .last_exposed_ns = INT64_MIN};
    note_size(&source->base, &config->lens.raw);
    note_size(&source->base, &config->lens.rectified);
    if (config->wish.format != OC_PIXEL_MJPG) return true;
    camera->mjpeg = oc_mjpeg_create(config->wish.width_px, config->wish.height_px);
    return camera->mjpeg != NULL;
}

oc_capture_t *oc_camera_source_open(const oc_camera_source_config_t *config, const oc_camera_source_parts_t *parts,
                                    char *error, size_t error_bytes)
{
    camera_source_t *source = calloc(1, sizeof *source);
    bool is_ok = source != NULL;
    if (is_ok) {
        source->config = *config;
        source->config.n_cameras = 0; /* grows with what source_close has to undo */
        source->parts = *parts;
        source->opener = oc_camera_opener_create(parts->video, config->n_cameras);
        is_ok = source->opener != NULL;
        for (uint32_t i = 0; is_ok && i < config->n_cameras; i++) {
            source->config.n_cameras++;
            is_ok = camera_open(source, i);
        }
    }
    if (is_ok) {
        source->base.next = source_next;
        source->base.wait = source_wait;
        source->base.close = source_close;
        source->base.describe = source_describe;
        return &source->base;
    }
    snprintf(error, error_bytes, "out of memory");
    if (source) source_close(&source->base);
    return NULL;
}
