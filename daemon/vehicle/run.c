/* SPDX-License-Identifier: BSD-3-Clause
 * The loop that owns the vehicle: frames and requests in, packets out at the link's pace. */
#include "run.h"

#include <errno.h>
#include <inttypes.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/signalfd.h>
#include <time.h>
#include <unistd.h>

#include "debug_dump.h"
#include "run_internal.h"
#include "service.h"
#include "status_file.h"

#define STATUS_PERIOD_NS 1000000000LL

/* The link's pace holds on average. What could not be sent while a frame was looked at may be sent at once after it: so
 * much time's worth, and so many datagrams, at most. */
#define MAX_BURST_NS 250000000LL
#define MAX_BURST 16

#define NS_PER_US 1000

static int64_t cpu_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (int64_t)t.tv_sec * 1000000 + t.tv_nsec / NS_PER_US;
}

static int64_t utc_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    return (int64_t)t.tv_sec * 1000000 + t.tv_nsec / NS_PER_US;
}

/* ---- requests ---- */

static void run_take_image_resend(vehicle_run_t *run, size_t n_bytes)
{
    oc_resend_request_t request;
    if (oc_packet_decode_resend(run->packet, n_bytes, &request) != OC_OK) {
        oc_vehicle_count(run->vehicle, OC_COUNT_REQUESTS_BAD);
    } else if (!oc_image_sender_resend(run->images, &request)) {
        oc_vehicle_count(run->vehicle, OC_COUNT_REQUESTS_GONE);
    }
}

static void run_recall(vehicle_run_t *run, int64_t from_us, int64_t to_us)
{
    uint32_t n = 0;
    if (oc_vehicle_recall(run->vehicle, from_us, to_us, &n) == OC_OK)
        printf("outcropd: %" PRIu32 " views set free of a stretch of %.1f s\n", n, (double)(to_us - from_us) * 1e-6);
    fflush(stdout);
}

/* "The last N seconds" end now; for a site folder, whose times are its own, with its newest frame. */
static void run_take_recall(vehicle_run_t *run, size_t n_bytes)
{
    oc_recall_request_t request;
    if (oc_packet_decode_recall(run->packet, n_bytes, &request) != OC_OK) {
        oc_vehicle_count(run->vehicle, OC_COUNT_REQUESTS_BAD);
        return;
    }
    if (request.is_relative) {
        request.to_us = run->config->source == OC_SOURCE_CAMERAS ? utc_us() : run->newest_utime_us;
        request.from_us = request.to_us - (int64_t)request.last_ms * 1000;
    }
    run_recall(run, request.from_us, request.to_us);
}

static void run_take_packets(vehicle_run_t *run)
{
    size_t n_bytes;
    while ((n_bytes = oc_receiver_take(run->receiver, run->packet)) > 0) {
        oc_packet_head_t head;
        if (oc_packet_decode_head(run->packet, n_bytes, &head) != OC_OK) continue; /* the receiver has looked */
        if (head.type == OC_PACKET_OVERHEAD_REQUEST || head.type == OC_PACKET_TEXTURE_REQUEST) {
            oc_picture_tiles_request(&run->tiles, run->packet, n_bytes);
        } else if (head.type == OC_PACKET_RECALL_REQUEST) {
            run_take_recall(run, n_bytes);
        } else if (run->images) {
            run_take_image_resend(run, n_bytes);
        } else {
            /* Failures are counted inside and published; the base asks again. */
            const oc_status_t status = oc_vehicle_handle(run->vehicle, run->packet, n_bytes);
            (void)status;
        }
    }
}

/* ---- frames ---- */

