/* SPDX-License-Identifier: BSD-3-Clause
 * The life of one camera. */
#include "live_camera.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define NS_PER_MS 1000000LL
#define NS_PER_S 1000000000LL

/* Driver times this far ahead of now, or this far behind, are of another clock. */
#define MAX_AHEAD_NS (50 * NS_PER_MS)
#define MAX_BEHIND_NS (10 * NS_PER_S)

/* A larger jump of the driver's numbers is a restart, not that many lost frames. */
#define MAX_SEQUENCE_GAP 10000u

static void count(const oc_live_camera_t *camera, oc_counter_t counter, uint32_t n)
{
    oc_counters_add(camera->parts->counters, counter, n);
}

static void set_message(oc_live_camera_t *camera, int64_t now_ns, const char *what)
{
    char untold[48] = "";
    if (camera->n_untold > 0)
        snprintf(untold, sizeof untold, " (%" PRIu32 " changes before this untold)", camera->n_untold);
    snprintf(camera->message, sizeof camera->message, "%s%s", what, untold);
    camera->told_ns = now_ns;
    camera->n_untold = 0;
    camera->later[0] = '\0';
}

/* A change of state, for people: at most one a second, so that a camera that comes and goes does not fill a disk. Of
 * those that come too soon the last is told when its time has come: what was told last is how it stands. */
__attribute__((format(printf, 3, 4))) static void tell(oc_live_camera_t *camera, int64_t now_ns, const char *format,
                                                       ...)
{
    char what[OC_CAMERA_ERROR_BYTES];
    va_list args;
    va_start(args, format);
    vsnprintf(what, sizeof what, format, args);
    va_end(args);
    if (!camera->message[0] && (camera->told_ns == 0 || now_ns - camera->told_ns >= NS_PER_S)) {
        set_message(camera, now_ns, what);
        return;
    }
    if (camera->later[0]) camera->n_untold++;
    snprintf(camera->later, sizeof camera->later, "%s", what);
}

static void tell_what_waits(oc_live_camera_t *camera, int64_t now_ns)
{
    char what[OC_CAMERA_ERROR_BYTES];
    if (!camera->later[0] || camera->message[0] || now_ns - camera->told_ns < NS_PER_S) return;
    snprintf(what, sizeof what, "%s", camera->later);
    set_message(camera, now_ns, what);
}

/* ---- opening and closing ---- */

static void order_open(oc_live_camera_t *camera)
{
    camera->state = OC_CAMERA_OPENING;
    oc_camera_opener_order(camera->opener, camera->index, NULL, &camera->config->wish);
}

/* One more than there is room for is one with the last. */
static void add_mark(oc_live_camera_t *camera, int64_t mark_ns)
{
    if (camera->n_marks < OC_MAX_PENDING_MARKS) camera->marks_ns[camera->n_marks++] = mark_ns;
}

/* Whatever was wrong: away with it, and try again later. */
static void order_close(oc_live_camera_t *camera)
{
    /* Frames that wait go with their camera; what they were to be, the next one is. */
    for (uint32_t i = 0; i < camera->n_waiting; i++) {
        if (camera->waiting[i].is_forced) add_mark(camera, camera->waiting[i].exposed_ns);
    }
    camera->n_waiting = 0;
    camera->has_handed_out = false;
    camera->state = OC_CAMERA_CLOSING;
    oc_camera_opener_order(camera->opener, camera->index, camera->video, NULL);
    camera->video = NULL;
}

static void lose(oc_live_camera_t *camera, int64_t now_ns, oc_counter_t counter, const char *why)
{
    count(camera, counter, 1);
    if (counter == OC_COUNT_CAMERA_STALLS) camera->counts.stalls++;
    snprintf(camera->error, sizeof camera->error, "%s", why);
    tell(camera, now_ns, "%s; closed, and opened again when it is there", why);
    order_close(camera);
}

static void start_streaming(oc_live_camera_t *camera, int64_t now_ns, const oc_opened_t *opened)
{
    camera->video = opened->video;
    camera->mode = opened->mode;
    camera->state = OC_CAMERA_STREAMING;
    camera->last_frame_ns = now_ns;
    camera->has_sequence = false;
    camera->is_fault_counted = false;
    camera->error[0] = '\0';
    camera->counts.opened++;
    count(camera, OC_COUNT_CAMERA_OPENED, 1);
    count(camera, OC_COUNT_CONTROLS_REFUSED, opened->mode.n_controls_refused);
    char refused[48] = "";
    if (opened->mode.n_controls_refused > 0)
        snprintf(refused, sizeof refused, ", %" PRIu32 " controls refused", opened->mode.n_controls_refused);
    const oc_video_wish_t *wish = &camera->config->wish;
    tell(camera, now_ns, "%s on %s: %s %ux%u, %.4g Hz, %u buffers%s", opened->mode.card, opened->mode.bus,
         oc_pixel_format_name(wish->format), wish->width_px, wish->height_px, opened->mode.rate_hz,
         opened->mode.n_buffers, refused);
}

