/* SPDX-License-Identifier: BSD-3-Clause
 * Frames from a site folder: cameras.json and its pictures, each with an exact time and pose. */
#include <jansson.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "capture.h"
#include "image_file.h"

/* Views without utime are one second apart from here on: 2004-01-01 UTC. */
#define SITE_EPOCH_US 1072915200000000LL

#define SITE_MAX_VIEWS 65535u

/* What the link can carry (docs/protocol.md) or nobody means. */
#define SITE_MAX_FOCAL_PX 1e6
#define SITE_MAX_DISTORTION 1e6
#define SITE_MAX_COORDINATE_M 2e5
#define SITE_MAX_MARGIN_M 1e4
#define SITE_MAX_MARGIN_DEG 45.0
#define SITE_MAX_UTIME_US (((int64_t)1 << 56) - 1)

/* What decoded pictures may take. */
#define SITE_MAX_KEPT_BYTES ((size_t)1 << 30)

typedef struct site_view {
    char *image_path;
    uint8_t *kept_px;    /* decoded, RGB; NULL when read anew each time */
    oc_captured_t frame; /* all but the pixels */
} site_view_t;

typedef struct site_capture {
    oc_capture_t base;
    site_view_t *views;
    uint32_t n_views;
    oc_site_option_t option;
    uint64_t n_shown; /* frames handed out */
    int64_t next_ns;  /* monotonic, when the next frame is due; 0 = at once */
    uint8_t *px;      /* one frame, RGB */
} site_capture_t;

/* Where a complaint goes, and what it is about. */
typedef struct site_reader {
    const char *file;
    char *error;
    size_t error_bytes;
    double metres_per_unit;
} site_reader_t;

__attribute__((format(printf, 2, 3))) static bool complain(const site_reader_t *r, const char *format, ...)
{
    char what[256];
    va_list args;
    va_start(args, format);
    vsnprintf(what, sizeof what, format, args);
    va_end(args);
    snprintf(r->error, r->error_bytes, "%s: %s", r->file, what);
    return false;
}

static bool read_number(const site_reader_t *r, const json_t *object, const char *key, size_t view, double *out)
{
    const json_t *value = json_object_get(object, key);
    if (!json_is_number(value)) return complain(r, "view %zu: \"%s\" is missing or not a number", view, key);
    *out = json_number_value(value);
    if (!isfinite(*out)) return complain(r, "view %zu: \"%s\" is not finite", view, key);
    return true;
}

static bool read_array(const site_reader_t *r, const json_t *array, const char *key, size_t view, double *out, size_t n)
{
    if (!json_is_array(array) || json_array_size(array) != n)
        return complain(r, "view %zu: \"%s\" must be an array of %zu numbers", view, key, n);
    for (size_t i = 0; i < n; i++) {
        const json_t *value = json_array_get(array, i);
        if (!json_is_number(value) || !isfinite(json_number_value(value)))
            return complain(r, "view %zu: \"%s\" must be an array of %zu numbers", view, key, n);
        out[i] = json_number_value(value);
    }
    return true;
}

static bool read_size(const site_reader_t *r, const json_t *object, const char *key, size_t view, uint32_t *out)
{
    const json_t *value = json_object_get(object, key);
    if (!json_is_integer(value)) return complain(r, "view %zu: \"%s\" is missing or not an integer", view, key);
    const json_int_t n = json_integer_value(value);
    if (n < (json_int_t)OC_MIN_IMAGE_SIDE || n > (json_int_t)OC_MAX_IMAGE_SIDE)
        return complain(r, "view %zu: \"%s\" is not within %u..%u", view, key, OC_MIN_IMAGE_SIDE, OC_MAX_IMAGE_SIDE);
    *out = (uint32_t)n;
    return true;
}

static bool read_distortion(const site_reader_t *r, const json_t *view, size_t index, oc_captured_t *frame)
{
    const json_t *dist = json_object_get(view, "dist");
    if (!dist) return true;
    if (!read_array(r, dist, "dist", index, frame->distortion.k, 5)) return false;
    for (int i = 0; i < 5; i++) {
        if (!(fabs(frame->distortion.k[i]) <= SITE_MAX_DISTORTION))
            return complain(r, "view %zu: \"dist\" is larger than %g", index, SITE_MAX_DISTORTION);
        frame->has_distortion = frame->has_distortion || frame->distortion.k[i] != 0;
    }
    return true;
}

