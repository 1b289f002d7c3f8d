/* SPDX-License-Identifier: BSD-3-Clause
 * One thread, one poll loop. Order of work: what arrived, a due frame, the
 * status of the second, then one datagram at a time as the pace allows. */
#include "run.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/signalfd.h>
#include <time.h>
#include <unistd.h>

#include "debug_dump.h"
#include "image_sender.h"
#include "link_lcm.h"
#include "pixel_codec.h"
#include "rectify.h"

/* Overhead requests waiting for the tile encoder. */
#define MAX_OVERHEAD_REQUESTS 16u

#define STATUS_PERIOD_NS 1000000000LL

/* Room of a datagram that an overhead packet's own fields take. */
#define OVERHEAD_HEAD_BYTES 32u

typedef struct vehicle_run {
    const oc_config_t *config;
    oc_capture_t *capture;
    oc_link_t *link;
    oc_vehicle_t *vehicle;
    oc_rectify_t *rectify;
    oc_image_sender_t *images; /* only in image mode */
    void *block;
    int signal_fd;
    char fault[160]; /* why the loop ended, "" = a signal */

    int64_t start_ns, next_frame_ns, next_status_ns, next_send_ns;
    bool is_source_done, is_stopped, is_hangup_told;
    uint64_t bytes_sent;
    uint16_t n_images, newest_image;

    oc_overhead_request_t overhead[MAX_OVERHEAD_REQUESTS];
    uint32_t n_overhead, next_tile; /* tiles are taken from overhead[0] */
    uint8_t tile_px[256 * 256 * 3];
    uint8_t tile_bytes[OC_MAX_DATAGRAM_BYTES];
    uint8_t packet[OC_MAX_DATAGRAM_BYTES];
} vehicle_run_t;

static int64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000LL + t.tv_nsec;
}

static void run_take_overhead(vehicle_run_t *run, const uint8_t *packet, size_t n_bytes)
{
    if (run->n_overhead == MAX_OVERHEAD_REQUESTS) {
        oc_vehicle_count(run->vehicle, OC_COUNT_REQUESTS_FULL);
        return;
    }
    if (oc_packet_decode_overhead_request(packet, n_bytes, &run->overhead[run->n_overhead]) != OC_OK) {
        oc_vehicle_count(run->vehicle, OC_COUNT_REQUESTS_BAD);
        return;
    }
    run->n_overhead++;
}

static void run_take_image_resend(vehicle_run_t *run, const uint8_t *packet, size_t n_bytes)
{
    oc_resend_request_t request;
    if (oc_packet_decode_resend(packet, n_bytes, &request) != OC_OK) {
        oc_vehicle_count(run->vehicle, OC_COUNT_REQUESTS_BAD);
    } else if (!oc_image_sender_resend(run->images, &request)) {
        oc_vehicle_count(run->vehicle, OC_COUNT_REQUESTS_GONE);
    }
}

static void run_on_packet(void *user, const uint8_t *packet, size_t n_bytes)
{
    vehicle_run_t *run = user;
    oc_packet_head_t head;
    if (oc_packet_decode_head(packet, n_bytes, &head) != OC_OK) {
        oc_vehicle_count(run->vehicle, OC_COUNT_REQUESTS_BAD);
        return;
    }
    if (head.vehicle != run->config->vehicle.vehicle) return;
    if (head.type == OC_PACKET_OVERHEAD_REQUEST) {
        run_take_overhead(run, packet, n_bytes);
    } else if (run->images) {
        run_take_image_resend(run, packet, n_bytes);
    } else {
        /* Failures are counted inside and published; the base asks again. */
        const oc_status_t status = oc_vehicle_handle(run->vehicle, packet, n_bytes);
        (void)status;
    }
}

