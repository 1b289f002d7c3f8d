/* SPDX-License-Identifier: BSD-3-Clause
 * A USB camera in user space (gadgetfs on dummy_hcd), so that the kernel's own uvcvideo serves the test's pictures.
 *
 *   uvc_camera FOLDER      shows FOLDER/K.yuyv and FOLDER/K.jpg, 640 x 480, K from 0
 *
 * Commands on standard input, one a line, each answered with "ok" once it is in force:
 *   show K               the picture from now on
 *   corrupt on|off       JPEGs cut in the middle, or with an early end marker, in turn
 *   short on|off         half of every frame is sent, which uncompressed is a damaged one
 *   flag on|off          frames bear the error bit of the payload header
 *   silence on|off       no frames */
#include <errno.h>
#include <fcntl.h>
#include <linux/usb/ch9.h>
#include <linux/usb/gadgetfs.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "uvc_descriptors.h"

#define MAX_PICTURES 256u
#define MAX_PAYLOAD_BYTES 16384u
#define BULK_PACKET_BYTES 512u

/* Requests of the video class. */
#define SET_CUR 0x01
#define GET_CUR 0x81
#define GET_MIN 0x82
#define GET_MAX 0x83
#define GET_LEN 0x85
#define GET_INFO 0x86
#define PROBE_CONTROL 1
#define COMMIT_CONTROL 2

/* Payload header. */
#define HEADER_FRAME_ID 0x01u
#define HEADER_END_OF_FRAME 0x02u
#define HEADER_TIME 0x04u
#define HEADER_ERROR 0x40u
#define HEADER_END_OF_HEADER 0x80u

/* What host and camera agree on; the wire's layout. */
typedef struct __attribute__((packed)) negotiation {
    uint16_t hint;
    uint8_t format, frame;
    uint32_t interval_100ns;
    uint16_t key_rate, p_rate, quality, window, delay;
    uint32_t max_frame_bytes, max_payload_bytes;
} negotiation_t;

typedef struct picture {
    uint8_t *bytes;
    size_t n_bytes;
} picture_t;

static picture_t yuyv[MAX_PICTURES], jpeg[MAX_PICTURES];
static unsigned n_pictures;

static int control_fd = -1, stream_fd = -1;
static pthread_t stream_thread;
static negotiation_t probed;
static _Atomic uint8_t committed_format;
static _Atomic uint32_t committed_interval;
static atomic_uint generation; /* of commits; 0: nobody has asked for frames */

static atomic_uint shown;
static atomic_bool is_corrupt, is_short, is_flagged, is_silent;

static void die(const char *what)
{
    perror(what);
    exit(1);
}

/* ---- pictures ---- */

static bool load(const char *folder, unsigned k, const char *suffix, picture_t *picture)
{
    char path[4096];
    if (snprintf(path, sizeof path, "%s/%u.%s", folder, k, suffix) >= (int)sizeof path) return false;
    FILE *file = fopen(path, "rb");
    if (!file) return false;
    picture->bytes = malloc(UVC_FRAME_BYTES);
    if (!picture->bytes) die("malloc");
    picture->n_bytes = fread(picture->bytes, 1, UVC_FRAME_BYTES, file);
    fclose(file);
    return picture->n_bytes > 0;
}

static void load_all(const char *folder)
{
    while (n_pictures < MAX_PICTURES && load(folder, n_pictures, "yuyv", &yuyv[n_pictures])) {
        if (yuyv[n_pictures].n_bytes != UVC_FRAME_BYTES || !load(folder, n_pictures, "jpg", &jpeg[n_pictures])) {
            fprintf(stderr, "uvc_camera: picture %u is not whole\n", n_pictures);
            exit(1);
        }
        n_pictures++;
    }
    if (n_pictures == 0) die(folder);
}

/* ---- frames ---- */