static bool read_intrinsics(const site_reader_t *r, const json_t *view, size_t index, oc_captured_t *frame)
{
    oc_intrinsics_t *k = &frame->camera.k;
    if (!read_size(r, view, "width", index, &k->width_px)) return false;
    if (!read_size(r, view, "height", index, &k->height_px)) return false;
    if (!read_number(r, view, "fx", index, &k->fx_px)) return false;
    if (!read_number(r, view, "fy", index, &k->fy_px)) return false;
    if (!read_number(r, view, "cx", index, &k->cx_px)) return false;
    if (!read_number(r, view, "cy", index, &k->cy_px)) return false;
    if (!(k->fx_px > 0) || !(k->fy_px > 0)) return complain(r, "view %zu: focal length is not positive", index);
    if (k->fx_px < 1 || k->fx_px > SITE_MAX_FOCAL_PX || k->fy_px < 1 || k->fy_px > SITE_MAX_FOCAL_PX)
        return complain(r, "view %zu: focal length is not within 1..%g px", index, SITE_MAX_FOCAL_PX);
    if (!oc_intrinsics_is_valid(k)) return complain(r, "view %zu: principal point is far outside the image", index);
    return read_distortion(r, view, index, frame);
}

static bool read_pose(const site_reader_t *r, const json_t *view, size_t index, oc_pose_t *pose)
{
    const json_t *rows = json_object_get(view, "R");
    if (!json_is_array(rows) || json_array_size(rows) != 3)
        return complain(r, "view %zu: \"R\" must have three rows", index);
    for (size_t i = 0; i < 3; i++) {
        if (!read_array(r, json_array_get(rows, i), "R", index, &pose->R[3 * i], 3)) return false;
    }
    if (!read_array(r, json_object_get(view, "t"), "t", index, pose->t, 3)) return false;
    for (int i = 0; i < 3; i++) pose->t[i] *= r->metres_per_unit;
    /* A rotation turns -t into the centre and leaves its length. */
    if (!(hypot(hypot(pose->t[0], pose->t[1]), pose->t[2]) <= SITE_MAX_COORDINATE_M))
        return complain(r, "view %zu: the camera is more than %g km away", index, SITE_MAX_COORDINATE_M * 1e-3);
    if (!oc_pose_is_valid(pose)) return complain(r, "view %zu: \"R\" is not a rotation", index);
    return true;
}

static bool read_time(const site_reader_t *r, const json_t *view, size_t index, int64_t *utime_us)
{
    const json_t *utime = json_object_get(view, "utime");
    *utime_us = SITE_EPOCH_US + (int64_t)index * 1000000;
    if (!utime) return true;
    if (!json_is_integer(utime) || json_integer_value(utime) < 0 || json_integer_value(utime) > SITE_MAX_UTIME_US)
        return complain(r, "view %zu: \"utime\" is not microseconds since 1970", index);
    *utime_us = json_integer_value(utime);
    return true;
}

static char *join_path(const char *folder, const char *name)
{
    const size_t n = strlen(folder) + strlen(name) + 2;
    char *path = malloc(n);
    if (path) snprintf(path, n, "%s%s%s", name[0] == '/' ? "" : folder, name[0] == '/' ? "" : "/", name);
    return path;
}

static bool read_view(const site_reader_t *r, const char *folder, const json_t *view, size_t index, site_view_t *out)
{
    oc_captured_t *frame = &out->frame;
    if (!json_is_object(view)) return complain(r, "view %zu is not an object", index);
    const json_t *image = json_object_get(view, "image");
    if (!json_is_string(image)) return complain(r, "view %zu: \"image\" is missing or not a string", index);
    if (!read_intrinsics(r, view, index, frame)) return false;
    if (!read_pose(r, view, index, &frame->camera.pose)) return false;
    if (!read_time(r, view, index, &frame->utime_us)) return false;

    const json_t *id = json_object_get(view, "index");
    if (id && (!json_is_integer(id) || json_integer_value(id) < 0 || json_integer_value(id) >= SITE_MAX_VIEWS))
        return complain(r, "view %zu: \"index\" is not within 0..%u", index, SITE_MAX_VIEWS - 1);
    frame->view_id = (uint16_t)(id ? json_integer_value(id) : (json_int_t)index);
    frame->has_view_id = true;
    frame->is_forced = true;
    frame->lens = frame->has_distortion ? oc_lens_plumb_bob(&frame->camera.k, &frame->distortion)
                                        : oc_lens_pinhole(&frame->camera.k);

    out->image_path = join_path(folder, json_string_value(image));
    if (!out->image_path) return complain(r, "out of memory");
    uint32_t width_px, height_px;
    if (!oc_image_file_size(out->image_path, &width_px, &height_px, r->error, r->error_bytes)) return false;
    if (width_px != frame->camera.k.width_px || height_px != frame->camera.k.height_px) {
        return complain(r, "view %zu: %s is %ux%u, the file says %ux%u", index, json_string_value(image), width_px,
                        height_px, frame->camera.k.width_px, frame->camera.k.height_px);
    }
    return true;
}

