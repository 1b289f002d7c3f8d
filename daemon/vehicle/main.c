/* SPDX-License-Identifier: BSD-3-Clause
 * outcropd: the vehicle's end of Outcrop. */
#include <getopt.h>
#include <stdio.h>
#include <string.h>

#include "config.h"
#include "run.h"

static void print_help(void)
{
    puts("Usage: outcropd --config FILE [--check]\n"
         "       outcropd --print-config\n"
         "\n"
         "The vehicle's end: finds junctions in frames, drops those on the ground,\n"
         "sends packets over LCM and answers the base's requests until SIGTERM.\n"
         "\n"
         "  -c, --config FILE  YAML configuration\n"
         "      --check        check the configuration and the source, then exit\n"
         "      --print-config print a sample configuration: every key with unit, range, default\n"
         "  -h, --help         this text\n"
         "  -V, --version      version\n"
         "\n"
         "Exit status: 0 ended by a signal or checked well, 1 failed, 2 wrong usage.");
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
    oc_margin_t margin;
    oc_capture_t *capture =
        oc_capture_open_site(config.site, &config.site_option, &config.margin, &margin, error, sizeof error);
    if (!capture) {
        fprintf(stderr, "outcropd: %s\n", error);
        return 1;
    }
    printf("outcropd: %u frames of at most %ux%u, margins %.4g m and %.4g deg\n", capture->n_frames,
           capture->max_width_px, capture->max_height_px, margin.v[0], margin.v[3] * 57.29577951308232);
    fflush(stdout);
    bool is_ok = true;
    if (!is_check) is_ok = oc_run(&config, capture, error, sizeof error);
    if (!is_ok) fprintf(stderr, "outcropd: %s\n", error);
    capture->close(capture);
    return is_ok ? 0 : 1;
}

int main(int argc, char **argv)
{
    enum { CHECK = 256, PRINT_CONFIG };
    static const struct option options[] = {{"config", required_argument, NULL, 'c'},
                                            {"check", no_argument, NULL, CHECK},
                                            {"print-config", no_argument, NULL, PRINT_CONFIG},
                                            {"help", no_argument, NULL, 'h'},
                                            {"version", no_argument, NULL, 'V'},
                                            {NULL, 0, NULL, 0}};
    const char *config = NULL;
    bool is_check = false;
    for (int option; (option = getopt_long(argc, argv, "c:hV", options, NULL)) != -1;) {
        switch (option) {
        case 'c': config = optarg; break;
        case CHECK: is_check = true; break;
        case PRINT_CONFIG: return oc_config_print_sample(stdout) ? 0 : 1;
        case 'h': print_help(); return 0;
        case 'V': puts("outcropd " OUTCROP_VERSION); return 0;
        default: fputs("Try outcropd --help.\n", stderr); return 2;
        }
    }
    if (optind < argc || !config) {
        fprintf(stderr, "outcropd: %s; try outcropd --help\n",
                config ? "unexpected argument" : "--config FILE is missing");
        return 2;
    }
    return serve(config, is_check);
}