static void collect(oc_live_camera_t *camera, int64_t now_ns)
{
    oc_opened_t opened;
    if (!oc_camera_opener_collect(camera->opener, camera->index, &opened)) return;
    if (opened.video) {
        start_streaming(camera, now_ns, &opened);
        return;
    }
    const bool was_opening = camera->state == OC_CAMERA_OPENING;
    camera->state = OC_CAMERA_CLOSED;
    camera->next_try_ns = now_ns + camera->config->retry_ms * NS_PER_MS;
    if (!was_opening) return;
    const bool is_news = strcmp(camera->error, opened.error) != 0;
    snprintf(camera->error, sizeof camera->error, "%s", opened.error);
    if (!camera->is_fault_counted) count(camera, OC_COUNT_CAMERA_FAULTS, 1);
    if (!camera->is_fault_counted || is_news) tell(camera, now_ns, "%s", opened.error);
    camera->is_fault_counted = true;
}

/* ---- frames ---- */

/* False when the camera had to be given up. */
static bool give_back(oc_live_camera_t *camera, uint32_t buffer, int64_t now_ns)
{
    char error[OC_CAMERA_ERROR_BYTES];
    if (camera->parts->video->give_back(camera->video, buffer, error, sizeof error)) return true;
    lose(camera, now_ns, OC_COUNT_CAMERA_LOST, error);
    return false;
}

static void drop_first(oc_live_camera_t *camera)
{
    camera->n_waiting--;
    memmove(&camera->waiting[0], &camera->waiting[1], camera->n_waiting * sizeof camera->waiting[0]);
}

void oc_live_camera_drop_oldest(oc_live_camera_t *camera, oc_counter_t reason, int64_t now_ns)
{
    const oc_waiting_frame_t first = camera->waiting[0];
    count(camera, reason, 1);
    drop_first(camera);
    if (first.is_forced) oc_live_camera_mark(camera, first.exposed_ns);
    (void)give_back(camera, first.frame.index, now_ns);
}

void oc_live_camera_mark(oc_live_camera_t *camera, int64_t mark_ns)
{
    for (uint32_t i = 0; i < camera->n_waiting; i++) {
        if (camera->waiting[i].exposed_ns < mark_ns) continue;
        camera->waiting[i].is_forced = true;
        return;
    }
    add_mark(camera, mark_ns);
}

/* Whether a mark was waiting for a frame of this time; one frame may answer several. */
static bool take_marks(oc_live_camera_t *camera, int64_t exposed_ns)
{
    uint32_t n = 0;
    const uint32_t n_before = camera->n_marks;
    for (uint32_t i = 0; i < n_before; i++) {
        if (camera->marks_ns[i] > exposed_ns) camera->marks_ns[n++] = camera->marks_ns[i];
    }
    camera->n_marks = n;
    return n < n_before;
}

static void count_gap(oc_live_camera_t *camera, uint32_t sequence)
{
    const uint32_t gap = sequence - camera->last_sequence - 1u;
    if (camera->has_sequence && gap < MAX_SEQUENCE_GAP) {
        count(camera, OC_COUNT_FRAMES_LOST, gap);
        camera->counts.lost += gap;
    }
    camera->has_sequence = true;
    camera->last_sequence = sequence;
}

static bool is_whole(const oc_live_camera_t *camera, const oc_video_frame_t *frame)
{
    const oc_video_wish_t *wish = &camera->config->wish;
    if (wish->format == OC_PIXEL_MJPG) return frame->n_bytes >= 4; /* the decoder sees the rest */
    return frame->n_bytes >= oc_pixel_format_bytes(wish->format, camera->mode.stride_bytes, wish->height_px);
}