static bool read_units(site_reader_t *r, const json_t *root)
{
    const json_t *units = json_object_get(root, "units");
    const char *text = json_is_string(units) ? json_string_value(units) : "";
    if (strcmp(text, "m") == 0) {
        r->metres_per_unit = 1;
    } else if (strcmp(text, "mm") == 0) {
        r->metres_per_unit = 1e-3;
    } else {
        return complain(r, "\"units\" must be \"mm\" or \"m\"");
    }
    return true;
}

static bool read_range(const site_reader_t *r, const json_t *area, const char *key, double *low, double *high)
{
    const json_t *range = json_object_get(area, key);
    const json_t *a = json_array_get(range, 0), *b = json_array_get(range, 1);
    if (json_array_size(range) != 2 || !json_is_number(a) || !json_is_number(b))
        return complain(r, "area: \"%s\" must be two ascending numbers", key);
    const double from_m = json_number_value(a) * r->metres_per_unit, to_m = json_number_value(b) * r->metres_per_unit;
    if (!(fabs(from_m) <= SITE_MAX_COORDINATE_M && fabs(to_m) <= SITE_MAX_COORDINATE_M))
        return complain(r, "area: \"%s\" reaches farther than %g km", key, SITE_MAX_COORDINATE_M * 1e-3);
    if (!((float)from_m < (float)to_m)) /* as they travel */
        return complain(r, "area: \"%s\" must be two ascending numbers", key);
    *low = from_m;
    *high = to_m;
    return true;
}