/* A rival is sent the picture as it came, where a codec can take it. */
static void run_push_image(vehicle_run_t *run, const oc_captured_t *captured)
{
    oc_view_head_t head = {.view = captured->has_view_id ? captured->view_id : run->n_images,
                           .camera_index = captured->camera_index,
                           .utime_us = captured->utime_us,
                           .camera = captured->camera,
                           .margin = captured->margin,
                           .has_distortion = captured->has_distortion,
                           .distortion = captured->distortion};
    oc_image_t image = oc_image_from_raw(&captured->raw);
    if (!image.px || (!captured->has_distortion && !oc_lens_is_identity(&captured->lens))) {
        image = oc_rectify_apply(run->rectify[captured->camera_index], &captured->raw, &captured->lens);
        head.has_distortion = false;
    }
    if (!oc_image_sender_push(run->images, &head, &image)) {
        /* A rival that leaves views out is no rival: say so and end. */
        snprintf(run->fault, sizeof run->fault,
                 "view %u: cannot be sent whole: the codec failed, or it takes more than 256 datagrams", head.view);
        run->is_stopped = true;
        return;
    }
    run->n_images++;
    run->newest_image = head.view;
}

/* A mark sets free what was held of the time before it. */
static bool run_is_marked(vehicle_run_t *run, const oc_captured_t *captured)
{
    const uint32_t bit = 1u << captured->camera_index;
    const bool is_marked =
        (run->forced_cameras & bit) != 0 || (run->config->source == OC_SOURCE_CAMERAS && captured->is_forced);
    run->forced_cameras &= ~bit;
    if (is_marked && run->config->has_held_views)
        run_recall(run, captured->utime_us - (int64_t)run->config->pre_event_s * 1000000, captured->utime_us);
    return is_marked;
}

static void run_push_frame(vehicle_run_t *run, const oc_captured_t *captured)
{
    const bool is_marked = run_is_marked(run, captured);
    const oc_frame_t frame = {
        .image = oc_rectify_apply(run->rectify[captured->camera_index], &captured->raw, &captured->lens),
        .camera = captured->camera,
        .margin = captured->margin,
        .has_distortion = captured->has_distortion,
        .distortion = captured->distortion,
        .utime_us = captured->utime_us,
        .camera_index = captured->camera_index,
        .has_view_id = captured->has_view_id,
        .view_id = captured->view_id,
        .is_forced = captured->is_forced || is_marked};
    oc_push_report_t report;
    const int64_t begin_ns = oc_mono_ns();
    const oc_status_t status = oc_vehicle_push(run->vehicle, &frame, &report);
    const int64_t end_ns = oc_mono_ns();
    if (status != OC_OK) {
        oc_counters_add(&run->counters, OC_COUNT_FRAMES_REFUSED, 1);
        if (!run->is_frame_fault_told) fprintf(stderr, "outcropd: frame refused: %s\n", oc_status_text(status));
        run->is_frame_fault_told = true;
        return;
    }
    run->is_frame_fault_told = false;
    oc_latency_add(report.is_keyframe ? &run->view_latency : &run->frame_latency,
                   (end_ns - captured->arrived_ns) / NS_PER_US);
    if (!report.is_keyframe) return;
    printf("outcropd: view %u: %u junctions (%u ground, %u obstacle, %u unknown), %u sent, %u ties, %.1f ms\n",
           report.view, report.n_found, report.n_ground, report.n_obstacle, report.n_unknown, report.n_sent,
           report.n_ties, (double)(end_ns - begin_ns) * 1e-6);
    fflush(stdout);
}

/* True when there was a frame, so that there may be another. */
static bool run_take_frame(vehicle_run_t *run)
{
    oc_captured_t captured;
    char error[512];
    const oc_capture_result_t result = run->capture->next(run->capture, oc_mono_ns(), &captured, error, sizeof error);
    switch (result) {
    case OC_CAPTURE_NONE: return false;
    case OC_CAPTURE_ERROR: fprintf(stderr, "outcropd: %s\n", error); return true;
    case OC_CAPTURE_DONE:
        run->is_source_done = true;
        run->next_status_ns = oc_mono_ns(); /* say so at once */
        return false;
    case OC_CAPTURE_FRAME: break;
    }
    run->newest_utime_us = captured.utime_us;
    if (run->images) {
        run_push_image(run, &captured);
    } else {
        run_push_frame(run, &captured);
    }
    return true;
}

/* ---- packets out ---- */

