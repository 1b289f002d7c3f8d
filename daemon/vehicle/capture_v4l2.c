/* SPDX-License-Identifier: BSD-3-Clause
 * Cameras through V4L2: single-planar capture, streaming from buffers that the driver maps to us. */
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "clock_map.h"
#include "video_device.h"

#define MAX_BUFFERS 16u

struct oc_video {
    int fd;
    uint32_t n_buffers;
    bool is_streaming;
    struct {
        void *bytes;
        size_t n_bytes;
    } buffers[MAX_BUFFERS];
};

typedef struct complaint {
    const char *path;
    char *error;
    size_t error_bytes;
} complaint_t;

/* False, so that a function may end with it. */
__attribute__((format(printf, 2, 3))) static bool complain(const complaint_t *c, const char *format, ...)
{
    char what[256];
    va_list args;
    va_start(args, format);
    vsnprintf(what, sizeof what, format, args);
    va_end(args);
    snprintf(c->error, c->error_bytes, "%s: %s", c->path, what);
    return false;
}

static int command(int fd, unsigned long request, void *argument)
{
    int result;
    do result = ioctl(fd, request, argument);
    while (result < 0 && errno == EINTR);
    return result;
}

/* ---- formats ---- */

static const struct {
    oc_pixel_format_t format;
    uint32_t fourcc;
} fourccs[] = {
    {OC_PIXEL_GREY, V4L2_PIX_FMT_GREY}, {OC_PIXEL_YUYV, V4L2_PIX_FMT_YUYV},  {OC_PIXEL_UYVY, V4L2_PIX_FMT_UYVY},
    {OC_PIXEL_NV12, V4L2_PIX_FMT_NV12}, {OC_PIXEL_MJPG, V4L2_PIX_FMT_MJPEG}, {OC_PIXEL_RGB, V4L2_PIX_FMT_RGB24},
};

#define N_FOURCCS (sizeof fourccs / sizeof *fourccs)

static uint32_t fourcc_of(oc_pixel_format_t format)
{
    for (size_t i = 0; i < N_FOURCCS; i++) {
        if (fourccs[i].format == format) return fourccs[i].fourcc;
    }
    return 0;
}

static void fourcc_text(uint32_t fourcc, char text[5])
{
    for (int i = 0; i < 4; i++) {
        const unsigned c = fourcc >> (8 * i) & 127u;
        text[i] = (char)(c > 32 && c < 127 ? c : '.');
    }
    text[4] = '\0';
}

