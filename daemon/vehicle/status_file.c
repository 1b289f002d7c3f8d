/* SPDX-License-Identifier: BSD-3-Clause
 * Writing and showing the state of the daemon. */
#include "status_file.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <jansson.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* Eight cameras with long names and errors fit. */
#define MAX_BYTES 16384

/* A file that is this old was written by a daemon that hangs or is gone. */
#define MAX_AGE_S 5

typedef struct text {
    char bytes[MAX_BYTES];
    size_t n;
} text_t;

__attribute__((format(printf, 2, 3))) static void add(text_t *text, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    const int n = vsnprintf(text->bytes + text->n, sizeof text->bytes - text->n, format, args);
    va_end(args);
    if (n > 0) text->n += (size_t)n < sizeof text->bytes - text->n ? (size_t)n : sizeof text->bytes - text->n - 1;
}

static void add_latency(text_t *text, const char *name, const oc_latency_t *latency)
{
    add(text, "\"%s\":{\"n\":%" PRIu64 ",\"p50_us\":%" PRId64 ",\"p99_us\":%" PRId64 ",\"max_us\":%" PRId64 "},", name,
        latency->n, oc_latency_percentile_us(latency, 0.5), oc_latency_percentile_us(latency, 0.99), latency->max_us);
}

static void make_text(text_t *text, const oc_status_report_t *report)
{
    const oc_vehicle_status_t *status = report->status;
    add(text, "{\"program\":\"outcropd\",\"version\":\"%s\",\"pid\":%d,\"vehicle\":%u,", OUTCROP_VERSION, (int)getpid(),
        report->vehicle);
    add(text, "\"utime\":%" PRId64 ",\"uptime_s\":%" PRIu32 ",\"views\":%u,", report->utime_us, status->uptime_s,
        status->n_views);
    if (status->n_views > 0) add(text, "\"newest_view\":%u,", status->newest_view);
    add(text, "\"source_done\":%s,\"bytes_sent\":%" PRIu64 ",\"frame_thread_cpu_us\":%" PRId64 ",",
        status->is_source_done ? "true" : "false", report->bytes_sent, report->frame_cpu_us);
    add(text, "\"latency\":{");
    add_latency(text, "frame", report->frame);
    add_latency(text, "view", report->view);
    text->n--; /* the last comma */
    add(text, "},\"cameras\":[");
    if (report->capture->describe)
        text->n += report->capture->describe(report->capture, text->bytes + text->n, sizeof text->bytes / 2);
    add(text, "],\"counters\":{");
    for (int i = 0; i < OC_N_COUNTERS; i++)
        add(text, "%s\"%s\":%" PRIu32, i > 0 ? "," : "", oc_counter_name((oc_counter_t)i), status->counters[i]);
    add(text, "}}\n");
}

static bool write_all(int fd, const char *bytes, size_t n)
{
    while (n > 0) {
        const ssize_t written = write(fd, bytes, n);
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) return false;
        bytes += written;
        n -= (size_t)written;
    }
    return true;
}

bool oc_status_file_write(const char *path, const oc_status_report_t *report)
{
    text_t text = {.n = 0};
    make_text(&text, report);
    char beside[600];
    if (snprintf(beside, sizeof beside, "%s.new", path) >= (int)sizeof beside) {
        errno = ENAMETOOLONG;
        return false;
    }
    const int fd = open(beside, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (fd < 0) return false;
    bool is_ok = write_all(fd, text.bytes, text.n);
    is_ok = close(fd) == 0 && is_ok;
    return is_ok && rename(beside, path) == 0;
}

/* ---- reading ---- */

static json_int_t number(const json_t *object, const char *key)
{
    return json_integer_value(json_object_get(object, key));
}

static void print_latency(const json_t *root, const char *key, const char *label)
{
    const json_t *latency = json_object_get(json_object_get(root, "latency"), key);
    if (number(latency, "n") == 0) return;
    printf("%-18s %.1f ms median, %.1f ms p99, %.1f ms longest of %" JSON_INTEGER_FORMAT "\n", label,
           (double)number(latency, "p50_us") * 1e-3, (double)number(latency, "p99_us") * 1e-3,
           (double)number(latency, "max_us") * 1e-3, number(latency, "n"));
}

static void print_camera(const json_t *camera)
{
    const char *error = json_string_value(json_object_get(camera, "error"));
    printf("camera %-11s %s", json_string_value(json_object_get(camera, "name")),
           json_string_value(json_object_get(camera, "state")));
    static const char *const numbers[] = {"frames", "lost", "flagged", "corrupt", "stalls", "opened"};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
        if (json_object_get(camera, numbers[i]))
            printf("%s %" JSON_INTEGER_FORMAT " %s", i == 0 ? ":" : ",", number(camera, numbers[i]), numbers[i]);
    }
    printf("%s%s\n", error && error[0] ? "; " : "", error ? error : "");
}

static void print_counters(const json_t *counters)
{
    const char *name;
    json_t *value;
    json_object_foreach((json_t *)(uintptr_t)counters, name, value)
    {
        if (json_integer_value(value) > 0) printf("%-18s %" JSON_INTEGER_FORMAT "\n", name, json_integer_value(value));
    }
}

static void print_status(const json_t *root, bool is_alive, double age_s)
{
    printf("%-18s %d, vehicle %d, %s, written %.1f s ago\n", "outcropd", (int)number(root, "pid"),
           (int)number(root, "vehicle"), is_alive ? "running" : "NOT RUNNING", age_s);
    const json_int_t up = number(root, "uptime_s");
    printf("%-18s %" JSON_INTEGER_FORMAT " d %02d:%02d:%02d\n", "up", up / 86400, (int)(up / 3600 % 24),
           (int)(up / 60 % 60), (int)(up % 60));
    printf("%-18s %" JSON_INTEGER_FORMAT "\n", "views", number(root, "views"));
    printf("%-18s %" JSON_INTEGER_FORMAT "\n", "bytes sent", number(root, "bytes_sent"));
    print_latency(root, "frame", "frame latency");
    print_latency(root, "view", "view latency");
    size_t i;
    const json_t *camera;
    json_array_foreach(json_object_get(root, "cameras"), i, camera) print_camera(camera);
    print_counters(json_object_get(root, "counters"));
}

int oc_status_file_print(const char *path, bool is_json)
{
    json_error_t fault;
    json_t *root = json_load_file(path, JSON_REJECT_DUPLICATES, &fault);
    const char *program = json_string_value(json_object_get(root, "program"));
    if (!program || strcmp(program, "outcropd") != 0) {
        fprintf(stderr, "outcropd: %s: %s: does outcropd run, and is this its status file?\n", path,
                root ? "not outcropd's" : fault.text);
        json_decref(root);
        return 1;
    }
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    const double age_s = (double)now.tv_sec + (double)now.tv_nsec * 1e-9 - (double)number(root, "utime") * 1e-6;
    const json_int_t pid = number(root, "pid");
    const bool is_there = pid > 0 && (kill((pid_t)pid, 0) == 0 || errno == EPERM);
    const bool is_alive = is_there && age_s < MAX_AGE_S;
    if (is_json) {
        json_dumpf(root, stdout, JSON_INDENT(1));
        putchar('\n');
    } else {
        print_status(root, is_alive, age_s);
    }
    json_decref(root);
    return is_alive ? 0 : 1;
}