static bool write_payload(const uint8_t *bytes, size_t n_bytes, uint8_t flags)
{
    static uint8_t payload[MAX_PAYLOAD_BYTES];
    size_t header_bytes = 2;
    /* A payload ends with a short packet: one that would fill its last packet gets a longer header. */
    if (header_bytes + n_bytes < MAX_PAYLOAD_BYTES && (header_bytes + n_bytes) % BULK_PACKET_BYTES == 0) {
        header_bytes = 6;
        flags |= HEADER_TIME;
    }
    memset(payload, 0, header_bytes);
    payload[0] = (uint8_t)header_bytes;
    payload[1] = (uint8_t)(HEADER_END_OF_HEADER | flags);
    memcpy(payload + header_bytes, bytes, n_bytes);
    return write(stream_fd, payload, header_bytes + n_bytes) == (ssize_t)(header_bytes + n_bytes);
}

static bool write_frame(const uint8_t *bytes, size_t n_bytes, uint8_t flags)
{
    size_t n;
    for (size_t at = 0; at < n_bytes; at += n) {
        n = n_bytes - at < MAX_PAYLOAD_BYTES - 2 ? n_bytes - at : MAX_PAYLOAD_BYTES - 2;
        const uint8_t end = at + n == n_bytes ? HEADER_END_OF_FRAME : 0;
        if (!write_payload(bytes + at, n, (uint8_t)(flags | end))) return false;
    }
    return true;
}

/* The frame to be sent, damaged as wished. */
static bool send_frame(unsigned n_sent, uint8_t frame_id)
{
    static uint8_t frame[UVC_FRAME_BYTES];
    const bool is_jpeg = committed_format == UVC_FORMAT_MJPG;
    const picture_t *picture = is_jpeg ? &jpeg[shown] : &yuyv[shown];
    size_t n_bytes = picture->n_bytes;
    memcpy(frame, picture->bytes, n_bytes);
    if (is_short || (is_corrupt && is_jpeg && n_sent % 2 == 0)) n_bytes /= 2;
    if (is_corrupt && is_jpeg && n_sent % 2 == 1) {
        frame[n_bytes / 2] = 0xff;
        frame[n_bytes / 2 + 1] = 0xd9;
    }
    return write_frame(frame, n_bytes, (uint8_t)(frame_id | (is_flagged ? HEADER_ERROR : 0u)));
}

static void add_interval(struct timespec *time)
{
    time->tv_nsec += (long)committed_interval * 100;
    time->tv_sec += time->tv_nsec / 1000000000;
    time->tv_nsec %= 1000000000;
}

static void pause_ms(long ms)
{
    nanosleep(&(struct timespec){.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000}, NULL);
}

static void *stream(void *unused)
{
    struct timespec due = {0, 0};
    unsigned n_sent = 0, seen = 0;
    uint8_t frame_id = 0;
    for (;;) {
        if (generation == 0) {
            pause_ms(5);
            continue;
        }
        if (seen != generation) {
            seen = generation;
            clock_gettime(CLOCK_MONOTONIC, &due);
        }
        if (!is_silent) {
            frame_id ^= HEADER_FRAME_ID;
            errno = 0;
            if (send_frame(n_sent, frame_id))
                n_sent++;
            else if (errno != EINTR)
                pause_ms(20); /* unplugged */
        }
        add_interval(&due);
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL);
    }
    return unused;
}

/* ---- the control endpoint ---- */

static void settle(negotiation_t *n)
{
    n->hint = 1;
    if (n->format != UVC_FORMAT_MJPG) n->format = UVC_FORMAT_YUYV;
    n->frame = 1;
    if (n->interval_100ns <= UVC_INTERVAL_30_HZ)
        n->interval_100ns = UVC_INTERVAL_30_HZ;
    else if (n->interval_100ns <= UVC_INTERVAL_15_HZ)
        n->interval_100ns = UVC_INTERVAL_15_HZ;
    else
        n->interval_100ns = UVC_INTERVAL_5_HZ;
    n->max_frame_bytes = n->format == UVC_FORMAT_YUYV ? UVC_FRAME_BYTES : UVC_FRAME_BYTES / 2;
    n->max_payload_bytes = MAX_PAYLOAD_BYTES;
}

