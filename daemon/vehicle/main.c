/* SPDX-License-Identifier: BSD-3-Clause
 * outcropd: the vehicle's end of Outcrop. */
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calibration.h"
#include "config.h"
#include "run.h"
#include "status_file.h"

static void print_help(void)
{
    puts("Usage: outcropd --config FILE [--check]\n"
         "       outcropd --status [--file FILE] [--json]\n"
         "       outcropd --print-camera FILE [--form ros|opencv]\n"
         "       outcropd --print-config\n"
         "\n"
         "The vehicle's end: finds junctions in frames, drops those on the ground,\n"
         "sends packets over LCM and answers the base's requests until SIGTERM.\n"
         "\n"
         "  -c, --config FILE        YAML configuration; keys in outcropd.yaml(5)\n"
         "      --check              tell all faults of the configuration, then exit\n"
         "      --status             tell what a running outcropd does and has dropped\n"
         "      --file FILE          its status file (default " OC_STATUS_FILE ")\n"
         "      --json               as JSON\n"
         "      --print-camera FILE  read a calibration file and write it in one form\n"
         "      --form ros|opencv    ROS camera_info (default) or OpenCV FileStorage\n"
         "      --print-config       a sample configuration with every key\n"
         "  -h, --help               this text\n"
         "  -V, --version            version\n"
         "\n"
         "SIGUSR1 is a mark: the next frame of every camera becomes a view, and held\n"
         "views of the last seconds are sent. SIGHUP is ignored.\n"
         "\n"
         "Exit status: 0 ended by a signal, checked well, or running (--status);\n"
         "1 failed; 2 wrong usage.");
}

static void print_fault(void *user, const char *line)
{
    (void)user;
    fprintf(stderr, "outcropd: %s\n", line);
}

static int serve(const char *path, bool is_check)
{
    static oc_config_t config;
    char error[1024];
    if (!oc_config_load(path, &config, print_fault, NULL)) return 1;
    const bool is_ok = is_check ? oc_run_check(&config, error, sizeof error) : oc_run(&config, error, sizeof error);
    if (!is_ok) fprintf(stderr, "outcropd: %s\n", error);
    return is_ok ? 0 : 1;
}

static int print_camera(const char *path, const char *form)
{
    oc_calibration_t calibration;
    char error[1024];
    if (!oc_calibration_read(path, &calibration, error, sizeof error)) {
        fprintf(stderr, "outcropd: %s\n", error);
        return 1;
    }
    const bool is_opencv = strcmp(form, "opencv") == 0;
    return oc_calibration_write(stdout, &calibration, is_opencv ? OC_CALIBRATION_OPENCV : OC_CALIBRATION_ROS) ? 0 : 1;
}

static int wrong_usage(const char *what)
{
    fprintf(stderr, "outcropd: %s; try outcropd --help\n", what);
    return 2;
}

typedef struct arguments {
    const char *config, *camera, *form, *file;
    bool is_check, is_status, is_json, is_sample;
} arguments_t;

/* One thing is asked for, with options of its own only. */
static const char *arguments_fault(const arguments_t *a)
{
    const int n_asked = (a->config != NULL) + a->is_status + (a->camera != NULL) + a->is_sample;
    if (n_asked == 0) return "--config FILE is missing";
    if (n_asked > 1) return "--config, --status, --print-camera and --print-config exclude one another";
    if (a->is_check && !a->config) return "--check needs --config FILE";
    if ((a->is_json || a->file) && !a->is_status) return "--json and --file belong to --status";
    if (a->form && !a->camera) return "--form belongs to --print-camera";
    if (a->form && strcmp(a->form, "ros") != 0 && strcmp(a->form, "opencv") != 0) return "--form is ros or opencv";
    return NULL;
}

int main(int argc, char **argv)
{
    enum { CHECK = 256, STATUS, STATUS_FILE, JSON, CAMERA, FORM, SAMPLE };
    static const struct option options[] = {{"config", required_argument, NULL, 'c'},
                                            {"check", no_argument, NULL, CHECK},
                                            {"status", no_argument, NULL, STATUS},
                                            {"file", required_argument, NULL, STATUS_FILE},
                                            {"json", no_argument, NULL, JSON},
                                            {"print-camera", required_argument, NULL, CAMERA},
                                            {"form", required_argument, NULL, FORM},
                                            {"print-config", no_argument, NULL, SAMPLE},
                                            {"help", no_argument, NULL, 'h'},
                                            {"version", no_argument, NULL, 'V'},
                                            {NULL, 0, NULL, 0}};
    arguments_t a = {NULL, NULL, NULL, NULL, false, false, false, false};
    for (int option; (option = getopt_long(argc, argv, "c:hV", options, NULL)) != -1;) {
        switch (option) {
        case 'c': a.config = optarg; break;
        case CHECK: a.is_check = true; break;
        case STATUS: a.is_status = true; break;
        case STATUS_FILE: a.file = optarg; break;
        case JSON: a.is_json = true; break;
        case CAMERA: a.camera = optarg; break;
        case FORM: a.form = optarg; break;
        case SAMPLE: a.is_sample = true; break;
        case 'h': print_help(); return 0;
        case 'V': puts("outcropd " OUTCROP_VERSION); return 0;
        default: fputs("Try outcropd --help.\n", stderr); return 2;
        }
    }
    if (optind < argc) return wrong_usage("unexpected argument");
    const char *fault = arguments_fault(&a);
    if (fault) return wrong_usage(fault);
    if (a.is_status) return oc_status_file_print(a.file ? a.file : OC_STATUS_FILE, a.is_json);
    if (a.camera) return print_camera(a.camera, a.form ? a.form : "ros");
    if (a.is_sample) return oc_config_print_sample(stdout) ? 0 : 1;
    return serve(a.config, a.is_check);
}
