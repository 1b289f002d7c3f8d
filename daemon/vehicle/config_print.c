/* SPDX-License-Identifier: BSD-3-Clause
 * outcropd.yaml's sample file and manual, made from the table of keys. */
#include "config.h"
#include "config_schema.h"

bool oc_config_print_sample(FILE *out)
{
    static const char head[] =
        "# outcropd's configuration: every key with unit, range and default. outcropd --print-config prints this file.\n"
        "# A # with no space behind it holds a key back; without that # the key is at its default, or at an example\n"
        "# where it has none. Either source or cameras with poses are used. Relative paths count from the working\n"
        "# directory. From the project's root:\n"
        "#   build/bin/outcropd --config docs/outcropd.yaml --check\n";
    return oc_yaml_print_sample(&oc_config_form, head, out);
}

static const char manual_head[] =
    ".\\\" SPDX-License-Identifier: BSD-3-Clause\n"
    ".Dd November 25, 2026\n"
    ".Dt OUTCROPD.YAML 5\n"
    ".Os Outcrop\n"
    ".Sh NAME\n"
    ".Nm outcropd.yaml\n"
    ".Nd configuration of outcropd\n"
    ".Sh DESCRIPTION\n"
    "A YAML file that\n"
    ".Xr outcropd 8\n"
    "is given with\n"
    ".Fl -config .\n"
    "It holds one document of at most 256 kB, a mapping; aliases are refused.\n"
    "Each section may hold only the keys below, each of them once.\n"
    "Numbers are decimal, without leading zeros; truth values are the words true and false.\n"
    "Sections whose keys are all optional may be left empty.\n"
    ".Pp\n"
    "All faults of a file are told together, a line each, in the order of its lines:\n"
    ".Pp\n"
    ".Dl outcropd: FILE:LINE: key: what is wrong\n"
    ".Pp\n"
    "Calibration files that the configuration names are read with it, and their faults are told with its own.\n"
    "Relative paths count from the working directory.\n"
    "Frames come either from a site folder, section\n"
    ".Cm source ,\n"
    "or from\n"
    ".Cm cameras\n"
    "together with\n"
    ".Cm poses .\n"
    ".Pp\n"
    "A sample with every key is printed by\n"
    ".Ic outcropd --print-config .\n"
    ".Sh KEYS\n"
    "Names are written with their sections;\n"
    ".Cm cameras[]\n"
    "stands for each item of the list.\n";

static const char manual_tail[] = ".Sh EXAMPLES\n"
                                  "The least that a vehicle with one camera needs:\n"
                                  ".Bd -literal -offset indent\n"
                                  "link:\n"
                                  "  down_url: \"udpm://239.255.76.67:7667?ttl=1\"\n"
                                  "  up_url: \"udpm://239.255.76.68:7668?ttl=1\"\n"
                                  "cameras:\n"
                                  "  - name: front\n"
                                  "    device: /dev/v4l/by-id/usb-Example_Camera-video-index0\n"
                                  "    calibration: /etc/outcrop/front.yaml\n"
                                  "    mount: {x_m: 0.4, y_m: 0, z_m: 0.6, roll_deg: 0, pitch_deg: 20, yaw_deg: 0}\n"
                                  "poses:\n"
                                  "  url: \"udpm://239.255.76.70:7670?ttl=0\"\n"
                                  ".Ed\n"
                                  ".Sh SEE ALSO\n"
                                  ".Xr outcrop-base 8 ,\n"
                                  ".Xr outcropd 8\n";

bool oc_config_print_manual(FILE *out)
{
    fputs(manual_head, out);
    const bool is_ok = oc_yaml_print_manual(&oc_config_form, out);
    fputs(manual_tail, out);
    return is_ok && fflush(out) == 0 && !ferror(out);
}