/* Why a frame is of no use, OC_N_COUNTERS when it is. */
static oc_counter_t fault_of(oc_live_camera_t *camera, const oc_video_frame_t *frame, int64_t exposed_ns,
                             int64_t now_ns)
{
    if (frame->is_flagged) {
        camera->counts.flagged++;
        return OC_COUNT_FRAMES_FLAGGED;
    }
    if (!is_whole(camera, frame)) {
        camera->counts.corrupt++;
        return OC_COUNT_FRAMES_CORRUPT;
    }
    if (exposed_ns <= camera->last_exposed_ns || exposed_ns > now_ns + MAX_AHEAD_NS ||
        exposed_ns < now_ns - MAX_BEHIND_NS)
        return OC_COUNT_FRAMES_BAD_TIME;
    if (camera->parts->gpio && !oc_gpio_is_enabled(camera->parts->gpio)) return OC_COUNT_FRAMES_DISABLED;
    return OC_N_COUNTERS;
}

/* The driver dates what arrives; the pulse says when it was exposed. */
static int64_t exposed_at(const oc_live_camera_t *camera, const oc_video_frame_t *frame)
{
    int64_t pulse_ns;
    if (camera->config->is_hardware_triggered && camera->parts->gpio &&
        oc_gpio_pulse_of(camera->parts->gpio, frame->mono_ns, &pulse_ns))
        return pulse_ns;
    return frame->mono_ns;
}

static void add_waiting(oc_live_camera_t *camera, const oc_waiting_frame_t *fresh)
{
    const uint32_t limit = camera->mode.n_buffers - 3u < OC_MAX_WAITING ? camera->mode.n_buffers - 3u : OC_MAX_WAITING;
    if (camera->n_waiting == limit) oc_live_camera_drop_oldest(camera, OC_COUNT_FRAMES_OVERRUN, fresh->arrived_ns);
    if (camera->state != OC_CAMERA_STREAMING) return;
    oc_waiting_frame_t *slot = &camera->waiting[camera->n_waiting++];
    *slot = *fresh;
    slot->is_forced = take_marks(camera, slot->exposed_ns);
}

static void take_in(oc_live_camera_t *camera, const oc_video_frame_t *frame, int64_t now_ns,
                    const oc_clock_map_t *clock)
{
    camera->last_frame_ns = now_ns;
    camera->counts.frames++;
    count_gap(camera, frame->sequence);
    const int64_t exposed_ns = exposed_at(camera, frame);
    const oc_counter_t fault = fault_of(camera, frame, exposed_ns, now_ns);
    if (fault != OC_N_COUNTERS) {
        count(camera, fault, 1);
        (void)give_back(camera, frame->index, now_ns);
        return;
    }
    camera->last_exposed_ns = exposed_ns;
    if (camera->parts->gpio) oc_gpio_frame(camera->parts->gpio);
    const oc_waiting_frame_t fresh = {.frame = *frame,
                                      .exposed_ns = exposed_ns,
                                      .utime_us = oc_clock_map_utime_us(clock, exposed_ns) - camera->config->delay_us,
                                      .arrived_ns = now_ns};
    add_waiting(camera, &fresh);
}

static void take_frames(oc_live_camera_t *camera, int64_t now_ns, const oc_clock_map_t *clock)
{
    /* A driver that never runs dry must not keep the loop: as many as there are buffers. */
    for (uint32_t i = 0; i < camera->mode.n_buffers && camera->state == OC_CAMERA_STREAMING; i++) {
        oc_video_frame_t frame;
        char error[OC_CAMERA_ERROR_BYTES];
        const oc_video_result_t result = camera->parts->video->take(camera->video, &frame, error, sizeof error);
        if (result == OC_VIDEO_NONE) return;
        if (result == OC_VIDEO_FRAME) {
            take_in(camera, &frame, now_ns, clock);
        } else {
            lose(camera, now_ns, OC_COUNT_CAMERA_LOST, result == OC_VIDEO_GONE ? "unplugged" : error);
        }
    }
}

void oc_live_camera_serve(oc_live_camera_t *camera, int64_t now_ns, const oc_clock_map_t *clock)
{
    tell_what_waits(camera, now_ns);
    if (camera->state == OC_CAMERA_OPENING || camera->state == OC_CAMERA_CLOSING) collect(camera, now_ns);
    if (camera->state == OC_CAMERA_CLOSED && now_ns >= camera->next_try_ns) order_open(camera);
    if (camera->state != OC_CAMERA_STREAMING) return;
    if (camera->has_handed_out) {
        camera->has_handed_out = false;
        if (!give_back(camera, camera->handed_out, now_ns)) return;
    }
    take_frames(camera, now_ns, clock);
    if (camera->state == OC_CAMERA_STREAMING &&
        now_ns - camera->last_frame_ns >= camera->config->stall_ms * NS_PER_MS) {
        char why[64];
        snprintf(why, sizeof why, "no frame for %" PRIu32 " ms", camera->config->stall_ms);
        lose(camera, now_ns, OC_COUNT_CAMERA_STALLS, why);
    }
}