static bool run_send(vehicle_run_t *run, size_t n_bytes)
{
    if (!oc_link_send(oc_receiver_link(run->receiver), run->packet, n_bytes)) {
        oc_vehicle_count(run->vehicle, OC_COUNT_SEND_FAILED);
        return false;
    }
    run->bytes_sent += n_bytes;
    const int64_t wire_bits = 8 * (int64_t)OC_LCM_WIRE_BYTES(n_bytes, OC_CHANNEL_DOWN);
    const int64_t earliest_ns = oc_mono_ns() - MAX_BURST_NS;
    if (run->next_send_ns < earliest_ns) run->next_send_ns = earliest_ns;
    run->next_send_ns += wire_bits * 1000000 / run->config->rate_kbit_s;
    return true;
}

static oc_packet_head_t run_packet_head(vehicle_run_t *run)
{
    return (oc_packet_head_t){.vehicle = run->config->vehicle.vehicle,
                              .sequence = oc_vehicle_next_sequence(run->vehicle)};
}

/* One datagram by priority; false when there is nothing to send. */
static bool run_send_next(vehicle_run_t *run)
{
    size_t n_bytes = 0;
    if (run->images) {
        if (!oc_image_sender_has_next(run->images)) return false; /* and spare the number of a packet */
        const oc_packet_head_t head = run_packet_head(run);
        if (!oc_image_sender_next(run->images, &head, run->packet, &n_bytes)) return false;
        return run_send(run, n_bytes);
    }
    if (oc_vehicle_next(run->vehicle, run->packet, run->config->vehicle.datagram_bytes, &n_bytes) != OC_OK)
        return false;
    if (n_bytes > 0) return run_send(run, n_bytes);
    oc_picture_tiles_feed(&run->tiles);
    if (!oc_picture_tiles_has_next(&run->tiles)) return false;
    const oc_packet_head_t head = run_packet_head(run);
    n_bytes = oc_picture_tiles_next(&run->tiles, &head, run->packet);
    return n_bytes > 0 && run_send(run, n_bytes);
}

/* ---- status ---- */

static void run_get_status(vehicle_run_t *run, oc_vehicle_status_t *status)
{
    oc_vehicle_get_status(run->vehicle, status);
    if (run->images) {
        status->n_views = run->n_images;
        status->newest_view = run->newest_image;
    }
    for (int i = 0; i < OC_N_COUNTERS; i++) {
        const uint32_t n = oc_counters_get(&run->counters, (oc_counter_t)i), *have = &status->counters[i];
        status->counters[i] = n > UINT32_MAX - *have ? UINT32_MAX : *have + n;
    }
    status->uptime_s = (uint32_t)((oc_mono_ns() - run->start_ns) / 1000000000LL);
    status->is_source_done = run->is_source_done;
    status->bytes_sent = (uint32_t)run->bytes_sent;
}

static void run_write_status(vehicle_run_t *run, const oc_vehicle_status_t *status)
{
    const char *path = run->config->status_file;
    if (!path[0]) return;
    const oc_status_report_t report = {.status = status,
                                       .vehicle = run->config->vehicle.vehicle,
                                       .utime_us = utc_us(),
                                       .bytes_sent = run->bytes_sent,
                                       .frame_cpu_us = cpu_us() - run->cpu_at_start_us,
                                       .frame = &run->frame_latency,
                                       .view = &run->view_latency,
                                       .capture = run->capture};
    const bool is_ok = oc_status_file_write(path, &report);
    if (!is_ok && !run->is_status_fault_told) fprintf(stderr, "outcropd: %s: %s\n", path, strerror(errno));
    run->is_status_fault_told = !is_ok;
}

static void run_tell_status(vehicle_run_t *run)
{
    oc_vehicle_status_t status;
    run_get_status(run, &status);
    const oc_packet_head_t head = run_packet_head(run);
    size_t n_bytes = 0;
    if (oc_packet_encode_status(&head, &status, run->packet, run->config->vehicle.datagram_bytes, &n_bytes) == OC_OK)
        run_send(run, n_bytes);
    run_write_status(run, &status);
    char line[96];
    snprintf(line, sizeof line, "%u views, %" PRIu32 " frames", status.n_views, status.counters[OC_COUNT_FRAMES_IN]);
    oc_service_status(line);
}

/* ---- the loop ---- */

