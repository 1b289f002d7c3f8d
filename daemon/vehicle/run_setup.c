/* SPDX-License-Identifier: BSD-3-Clause
 * Setting up the loop: source, vehicle, threads; all that is ever allocated. */
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "run_internal.h"

/* Body poses kept: 20 s at 100 Hz. */
#define POSE_TRACK_LENGTH 2048u

static bool gpio_is_wired(const oc_gpio_config_t *gpio)
{
    return gpio->trigger.is_used || gpio->strobe.is_used || gpio->heartbeat.is_used || gpio->enable.is_used ||
           gpio->mark.is_used;
}

static bool run_open_site(vehicle_run_t *run, oc_margin_t *margin, char *error, size_t error_bytes)
{
    const oc_config_t *config = run->config;
    run->capture =
        oc_capture_open_site(config->site, &config->site_option, &config->margin, margin, error, error_bytes);
    return run->capture != NULL;
}

static bool run_open_cameras(vehicle_run_t *run, char *error, size_t error_bytes)
{
    const oc_config_t *config = run->config;
    run->poses = oc_pose_track_create(POSE_TRACK_LENGTH, (int64_t)config->pose_max_gap_ms * 1000);
    if (!run->poses) {
        snprintf(error, error_bytes, "out of memory");
        return false;
    }
    if (gpio_is_wired(&config->gpio)) {
        run->gpio = oc_gpio_open(&config->gpio, &oc_gpio_libgpiod, &run->counters, error, error_bytes);
        if (!run->gpio) return false;
    }
    const oc_camera_source_parts_t parts = {
        .video = &oc_video_v4l2, .poses = run->poses, .gpio = run->gpio, .counters = &run->counters};
    run->capture = oc_camera_source_open(&config->cameras, &parts, error, error_bytes);
    return run->capture != NULL;
}

static void print_source(const vehicle_run_t *run, const oc_margin_t *margin)
{
    const oc_capture_t *c = run->capture;
    if (run->config->source == OC_SOURCE_CAMERAS) {
        const uint32_t n = run->config->cameras.n_cameras;
        printf("outcropd: %u camera%s, frames of at most %ux%u\n", n, n == 1 ? "" : "s", c->max_width_px,
               c->max_height_px);
    } else if (c->n_frames == 0) {
        printf("outcropd: frames without end of at most %ux%u, margins %.4g m and %.4g deg\n", c->max_width_px,
               c->max_height_px, margin->v[0], margin->v[3] * 57.29577951308232);
    } else {
        printf("outcropd: %u frames of at most %ux%u, margins %.4g m and %.4g deg\n", c->n_frames, c->max_width_px,
               c->max_height_px, margin->v[0], margin->v[3] * 57.29577951308232);
    }
    fflush(stdout);
}

static bool run_open_source(vehicle_run_t *run, char *error, size_t error_bytes)
{
    oc_margin_t margin;
    const bool is_ok = run->config->source == OC_SOURCE_CAMERAS ? run_open_cameras(run, error, error_bytes)
                                                                : run_open_site(run, &margin, error, error_bytes);
    if (is_ok) print_source(run, &margin);
    return is_ok;
}

/* Whether any camera gives colours. */
static bool has_colour(const oc_config_t *config)
{
    if (config->source == OC_SOURCE_SITE) return true;
    for (uint32_t i = 0; i < config->cameras.n_cameras; i++) {
        if (config->cameras.cameras[i].wish.format != OC_PIXEL_GREY) return true;
    }
    return false;
}