bool oc_live_camera_hand_out(oc_live_camera_t *camera, int64_t now_ns, oc_raw_image_t *raw)
{
    const oc_video_wish_t *wish = &camera->config->wish;
    const oc_video_frame_t *frame = &camera->waiting[0].frame;
    if (camera->mjpeg) {
        oc_image_t image;
        char error[160];
        if (!oc_mjpeg_decode(camera->mjpeg, frame->bytes, frame->n_bytes, &image, error, sizeof error)) {
            camera->counts.corrupt++;
            oc_live_camera_drop_oldest(camera, OC_COUNT_FRAMES_CORRUPT, now_ns);
            return false;
        }
        *raw = oc_raw_from_image(&image);
    } else {
        const uint32_t stride_bytes = camera->mode.stride_bytes;
        *raw = (oc_raw_image_t){
            .format = wish->format,
            .width_px = wish->width_px,
            .height_px = wish->height_px,
            .stride_bytes = stride_bytes,
            .px = frame->bytes,
            .chroma = wish->format == OC_PIXEL_NV12 ? frame->bytes + (size_t)stride_bytes * wish->height_px : NULL};
    }
    camera->handed_out = frame->index;
    camera->has_handed_out = true;
    drop_first(camera);
    return true;
}

int64_t oc_live_camera_wake_ns(const oc_live_camera_t *camera)
{
    int64_t at_ns = camera->later[0] ? camera->told_ns + NS_PER_S : INT64_MAX;
    if (camera->state == OC_CAMERA_CLOSED && camera->next_try_ns < at_ns) at_ns = camera->next_try_ns;
    const int64_t stalled_ns = camera->last_frame_ns + camera->config->stall_ms * NS_PER_MS;
    if (camera->state == OC_CAMERA_STREAMING && stalled_ns < at_ns) at_ns = stalled_ns;
    return at_ns;
}

/* ---- telling ---- */

/* Text as a JSON string's inside: what needs an escape becomes a question mark, but for quotes and backslashes. */
static void json_text(const char *from, char *to, size_t to_bytes)
{
    size_t n = 0;
    for (; *from && n + 3 < to_bytes; from++) {
        const unsigned char c = (unsigned char)*from;
        if (c == '"' || c == '\\') to[n++] = '\\';
        to[n++] = c < 32 || c > 126 ? '?' : (char)c;
    }
    to[n] = '\0';
}

size_t oc_live_camera_describe(const oc_live_camera_t *camera, int64_t now_ns, char *text, size_t text_bytes)
{
    static const char *const states[] = {"waiting for the device", "opening", "streaming", "closing"};
    char device[2 * OC_VIDEO_PATH_BYTES], card[64], bus[64], error[2 * OC_CAMERA_ERROR_BYTES];
    json_text(camera->config->wish.path, device, sizeof device);
    json_text(camera->mode.card, card, sizeof card);
    json_text(camera->mode.bus, bus, sizeof bus);
    json_text(camera->error, error, sizeof error);
    const oc_camera_counts_t *n = &camera->counts;
    const int64_t age_ms = camera->state == OC_CAMERA_STREAMING ? (now_ns - camera->last_frame_ns) / NS_PER_MS : -1;
    const int written =
        snprintf(text, text_bytes,
                 "{\"name\":\"%s\",\"device\":\"%s\",\"state\":\"%s\",\"card\":\"%s\",\"bus\":\"%s\",\"format\":\"%s\","
                 "\"width\":%u,\"height\":%u,\"rate_mhz\":%ld,\"frames\":%" PRIu64 ",\"lost\":%" PRIu64
                 ",\"flagged\":%" PRIu64 ",\"corrupt\":%" PRIu64 ",\"stalls\":%" PRIu64 ",\"opened\":%" PRIu64
                 ",\"frame_age_ms\":%" PRId64 ",\"error\":\"%s\"}",
                 camera->config->name, device, states[camera->state], card, bus,
                 oc_pixel_format_name(camera->config->wish.format), camera->config->wish.width_px,
                 camera->config->wish.height_px, (long)(camera->mode.rate_hz * 1000), n->frames, n->lost, n->flagged,
                 n->corrupt, n->stalls, n->opened, age_ms, error);
    return written > 0 && (size_t)written < text_bytes ? (size_t)written : 0;
}