/* "YUYV MJPG", or "YUYV 640x480 320x240" for one format, as far as there is room. */
static void offers_text(int fd, uint32_t fourcc, char *text, size_t text_bytes)
{
    size_t n = 0;
    text[0] = '\0';
    for (uint32_t i = 0; i < 32 && n + 16 < text_bytes; i++) {
        char word[16];
        if (fourcc == 0) {
            struct v4l2_fmtdesc format = {.index = i, .type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
            if (command(fd, VIDIOC_ENUM_FMT, &format) < 0) break;
            fourcc_text(format.pixelformat, word);
        } else {
            struct v4l2_frmsizeenum size = {.index = i, .pixel_format = fourcc};
            if (command(fd, VIDIOC_ENUM_FRAMESIZES, &size) < 0 || size.type != V4L2_FRMSIZE_TYPE_DISCRETE) break;
            snprintf(word, sizeof word, "%ux%u", size.discrete.width % 100000u, size.discrete.height % 100000u);
        }
        n += (size_t)snprintf(text + n, text_bytes - n, " %s", word);
    }
    if (n == 0) snprintf(text, text_bytes, " nothing that it names");
}

/* ---- setting up ---- */

static bool check_capabilities(int fd, const complaint_t *c, oc_video_mode_t *mode)
{
    struct v4l2_capability capability;
    if (command(fd, VIDIOC_QUERYCAP, &capability) < 0) {
        if (errno == ENOTTY || errno == EINVAL) return complain(c, "is not a V4L2 device");
        return complain(c, "cannot be asked what it is: %s", strerror(errno));
    }
    const uint32_t caps =
        capability.capabilities & V4L2_CAP_DEVICE_CAPS ? capability.device_caps : capability.capabilities;
    if (!(caps & V4L2_CAP_VIDEO_CAPTURE)) {
        if (caps & V4L2_CAP_META_CAPTURE)
            return complain(c, "gives metadata, not pictures: the camera's other node, index 0, is meant");
        if (caps & (V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_VIDEO_M2M_MPLANE))
            return complain(c, "has the multi-planar interface only, which is not supported");
        return complain(c, "does not capture video");
    }
    if (!(caps & V4L2_CAP_STREAMING)) return complain(c, "cannot stream");
    snprintf(mode->card, sizeof mode->card, "%.31s", (const char *)capability.card);
    snprintf(mode->bus, sizeof mode->bus, "%.31s", (const char *)capability.bus_info);
    return true;
}

static bool set_format(int fd, const oc_video_wish_t *wish, const complaint_t *c, oc_video_mode_t *mode)
{
    const uint32_t fourcc = fourcc_of(wish->format);
    struct v4l2_format format = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
    struct v4l2_pix_format *pix = &format.fmt.pix;
    pix->width = wish->width_px;
    pix->height = wish->height_px;
    pix->pixelformat = fourcc;
    pix->field = V4L2_FIELD_NONE;
    if (command(fd, VIDIOC_S_FMT, &format) < 0) {
        if (errno == EBUSY) return complain(c, "is in use by another program");
        return complain(c, "cannot set %s %ux%u: %s", oc_pixel_format_name(wish->format), wish->width_px,
                        wish->height_px, strerror(errno));
    }
    char offers[160];
    if (pix->pixelformat != fourcc) {
        offers_text(fd, 0, offers, sizeof offers);
        return complain(c, "has no %s; it offers%s", oc_pixel_format_name(wish->format), offers);
    }
    if (pix->width != wish->width_px || pix->height != wish->height_px) {
        offers_text(fd, fourcc, offers, sizeof offers);
        return complain(c, "has no %ux%u in %s; it offers%s, and would give %ux%u", wish->width_px, wish->height_px,
                        oc_pixel_format_name(wish->format), offers, pix->width, pix->height);
    }
    if (wish->format != OC_PIXEL_MJPG && pix->bytesperline < oc_pixel_format_row_bytes(wish->format, wish->width_px))
        return complain(c, "says that a row has %u bytes, which are too few", pix->bytesperline);
    if (pix->field != V4L2_FIELD_NONE && pix->field != V4L2_FIELD_ANY) return complain(c, "gives interlaced pictures");
    mode->stride_bytes = wish->format == OC_PIXEL_MJPG ? 0 : pix->bytesperline;
    mode->buffer_bytes = pix->sizeimage;
    return true;
}

/* A driver that cannot set the rate keeps its own. */
static void set_rate(int fd, double rate_hz, oc_video_mode_t *mode)
{
    struct v4l2_streamparm parm = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
    if (rate_hz > 0) {
        parm.parm.capture.timeperframe.numerator = 1000;
        parm.parm.capture.timeperframe.denominator = (uint32_t)lround(rate_hz * 1000);
        if (command(fd, VIDIOC_S_PARM, &parm) < 0) return;
    } else if (command(fd, VIDIOC_G_PARM, &parm) < 0) {
        return;
    }
    const struct v4l2_fract *t = &parm.parm.capture.timeperframe;
    if (t->numerator > 0) mode->rate_hz = (double)t->denominator / t->numerator;
}

static void set_control(int fd, uint32_t id, int32_t value, oc_video_mode_t *mode)
{
    struct v4l2_control control = {.id = id, .value = value};
    if (command(fd, VIDIOC_S_CTRL, &control) < 0) mode->n_controls_refused++;
}

/* Automatic exposure has two names, and a camera often has one of them only. */
static void set_exposure_auto(int fd, oc_video_mode_t *mode)
{
    struct v4l2_control control = {.id = V4L2_CID_EXPOSURE_AUTO, .value = V4L2_EXPOSURE_AUTO};
    if (command(fd, VIDIOC_S_CTRL, &control) == 0) return;
    set_control(fd, V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY, mode);
}

static void set_controls(int fd, const oc_video_controls_t *wish, oc_video_mode_t *mode)
{
    if (wish->has_exposure && wish->is_exposure_auto) {
        set_exposure_auto(fd, mode);
    } else if (wish->has_exposure) {
        set_control(fd, V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL, mode);
        const uint32_t in_100_us = (wish->exposure_us + 50u) / 100u;
        set_control(fd, V4L2_CID_EXPOSURE_ABSOLUTE, (int32_t)(in_100_us > 0 ? in_100_us : 1), mode);
    }
    if (wish->has_gain) set_control(fd, V4L2_CID_GAIN, wish->gain, mode);
    if (wish->has_white_balance) {
        set_control(fd, V4L2_CID_AUTO_WHITE_BALANCE, wish->is_white_balance_auto, mode);
        if (!wish->is_white_balance_auto)
            set_control(fd, V4L2_CID_WHITE_BALANCE_TEMPERATURE, (int32_t)wish->white_balance_k, mode);
    }
}

static bool map_buffer(oc_video_t *video, uint32_t index, const complaint_t *c)
{
    struct v4l2_buffer buffer = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE, .memory = V4L2_MEMORY_MMAP, .index = index};
    if (command(video->fd, VIDIOC_QUERYBUF, &buffer) < 0)
        return complain(c, "cannot describe buffer %u: %s", index, strerror(errno));
    void *bytes = mmap(NULL, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, video->fd, buffer.m.offset);
    if (bytes == MAP_FAILED) return complain(c, "cannot map buffer %u: %s", index, strerror(errno));
    video->buffers[index].bytes = bytes;
    video->buffers[index].n_bytes = buffer.length;
    if (command(video->fd, VIDIOC_QBUF, &buffer) < 0)
        return complain(c, "does not take buffer %u: %s", index, strerror(errno));
    return true;
}