static void commit(const negotiation_t *wish)
{
    committed_format = wish->format;
    committed_interval = wish->interval_100ns;
    generation++;
    printf("stream %s %u\n", wish->format == UVC_FORMAT_MJPG ? "MJPG" : "YUYV", 10000000u / wish->interval_100ns);
    if (stream_fd >= 0) pthread_kill(stream_thread, SIGUSR1); /* out of a write that the last host left */
}

static void open_stream(void)
{
    const uint8_t setup[] = {1, 0, 0, 0, UVC_ENDPOINT(64u), UVC_ENDPOINT(BULK_PACKET_BYTES)};
    stream_fd = open("/dev/gadget/ep1in-bulk", O_RDWR | O_CLOEXEC);
    if (stream_fd < 0 || write(stream_fd, setup, sizeof setup) < 0) die("/dev/gadget/ep1in-bulk");
    if (pthread_create(&stream_thread, NULL, stream, NULL) != 0) die("thread");
}

/* UTF-16 string descriptor; its length, 0 when there is none. */
static size_t string_descriptor(unsigned index, uint8_t *out)
{
    const uint8_t languages[4] = {4, USB_DT_STRING, 0x09, 0x04};
    if (index == 0) {
        memcpy(out, languages, sizeof languages);
        return sizeof languages;
    }
    if (index > sizeof uvc_strings / sizeof *uvc_strings) return 0;
    size_t n = 2;
    for (const char *c = uvc_strings[index - 1]; *c; c++) {
        out[n++] = (uint8_t)*c;
        out[n++] = 0;
    }
    out[0] = (uint8_t)n;
    out[1] = USB_DT_STRING;
    return n;
}

static void acknowledge(void)
{
    uint8_t none;
    if (read(control_fd, &none, 0) < 0) perror("uvc_camera: acknowledge");
}

/* Take what the host sets of the stream. */
static void set_stream(unsigned selector, size_t length)
{
    negotiation_t wish = {0};
    if (read(control_fd, &wish, length < sizeof wish ? length : sizeof wish) < 0) {
        perror("uvc_camera: set");
        return;
    }
    settle(&wish);
    probed = wish;
    if (selector == COMMIT_CONTROL) commit(&wish);
}

/* What the host asks of the stream; its length. */
static size_t get_stream(unsigned request, uint8_t *out)
{
    negotiation_t answer = probed;
    switch (request) {
    case GET_INFO: out[0] = 3; return 1;
    case GET_LEN:
        out[0] = sizeof answer;
        out[1] = 0;
        return 2;
    case GET_MIN: answer.interval_100ns = UVC_INTERVAL_30_HZ; break;
    case GET_MAX: answer.interval_100ns = UVC_INTERVAL_5_HZ; break;
    default: break;
    }
    settle(&answer);
    memcpy(out, &answer, sizeof answer);
    return sizeof answer;
}

/* The wrong direction of transfer is how gadgetfs is told to stall. */
static void stall(const struct usb_ctrlrequest *setup)
{
    uint8_t none = 0;
    const ssize_t n = setup->bRequestType & USB_DIR_IN ? read(control_fd, &none, 0) : write(control_fd, &none, 0);
    if (n < 0 && errno != EL2HLT) perror("uvc_camera: stall");
}