static bool run_open_vehicle(vehicle_run_t *run, char *error, size_t error_bytes)
{
    oc_vehicle_config_t vehicle = run->config->vehicle;
    vehicle.max_width_px = run->capture->max_width_px;
    vehicle.max_height_px = run->capture->max_height_px;
    if (run->capture->area.is_set) vehicle.area = run->capture->area;
    vehicle.keep_colour = has_colour(run->config);
    vehicle.hold_views = run->config->has_held_views;
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
    const uint32_t n_cameras = run->config->source == OC_SOURCE_CAMERAS ? run->config->cameras.n_cameras : 1;
    bool is_ok = true;
    for (uint32_t i = 0; i < n_cameras; i++) {
        run->rectify[i] = oc_rectify_create(vehicle.max_width_px, vehicle.max_height_px);
        is_ok = is_ok && run->rectify[i];
    }
    if (run->config->mode == OC_LINK_IMAGES) {
        run->images = oc_image_sender_create(vehicle.stored_views, run->config->image_codec, run->config->image_quality,
                                             vehicle.datagram_bytes);
        is_ok = is_ok && run->images;
    }
    run->tile_worker = oc_tile_worker_create();
    run->tiles = (oc_picture_tiles_t){.vehicle = run->vehicle,
                                      .worker = run->tile_worker,
                                      .counters = &run->counters,
                                      .datagram_bytes = vehicle.datagram_bytes};
    if (!is_ok || !run->tile_worker) snprintf(error, error_bytes, "out of memory");
    return is_ok && run->tile_worker;
}

/* Before any thread is started, so that all of them leave the signals to the loop. */
static bool run_open_signals(vehicle_run_t *run, char *error, size_t error_bytes)
{
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGTERM);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGHUP);
    sigaddset(&signals, SIGUSR1);
    sigprocmask(SIG_BLOCK, &signals, NULL);
    run->signal_fd = signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
    if (run->signal_fd < 0) snprintf(error, error_bytes, "signalfd: %s", strerror(errno));
    return run->signal_fd >= 0;
}

static bool run_open(vehicle_run_t *run, char *error, size_t error_bytes)
{
    const oc_config_t *config = run->config;
    if (!run_open_signals(run, error, error_bytes)) return false;
    if (!run_open_source(run, error, error_bytes)) return false;
    if (!run_open_vehicle(run, error, error_bytes)) return false;
    const oc_receiver_config_t receiver = {.down_url = config->down_url,
                                           .up_url = config->up_url,
                                           .vehicle = config->vehicle.vehicle,
                                           .pose_url = run->poses ? config->pose_url : "",
                                           .pose_channel = config->pose_channel,
                                           .pose_type = config->pose_type};
    run->receiver = oc_receiver_open(&receiver, run->poses, &run->counters, error, error_bytes);
    return run->receiver != NULL;
}

static bool run_check(vehicle_run_t *run, char *error, size_t error_bytes)
{
    if (run->config->source == OC_SOURCE_SITE) return run_open_source(run, error, error_bytes);
    for (uint32_t i = 0; i < run->config->cameras.n_cameras; i++) {
        const oc_camera_config_t *camera = &run->config->cameras.cameras[i];
        printf("outcropd: camera %s: %s, %s %ux%u\n", camera->name, camera->wish.path,
               oc_pixel_format_name(camera->wish.format), camera->wish.width_px, camera->wish.height_px);
    }
    return true;
}

void oc_run_close(vehicle_run_t *run)
{
    if (!run) return;
    oc_receiver_close(run->receiver);
    oc_tile_worker_destroy(run->tile_worker);
    if (run->signal_fd >= 0) close(run->signal_fd);
    oc_image_sender_destroy(run->images);
    for (uint32_t i = 0; i < OC_MAX_CAMERAS; i++) oc_rectify_destroy(run->rectify[i]);
    if (run->capture) run->capture->close(run->capture);
    if (run->gpio) oc_gpio_close(run->gpio);
    if (run->poses) oc_pose_track_destroy(run->poses);
    free(run->block);
    free(run);
}

vehicle_run_t *oc_run_open(const oc_config_t *config, bool is_check, char *error, size_t error_bytes)
{
    vehicle_run_t *run = calloc(1, sizeof *run);
    if (!run) {
        snprintf(error, error_bytes, "out of memory");
        return NULL;
    }
    run->config = config;
    run->signal_fd = -1;
    if (is_check ? run_check(run, error, error_bytes) : run_open(run, error, error_bytes)) return run;
    oc_run_close(run);
    return NULL;
}