static void run_push_image(vehicle_run_t *run, const oc_captured_t *captured)
{
    const oc_view_head_t head = {.view = captured->has_view_id ? captured->view_id : run->n_images,
                                 .camera_index = captured->camera_index,
                                 .utime_us = captured->utime_us,
                                 .camera = captured->camera,
                                 .margin = captured->margin,
                                 .has_distortion = captured->has_distortion,
                                 .distortion = captured->distortion};
    const oc_image_t image = oc_image_from_raw(&captured->raw);
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

static void run_push_frame(vehicle_run_t *run, const oc_captured_t *captured)
{
    oc_frame_t frame = {.image = oc_rectify_apply(run->rectify, &captured->raw, &captured->lens),
                        .camera = captured->camera,
                        .margin = captured->margin,
                        .has_distortion = captured->has_distortion,
                        .distortion = captured->distortion,
                        .utime_us = captured->utime_us,
                        .camera_index = captured->camera_index,
                        .has_view_id = captured->has_view_id,
                        .view_id = captured->view_id,
                        .is_forced = captured->is_forced};
    oc_push_report_t report;
    const int64_t begin_ns = now_ns();
    const oc_status_t status = oc_vehicle_push(run->vehicle, &frame, &report);
    if (status != OC_OK) {
        fprintf(stderr, "outcropd: frame refused: %s\n", oc_status_text(status));
        return;
    }
    if (!report.is_keyframe) return;
    printf("outcropd: view %u: %u junctions (%u ground, %u obstacle, %u unknown), %u sent, %u ties, %.1f ms\n",
           report.view, report.n_found, report.n_ground, report.n_obstacle, report.n_unknown, report.n_sent,
           report.n_ties, (double)(now_ns() - begin_ns) * 1e-6);
    fflush(stdout);
}

static void run_take_frame(vehicle_run_t *run)
{
    oc_captured_t captured;
    char error[512];
    const oc_capture_result_t result = run->capture->next(run->capture, now_ns(), &captured, error, sizeof error);
    if (result == OC_CAPTURE_NONE) return;
    if (result == OC_CAPTURE_ERROR) {
        fprintf(stderr, "outcropd: %s\n", error);
        return;
    }
    if (result == OC_CAPTURE_DONE) {
        run->is_source_done = true;
        run->next_status_ns = now_ns(); /* say so at once */
        return;
    }
    if (run->images) {
        run_push_image(run, &captured);
    } else {
        run_push_frame(run, &captured);
    }
}

static bool run_send(vehicle_run_t *run, size_t n_bytes)
{
    if (!oc_link_send(run->link, run->packet, n_bytes)) {
        oc_vehicle_count(run->vehicle, OC_COUNT_SEND_FAILED);
        return false;
    }
    run->bytes_sent += n_bytes;
    const int64_t wire_bits = 8 * (int64_t)OC_LCM_WIRE_BYTES(n_bytes, OC_CHANNEL_DOWN);
    run->next_send_ns = now_ns() + wire_bits * 1000000 / run->config->rate_kbit_s;
    return true;
}

static oc_packet_head_t run_packet_head(vehicle_run_t *run)
{
    return (oc_packet_head_t){.vehicle = run->config->vehicle.vehicle,
                              .sequence = oc_vehicle_next_sequence(run->vehicle)};
}

static void run_send_status(vehicle_run_t *run)
{
    oc_vehicle_status_t status;
    oc_vehicle_get_status(run->vehicle, &status);
    if (run->images) {
        status.n_views = run->n_images;
        status.newest_view = run->newest_image;
    }
    status.uptime_s = (uint32_t)((now_ns() - run->start_ns) / 1000000000LL);
    status.is_source_done = run->is_source_done;
    status.bytes_sent = (uint32_t)run->bytes_sent;
    const oc_packet_head_t head = run_packet_head(run);
    size_t n_bytes = 0;
    if (oc_packet_encode_status(&head, &status, run->packet, run->config->vehicle.datagram_bytes, &n_bytes) == OC_OK)
        run_send(run, n_bytes);
}

/* Encode the next waiting ground tile. Returns 0 when none could be made. */
static size_t run_next_tile(vehicle_run_t *run)
{
    while (run->n_overhead > 0) {
        const oc_overhead_request_t *request = &run->overhead[0];
        if (run->next_tile == request->n_tiles) {
            run->n_overhead--;
            memmove(&run->overhead[0], &run->overhead[1], run->n_overhead * sizeof run->overhead[0]);
            run->next_tile = 0;
            continue;
        }
        const oc_tile_id_t tile = request->tiles[run->next_tile++];
        oc_image_mut_t out = {run->tile_px, request->tile_px, request->tile_px, 3u * request->tile_px, 3};
        uint32_t n_seen = 0;
        if (oc_vehicle_tile(run->vehicle, request, tile, &out, &n_seen) != OC_OK) {
            oc_vehicle_count(run->vehicle, OC_COUNT_REQUESTS_GONE);
            continue;
        }
        const oc_image_t image = {out.px, out.width_px, out.height_px, out.stride_bytes, out.channels};
        size_t tile_bytes = 0;
        if (!oc_pixel_encode_within(&image, request->quality, run->tile_bytes,
                                    run->config->vehicle.datagram_bytes - OVERHEAD_HEAD_BYTES, &tile_bytes)) {
            oc_vehicle_count(run->vehicle, OC_COUNT_REQUESTS_BAD);
            continue;
        }
        const oc_overhead_t overhead = {.view = request->view,
                                        .metres_per_pixel = request->metres_per_pixel,
                                        .tile_px = request->tile_px,
                                        .tile = tile,
                                        .codec = OC_CODEC_WEBP,
                                        .n_bytes = (uint16_t)tile_bytes,
                                        .bytes = run->tile_bytes};
        const oc_packet_head_t head = run_packet_head(run);
        size_t n_bytes = 0;
        if (oc_packet_encode_overhead(&head, &overhead, run->packet, run->config->vehicle.datagram_bytes, &n_bytes) ==
            OC_OK)
            return n_bytes;
        oc_vehicle_count(run->vehicle, OC_COUNT_REQUESTS_BAD);
    }
    return 0;
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
    if (n_bytes == 0) n_bytes = run_next_tile(run);
    return n_bytes > 0 && run_send(run, n_bytes);
}

static void run_take_signal(vehicle_run_t *run)
{
    struct signalfd_siginfo info;
    if (read(run->signal_fd, &info, sizeof info) != (ssize_t)sizeof info) return;
    if (info.ssi_signo != SIGHUP) {
        run->is_stopped = true;
    } else if (!run->is_hangup_told) {
        fprintf(stderr, "outcropd: SIGHUP ignored: restart to read the configuration anew\n");
        run->is_hangup_told = true;
    }
}

static void run_wait(vehicle_run_t *run, bool has_more)
{
    int64_t until_ns = run->next_status_ns;
    if (!run->is_source_done && run->next_frame_ns < until_ns) until_ns = run->next_frame_ns;
    if (has_more && run->next_send_ns < until_ns) until_ns = run->next_send_ns;
    int64_t wait_ns = until_ns - now_ns();
    if (wait_ns < 0) wait_ns = 0;
    struct pollfd fds[2] = {{oc_link_fd(run->link), POLLIN, 0}, {run->signal_fd, POLLIN, 0}};
    const struct timespec timeout = {wait_ns / 1000000000LL, wait_ns % 1000000000LL};
    const int n = ppoll(fds, 2, &timeout, NULL);
    if (n < 0 && errno != EINTR) {
        snprintf(run->fault, sizeof run->fault, "poll: %s", strerror(errno));
        run->is_stopped = true;
    }
    if (n <= 0) return;
    if (fds[1].revents & POLLIN) run_take_signal(run);
    if (fds[0].revents && oc_link_handle(run->link, 0) < 0) {
        snprintf(run->fault, sizeof run->fault, "the link failed");
        run->is_stopped = true;
    }
}

static void run_loop(vehicle_run_t *run)
{
    run->start_ns = now_ns();
    run->next_status_ns = run->next_frame_ns = run->next_send_ns = run->start_ns;
    while (!run->is_stopped) {
        int64_t now = now_ns();
        if (now >= run->next_status_ns) {
            run_send_status(run);
            run->next_status_ns = now + STATUS_PERIOD_NS;
        }
        if (!run->is_source_done && now >= run->next_frame_ns) {
            run_take_frame(run);
            if (!run->is_source_done) run->capture->wait(run->capture, NULL, &run->next_frame_ns);
            now = now_ns();
        }
        bool has_more = now < run->next_send_ns;
        if (!has_more) has_more = run_send_next(run);
        run_wait(run, has_more);
    }
}

static bool run_open(vehicle_run_t *run, char *error, size_t error_bytes)
{
    oc_vehicle_config_t vehicle = run->config->vehicle;
    vehicle.max_width_px = run->capture->max_width_px;
    vehicle.max_height_px = run->capture->max_height_px;
    vehicle.area = run->capture->area;
    vehicle.keep_colour = true;
    const size_t n_bytes = oc_vehicle_size(&vehicle);
    if (n_bytes == 0) {
        snprintf(error, error_bytes, "the configuration is out of range");
        return false;
    }
    run->block = aligned_alloc(64, (n_bytes + 63) / 64 * 64);
    if (!run->block || oc_vehicle_init(&vehicle, run->block, n_bytes, &run->vehicle) != OC_OK) {
        snprintf(error, error_bytes, "cannot set up %zu bytes for the vehicle", n_bytes);
        return false;
    }
    run->rectify = oc_rectify_create(vehicle.max_width_px, vehicle.max_height_px);
    if (run->config->mode == OC_LINK_IMAGES)
        run->images = oc_image_sender_create(vehicle.stored_views, run->config->image_codec, run->config->image_quality,
                                             vehicle.datagram_bytes);
    if (!run->rectify || (run->config->mode == OC_LINK_IMAGES && !run->images)) {
        snprintf(error, error_bytes, "out of memory");
        return false;
    }
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGTERM);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGHUP);
    sigprocmask(SIG_BLOCK, &signals, NULL);
    run->signal_fd = signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
    if (run->signal_fd < 0) {
        snprintf(error, error_bytes, "signalfd: %s", strerror(errno));
        return false;
    }
    run->link = oc_link_open(run->config->down_url, OC_CHANNEL_DOWN, run->config->up_url, OC_CHANNEL_UP, run_on_packet,
                             run, error, error_bytes);
    return run->link != NULL;
}

static void run_close(vehicle_run_t *run)
{
    oc_link_close(run->link);
    if (run->signal_fd >= 0) close(run->signal_fd);
    oc_image_sender_destroy(run->images);
    oc_rectify_destroy(run->rectify);
    free(run->block);
    free(run);
}

bool oc_run(const oc_config_t *config, oc_capture_t *capture, char *error, size_t error_bytes)
{
    vehicle_run_t *run = calloc(1, sizeof *run);
    if (!run) {
        snprintf(error, error_bytes, "out of memory");
        return false;
    }
    run->config = config;
    run->capture = capture;
    run->signal_fd = -1;
    bool is_ok = run_open(run, error, error_bytes);
    if (is_ok) {
        run_loop(run);
        if (run->fault[0]) snprintf(error, error_bytes, "%s", run->fault);
        is_ok = run->fault[0] == '\0';
        if (is_ok && config->debug_dump[0] && !run->images)
            is_ok = oc_debug_dump(run->vehicle, config->debug_dump, error, error_bytes);
    }
    run_close(run);
    return is_ok;
}