static void answer_setup(const struct usb_ctrlrequest *setup)
{
    uint8_t answer[256];
    size_t n = 0;
    const unsigned selector = setup->wValue >> 8;
    const bool is_stream = (setup->bRequestType & 0x7f) == (USB_TYPE_CLASS | USB_RECIP_INTERFACE) &&
                           (setup->wIndex & 0xff) == 1 && (selector == PROBE_CONTROL || selector == COMMIT_CONTROL);
    if (setup->bRequestType == USB_DIR_IN && setup->bRequest == USB_REQ_GET_DESCRIPTOR && selector == USB_DT_STRING) {
        n = string_descriptor(setup->wValue & 0xff, answer);
    } else if (setup->bRequestType == 0 && setup->bRequest == USB_REQ_SET_CONFIGURATION) {
        if (setup->wValue != 0 && stream_fd < 0) open_stream();
        acknowledge();
        return;
    } else if (setup->bRequestType == USB_RECIP_INTERFACE && setup->bRequest == USB_REQ_SET_INTERFACE) {
        acknowledge();
        return;
    } else if (is_stream && setup->bRequest == SET_CUR) {
        set_stream(selector, setup->wLength);
        return;
    } else if (is_stream) {
        n = get_stream(setup->bRequest, answer);
    }
    if (n == 0) {
        stall(setup);
    } else if (write(control_fd, answer, n < setup->wLength ? n : setup->wLength) < 0 && errno != EIDRM) {
        perror("uvc_camera: answer");
    }
}

static void open_control(void)
{
    uint8_t all[4 + 2 * UVC_CONFIG_BYTES + sizeof uvc_device] = {0};
    memcpy(all + 4, uvc_config_full_speed, UVC_CONFIG_BYTES);
    memcpy(all + 4 + UVC_CONFIG_BYTES, uvc_config_high_speed, UVC_CONFIG_BYTES);
    memcpy(all + 4 + 2 * UVC_CONFIG_BYTES, uvc_device, sizeof uvc_device);
    control_fd = open("/dev/gadget/dummy_udc", O_RDWR | O_CLOEXEC);
    if (control_fd < 0 || write(control_fd, all, sizeof all) < 0) die("/dev/gadget/dummy_udc");
}

static void serve(void)
{
    for (;;) {
        struct usb_gadgetfs_event events[5];
        const ssize_t n = read(control_fd, events, sizeof events);
        if (n < 0 && errno != EINTR && errno != EIDRM && errno != EL2HLT) die("uvc_camera: control endpoint");
        for (size_t i = 0; n > 0 && i < (size_t)n / sizeof *events; i++) {
            if (events[i].type == GADGETFS_SETUP)
                answer_setup(&events[i].u.setup);
            else if (events[i].type == GADGETFS_CONNECT)
                puts("connected");
            else if (events[i].type == GADGETFS_DISCONNECT)
                puts("disconnected");
        }
    }
}

/* ---- commands ---- */

static bool obey(const char *line)
{
    static const struct {
        const char *name;
        atomic_bool *is_on;
    } switches[] = {{"corrupt", &is_corrupt}, {"short", &is_short}, {"flag", &is_flagged}, {"silence", &is_silent}};

    char word[16], value[16];
    if (sscanf(line, "%15s %15s", word, value) != 2) return false;
    if (strcmp(word, "show") == 0) {
        const unsigned long k = strtoul(value, NULL, 10);
        if (k >= n_pictures) return false;
        shown = (unsigned)k;
        return true;
    }
    for (size_t i = 0; i < sizeof switches / sizeof *switches; i++) {
        if (strcmp(word, switches[i].name) == 0) {
            *switches[i].is_on = strcmp(value, "on") == 0;
            return true;
        }
    }
    return false;
}

static void *take_commands(void *unused)
{
    char line[80];
    while (fgets(line, sizeof line, stdin)) puts(obey(line) ? "ok" : "what?");
    return unused;
}

static void interrupted(int signal)
{
    (void)signal;
}

int main(int argc, char **argv)
{
    if (argc != 2) {
        fputs("usage: uvc_camera FOLDER\n", stderr);
        return 1;
    }
    setvbuf(stdout, NULL, _IOLBF, 0);
    load_all(argv[1]);
    settle(&probed);
    sigaction(SIGUSR1, &(struct sigaction){.sa_handler = interrupted}, NULL); /* without SA_RESTART */
    open_control();
    pthread_t commands;
    if (pthread_create(&commands, NULL, take_commands, NULL) != 0) die("thread");
    serve();
    return 0;
}