static void run_take_signal(vehicle_run_t *run)
{
    struct signalfd_siginfo info;
    if (read(run->signal_fd, &info, sizeof info) != (ssize_t)sizeof info) return;
    if (info.ssi_signo == SIGUSR1) {
        oc_counters_add(&run->counters, OC_COUNT_MARKS, 1);
        run->forced_cameras = UINT32_MAX;
    } else if (info.ssi_signo != SIGHUP) {
        run->is_stopped = true;
    } else if (!run->is_hangup_told) {
        fprintf(stderr, "outcropd: SIGHUP ignored: restart to read the configuration anew\n");
        run->is_hangup_told = true;
    }
}

static int64_t earlier(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

/* Sleep until something comes or is due. */
static void run_wait(vehicle_run_t *run, bool is_busy, bool has_more)
{
    struct pollfd fds[3 + OC_MAX_CAPTURE_FDS] = {{run->signal_fd, POLLIN, 0},
                                                 {oc_receiver_fd(run->receiver), POLLIN, 0},
                                                 {oc_tile_worker_fd(run->tile_worker), POLLIN, 0}};
    nfds_t n_fds = 3;
    int64_t until_ns = run->next_status_ns;
    if (run->watchdog_ns > 0) until_ns = earlier(until_ns, run->next_alive_ns);
    if (has_more) until_ns = earlier(until_ns, run->next_send_ns);
    if (!run->is_source_done) {
        int64_t wake_ns = INT64_MAX;
        n_fds += run->capture->wait(run->capture, fds + n_fds, &wake_ns);
        until_ns = earlier(until_ns, wake_ns);
    }
    int64_t wait_ns = is_busy ? 0 : until_ns - oc_mono_ns();
    if (wait_ns < 0) wait_ns = 0;
    const struct timespec timeout = {wait_ns / 1000000000LL, wait_ns % 1000000000LL};
    const int n = ppoll(fds, n_fds, &timeout, NULL);
    if (n < 0 && errno != EINTR) {
        snprintf(run->fault, sizeof run->fault, "poll: %s", strerror(errno));
        run->is_stopped = true;
    }
    if (n > 0 && fds[0].revents) run_take_signal(run);
    const char *fault = oc_receiver_fault(run->receiver);
    if (fault) {
        snprintf(run->fault, sizeof run->fault, "%s", fault);
        run->is_stopped = true;
    }
}

static void run_loop(vehicle_run_t *run)
{
    run->start_ns = run->next_status_ns = run->next_send_ns = run->next_alive_ns = oc_mono_ns();
    run->cpu_at_start_us = cpu_us();
    run->watchdog_ns = oc_service_watchdog_ns();
    oc_service_ready("running");
    while (!run->is_stopped) {
        const int64_t now = oc_mono_ns();
        if (run->watchdog_ns > 0 && now >= run->next_alive_ns) {
            oc_service_alive();
            run->next_alive_ns = now + run->watchdog_ns;
        }
        if (now >= run->next_status_ns) {
            run_tell_status(run);
            run->next_status_ns = now + STATUS_PERIOD_NS;
        }
        run_take_packets(run);
        const bool is_busy = !run->is_source_done && run_take_frame(run);
        bool has_more = true;
        for (int i = 0; has_more && i < MAX_BURST && oc_mono_ns() >= run->next_send_ns; i++)
            has_more = run_send_next(run);
        run_wait(run, is_busy, has_more);
    }
    oc_service_stopping();
}

bool oc_run(const oc_config_t *config, char *error, size_t error_bytes)
{
    vehicle_run_t *run = oc_run_open(config, false, error, error_bytes);
    if (!run) return false;
    run_loop(run);
    bool is_ok = run->fault[0] == '\0';
    if (!is_ok) snprintf(error, error_bytes, "%s", run->fault);
    if (is_ok && config->debug_dump[0] && !run->images)
        is_ok = oc_debug_dump(run->vehicle, config->debug_dump, error, error_bytes);
    oc_run_close(run);
    return is_ok;
}

bool oc_run_check(const oc_config_t *config, char *error, size_t error_bytes)
{
    vehicle_run_t *run = oc_run_open(config, true, error, error_bytes);
    oc_run_close(run);
    return run != NULL;
}