static bool read_area(const site_reader_t *r, const json_t *root, oc_area_t *out)
{
    const json_t *area = json_object_get(root, "area");
    if (!area) return true;
    if (!read_range(r, area, "x", &out->x_min, &out->x_max)) return false;
    if (!read_range(r, area, "y", &out->y_min, &out->y_max)) return false;
    const json_t *z_max = json_object_get(area, "z_max");
    out->z_max = json_is_number(z_max) ? json_number_value(z_max) * r->metres_per_unit : 0;
    if (!(out->z_max >= 1e-6 && out->z_max <= SITE_MAX_COORDINATE_M))
        return complain(r, "area: \"z_max\" must be a positive number");
    out->is_set = true;
    return true;
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Half a per cent of the median distance from the camera to the ground along
 * its axis (or its height, when the axis misses the ground). */
static double default_position_margin_m(const site_capture_t *site)
{
    double *distance = malloc(site->n_views * sizeof *distance);
    if (!distance) return 0.05;
    for (uint32_t i = 0; i < site->n_views; i++) {
        const oc_pose_t *pose = &site->views[i].frame.camera.pose;
        double centre[3];
        oc_pose_centre(pose, centre);
        const double down = -pose->R[8]; /* of the optical axis */
        distance[i] = down > 0.05 ? fabs(centre[2]) / down : fabs(centre[2]);
    }
    qsort(distance, site->n_views, sizeof *distance, compare_doubles);
    const double median = distance[site->n_views / 2];
    free(distance);
    return 0.005 * median;
}

static bool read_margins(const site_reader_t *r, const json_t *root, const oc_margin_option_t *option,
                         site_capture_t *site, oc_margin_t *used)
{
    double position_m = default_position_margin_m(site), angle_rad = M_PI / 180;
    const json_t *margins = json_object_get(root, "margins");
    if (margins) {
        const json_t *position = json_object_get(margins, "position"), *angle = json_object_get(margins, "angle_deg");
        if (!json_is_number(position) || !(json_number_value(position) >= 0) || !json_is_number(angle) ||
            !(json_number_value(angle) >= 0))
            return complain(r, "\"margins\" must hold \"position\" and \"angle_deg\", not negative");
        position_m = json_number_value(position) * r->metres_per_unit;
        angle_rad = json_number_value(angle) * M_PI / 180;
        if (position_m > SITE_MAX_MARGIN_M || angle_rad > SITE_MAX_MARGIN_DEG * M_PI / 180)
            return complain(r, "\"margins\" are larger than %g m or %g degrees", SITE_MAX_MARGIN_M,
                            SITE_MAX_MARGIN_DEG);
    }
    if (!isnan(option->position_m)) position_m = option->position_m;
    if (!isnan(option->angle_rad)) angle_rad = option->angle_rad;
    for (int i = 0; i < 3; i++) {
        used->v[i] = position_m;
        used->v[3 + i] = angle_rad;
    }
    for (uint32_t i = 0; i < site->n_views; i++) site->views[i].frame.margin = *used;
    return true;
}

static bool read_site(site_reader_t *r, const char *folder, const json_t *root, const oc_margin_option_t *option,
                      site_capture_t *site, oc_margin_t *used)
{
    if (!read_units(r, root)) return false;
    const json_t *views = json_object_get(root, "views");
    const size_t n = json_array_size(views);
    if (n < 2) return complain(r, "needs at least two views, has %zu", n);
    if (n > SITE_MAX_VIEWS) return complain(r, "has %zu views, more than %u", n, SITE_MAX_VIEWS);
    site->views = calloc(n, sizeof *site->views);
    if (!site->views) return complain(r, "out of memory");
    for (size_t i = 0; i < n; i++) {
        site->n_views++;
        if (!read_view(r, folder, json_array_get(views, i), i, &site->views[i])) return false;
        if (i > 0 && site->views[i].frame.view_id <= site->views[i - 1].frame.view_id)
            return complain(r, "view %zu: \"index\" does not ascend", i);
        const oc_intrinsics_t *k = &site->views[i].frame.camera.k;
        if (k->width_px > site->base.max_width_px) site->base.max_width_px = k->width_px;
        if (k->height_px > site->base.max_height_px) site->base.max_height_px = k->height_px;
    }
    site->base.n_frames = site->option.is_looped ? 0 : site->n_views * site->option.repeat;
    if (!read_area(r, root, &site->base.area)) return false;
    return read_margins(r, root, option, site, used);
}

static bool site_keeps_pictures(const site_capture_t *site)
{
    return site->option.is_looped || site->option.repeat > 1;
}

static oc_image_mut_t site_pixels(const site_capture_t *site, const site_view_t *view)
{
    const oc_intrinsics_t *k = &view->frame.camera.k;
    return (oc_image_mut_t){view->kept_px ? view->kept_px : site->px, k->width_px, k->height_px, 3 * k->width_px, 3};
}

static bool keep_pictures(const site_reader_t *r, site_capture_t *site)
{
    size_t n_bytes = 0;
    for (uint32_t i = 0; i < site->n_views; i++) {
        const oc_intrinsics_t *k = &site->views[i].frame.camera.k;
        n_bytes += (size_t)k->width_px * k->height_px * 3;
        if (n_bytes > SITE_MAX_KEPT_BYTES)
            return complain(r, "pictures shown again and again are kept decoded, and these take more than %zu MiB",
                            SITE_MAX_KEPT_BYTES >> 20);
        site->views[i].kept_px = malloc((size_t)k->width_px * k->height_px * 3);
        if (!site->views[i].kept_px) return complain(r, "out of memory");
    }
    return true;
}

/* A broken picture is found before anything is sent, not in the middle of a drive. */
static bool read_pictures(const site_reader_t *r, site_capture_t *site)
{
    if (site_keeps_pictures(site)) {
        if (!keep_pictures(r, site)) return false;
    } else {
        site->px = malloc((size_t)site->base.max_width_px * site->base.max_height_px * 3);
        if (!site->px) return complain(r, "out of memory");
    }
    for (uint32_t i = 0; i < site->n_views; i++) {
        oc_image_mut_t out = site_pixels(site, &site->views[i]);
        if (!oc_image_file_read(site->views[i].image_path, &out, r->error, r->error_bytes)) return false;
    }
    return true;
}

/* What the n-th frame is, but for the pixels. */
static void site_describe_frame(const site_capture_t *site, const site_view_t *view, oc_captured_t *frame)
{
    *frame = view->frame;
    frame->is_forced = !site->option.has_keyframe_policy;
    if (!site_keeps_pictures(site)) return;
    /* Shown again, a view is another frame: the vehicle numbers it, and its time goes on. */
    frame->has_view_id = false;
    const int64_t step_us = site->option.period_ms > 0 ? (int64_t)site->option.period_ms * 1000 : 1000;
    frame->utime_us = site->views[0].frame.utime_us + (int64_t)site->n_shown * step_us;
}

static oc_capture_result_t site_next(oc_capture_t *self, int64_t now_ns, oc_captured_t *frame, char *error,
                                     size_t error_bytes)
{
    site_capture_t *site = (site_capture_t *)self;
    const uint64_t index = site->n_shown / site->option.repeat;
    if (index >= site->n_views && !site->option.is_looped) return OC_CAPTURE_DONE;
    if (now_ns < site->next_ns) return OC_CAPTURE_NONE;
    const int64_t due_ns = site->next_ns == 0 || site->option.period_ms == 0 ? now_ns : site->next_ns;
    site->next_ns = due_ns + (int64_t)site->option.period_ms * 1000000;
    const site_view_t *view = &site->views[index % site->n_views];
    site_describe_frame(site, view, frame);
    site->n_shown++;
    oc_image_mut_t out = site_pixels(site, view);
    if (!view->kept_px && !oc_image_file_read(view->image_path, &out, error, error_bytes)) return OC_CAPTURE_ERROR;
    const oc_image_t image = {out.px, out.width_px, out.height_px, out.stride_bytes, out.channels};
    frame->raw = oc_raw_from_image(&image);
    frame->arrived_ns = due_ns;
    return OC_CAPTURE_FRAME;
}

static uint32_t site_wait(oc_capture_t *self, struct pollfd *fds, int64_t *wake_ns)
{
    (void)fds;
    const site_capture_t *site = (const site_capture_t *)self;
    *wake_ns = site->next_ns;
    return 0;
}

static void site_close(oc_capture_t *self)
{
    site_capture_t *site = (site_capture_t *)self;
    for (uint32_t i = 0; i < site->n_views; i++) {
        free(site->views[i].image_path);
        free(site->views[i].kept_px);
    }
    free(site->views);
    free(site->px);
    free(site);
}

/* A folder means its cameras.json; a file means itself. */
static char *cameras_path(const char *path)
{
    struct stat info;
    if (stat(path, &info) == 0 && S_ISDIR(info.st_mode)) return join_path(path, "cameras.json");
    return strdup(path);
}

static json_t *load_cameras(const char *file, char *error, size_t error_bytes)
{
    json_error_t fault;
    json_t *root = json_load_file(file, JSON_REJECT_DUPLICATES, &fault);
    if (root) return root;
    char line[32] = "";
    if (fault.line > 0) snprintf(line, sizeof line, "line %d: ", fault.line);
    snprintf(error, error_bytes, "%s: %s%s", file, line, fault.text);
    return NULL;
}

oc_capture_t *oc_capture_open_site(const char *path, const oc_site_option_t *option, const oc_margin_option_t *margin,
                                   oc_margin_t *margin_used, char *error, size_t error_bytes)
{
    char *file = cameras_path(path), *folder = file ? strdup(file) : NULL;
    site_capture_t *site = calloc(1, sizeof *site);
    json_t *root = NULL;
    bool is_ok = false;
    if (!file || !folder || !site) {
        snprintf(error, error_bytes, "out of memory");
        goto done;
    }
    char *slash = strrchr(folder, '/');
    strcpy(slash ? slash : folder, slash ? "" : ".");
    if (slash == folder) strcpy(folder, "/.");

    root = load_cameras(file, error, error_bytes);
    if (!root) goto done;
    site->option = *option;
    if (option->repeat == 0) site->option.repeat = 1;
    site_reader_t reader = {file, error, error_bytes, 1};
    oc_margin_t used;
    is_ok = read_site(&reader, folder, root, margin, site, &used) && read_pictures(&reader, site);
    if (is_ok) *margin_used = used;
    site->base.next = site_next;
    site->base.wait = site_wait;
    site->base.close = site_close;

done:
    json_decref(root);
    free(file);
    free(folder);
    if (!is_ok && site) {
        site_close(&site->base);
        site = NULL;
    }
    return (oc_capture_t *)site;
}