static bool start(oc_video_t *video, const oc_video_wish_t *wish, const complaint_t *c, oc_video_mode_t *mode)
{
    struct v4l2_requestbuffers request = {
        .count = wish->n_buffers, .type = V4L2_BUF_TYPE_VIDEO_CAPTURE, .memory = V4L2_MEMORY_MMAP};
    if (command(video->fd, VIDIOC_REQBUFS, &request) < 0) {
        if (errno == EBUSY) return complain(c, "is in use by another program");
        return complain(c, "gives no buffers: %s", strerror(errno));
    }
    if (request.count < 4) return complain(c, "gives %u buffers only, 4 are the least", request.count);
    video->n_buffers = request.count < MAX_BUFFERS ? request.count : MAX_BUFFERS;
    mode->n_buffers = video->n_buffers;
    for (uint32_t i = 0; i < video->n_buffers; i++) {
        if (!map_buffer(video, i, c)) return false;
    }
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (command(video->fd, VIDIOC_STREAMON, &type) < 0) {
        if (errno == ENOSPC)
            return complain(c, "finds no room on the USB bus: choose MJPG, a lower rate or a smaller size, or another "
                               "controller");
        return complain(c, "does not start to stream: %s", strerror(errno));
    }
    video->is_streaming = true;
    return true;
}

static void v4l2_close(oc_video_t *video)
{
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (video->is_streaming) (void)command(video->fd, VIDIOC_STREAMOFF, &type);
    for (uint32_t i = 0; i < video->n_buffers; i++) {
        if (video->buffers[i].bytes) munmap(video->buffers[i].bytes, video->buffers[i].n_bytes);
    }
    close(video->fd);
    free(video);
}

static int open_device(const complaint_t *c)
{
    const int fd = open(c->path, O_RDWR | O_NONBLOCK | O_CLOEXEC);
    struct stat info;
    if (fd < 0) {
        complain(c, "%s", strerror(errno));
        return -1;
    }
    if (fstat(fd, &info) == 0 && S_ISCHR(info.st_mode)) return fd;
    complain(c, "is not a device");
    close(fd);
    return -1;
}

static oc_video_t *v4l2_open(const oc_video_wish_t *wish, oc_video_mode_t *mode, char *error, size_t error_bytes)
{
    const complaint_t c = {wish->path, error, error_bytes};
    *mode = (oc_video_mode_t){0};
    oc_video_t *video = calloc(1, sizeof *video);
    if (!video) {
        complain(&c, "out of memory");
        return NULL;
    }
    video->fd = open_device(&c);
    if (video->fd < 0) {
        free(video);
        return NULL;
    }
    bool is_ok = check_capabilities(video->fd, &c, mode) && set_format(video->fd, wish, &c, mode);
    if (is_ok) {
        set_rate(video->fd, wish->rate_hz, mode);
        set_controls(video->fd, &wish->controls, mode);
        is_ok = start(video, wish, &c, mode);
    }
    if (is_ok) return video;
    v4l2_close(video);
    return NULL;
}

/* ---- frames ---- */

static int v4l2_fd(const oc_video_t *video)
{
    return video->fd;
}

static oc_video_result_t v4l2_take(oc_video_t *video, oc_video_frame_t *frame, char *error, size_t error_bytes)
{
    struct v4l2_buffer buffer = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE, .memory = V4L2_MEMORY_MMAP};
    if (command(video->fd, VIDIOC_DQBUF, &buffer) < 0) {
        if (errno == EAGAIN) return OC_VIDEO_NONE;
        snprintf(error, error_bytes, "no frame can be taken: %s", strerror(errno));
        return errno == ENODEV ? OC_VIDEO_GONE : OC_VIDEO_FAULT;
    }
    if (buffer.index >= video->n_buffers) {
        snprintf(error, error_bytes, "the driver gave buffer %u of %u", buffer.index, video->n_buffers);
        return OC_VIDEO_FAULT;
    }
    const bool is_monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    const size_t room = video->buffers[buffer.index].n_bytes;
    *frame = (oc_video_frame_t){.index = buffer.index,
                                .bytes = video->buffers[buffer.index].bytes,
                                .n_bytes = buffer.bytesused < room ? buffer.bytesused : room,
                                .sequence = buffer.sequence,
                                .mono_ns = is_monotonic ? (int64_t)buffer.timestamp.tv_sec * 1000000000 +
                                                              (int64_t)buffer.timestamp.tv_usec * 1000
                                                        : oc_mono_ns(),
                                .clock = is_monotonic ? OC_VIDEO_CLOCK_MONOTONIC : OC_VIDEO_CLOCK_ARRIVAL,
                                .is_flagged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0};
    return OC_VIDEO_FRAME;
}

static bool v4l2_give_back(oc_video_t *video, uint32_t index, char *error, size_t error_bytes)
{
    struct v4l2_buffer buffer = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE, .memory = V4L2_MEMORY_MMAP, .index = index};
    if (command(video->fd, VIDIOC_QBUF, &buffer) == 0) return true;
    snprintf(error, error_bytes, "the driver does not take buffer %u back: %s", index, strerror(errno));
    return false;
}

const oc_video_ops_t oc_video_v4l2 = {v4l2_open, v4l2_fd, v4l2_take, v4l2_give_back, v4l2_close};
