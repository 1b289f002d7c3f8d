/* SPDX-License-Identifier: BSD-3-Clause
 * What the test's USB camera says of itself: UVC 1.0, 640 x 480, YUY2 and
 * MJPEG at 30, 15 or 5 Hz, over a bulk endpoint. */
#ifndef OUTCROP_VM_UVC_DESCRIPTORS_H
#define OUTCROP_VM_UVC_DESCRIPTORS_H

#include <stdint.h>

#define UVC_WIDTH_PX 640
#define UVC_HEIGHT_PX 480
#define UVC_FRAME_BYTES (UVC_WIDTH_PX * UVC_HEIGHT_PX * 2)
#define UVC_FORMAT_YUYV 1
#define UVC_FORMAT_MJPG 2

/* Frame intervals, units of 100 ns. */
#define UVC_INTERVAL_30_HZ 333333u
#define UVC_INTERVAL_15_HZ 666666u
#define UVC_INTERVAL_5_HZ 2000000u

/* Little endian, as descriptors are. */
#define UVC_U16(x) (uint8_t)((x)&0xffu), (uint8_t)((x) >> 8 & 0xffu)
#define UVC_U32(x) UVC_U16((uint32_t)(x)), UVC_U16((uint32_t)(x) >> 16)

#define UVC_BULK_IN 0x81
#define UVC_CLASS_INTERFACE 0x24
#define UVC_CONTROL_BYTES (13 + 18 + 9)
#define UVC_STREAM_BYTES (15 + 27 + 38 + 6 + 11 + 38 + 6)
#define UVC_CONFIG_BYTES (9 + 8 + 9 + UVC_CONTROL_BYTES + 9 + UVC_STREAM_BYTES + 7)

#define UVC_ENDPOINT(max_packet_bytes) 7, 5, UVC_BULK_IN, 2, UVC_U16(max_packet_bytes), 0

/* One frame descriptor: its subtype, the bits and bytes of a frame at most. */
#define UVC_FRAME(subtype, max_bytes)                                                                                  \
    38, UVC_CLASS_INTERFACE, subtype, 1, 0, UVC_U16(UVC_WIDTH_PX), UVC_U16(UVC_HEIGHT_PX),                             \
        UVC_U32((max_bytes)*8u * 5u), UVC_U32((max_bytes)*8u * 30u), UVC_U32(max_bytes), UVC_U32(UVC_INTERVAL_30_HZ),  \
        3, UVC_U32(UVC_INTERVAL_30_HZ), UVC_U32(UVC_INTERVAL_15_HZ), UVC_U32(UVC_INTERVAL_5_HZ)
#define UVC_COLOUR 6, UVC_CLASS_INTERFACE, 0x0d, 1, 1, 4

/* clang-format off */
#define UVC_CONFIGURATION(max_packet_bytes) {                                                                           \
    9, 2, UVC_U16(UVC_CONFIG_BYTES), 2, 1, 0, 0xc0, 50,                                                                 \
    8, 11, 0, 2, 0x0e, 3, 0, 0,                                                          /* association */              \
    9, 4, 0, 0, 0, 0x0e, 1, 0, 0,                                                        /* control interface */        \
    13, UVC_CLASS_INTERFACE, 1, UVC_U16(0x0100u), UVC_U16(UVC_CONTROL_BYTES), UVC_U32(48000000u), 1, 1,                 \
    18, UVC_CLASS_INTERFACE, 2, 1, UVC_U16(0x0201u), 0, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0, /* camera terminal */          \
    9, UVC_CLASS_INTERFACE, 3, 3, UVC_U16(0x0101u), 0, 1, 0,                             /* output terminal */          \
    9, 4, 1, 0, 1, 0x0e, 2, 0, 0,                                                        /* streaming interface */      \
    15, UVC_CLASS_INTERFACE, 1, 2, UVC_U16(UVC_STREAM_BYTES), UVC_BULK_IN, 0, 3, 0, 0, 0, 1, 0, 0,                      \
    27, UVC_CLASS_INTERFACE, 4, UVC_FORMAT_YUYV, 1,                                                                     \
        'Y', 'U', 'Y', '2', 0, 0, 0x10, 0, 0x80, 0, 0, 0xaa, 0, 0x38, 0x9b, 0x71, 16, 1, 0, 0, 0, 0,                    \
    UVC_FRAME(5, UVC_FRAME_BYTES), UVC_COLOUR,                                                                          \
    11, UVC_CLASS_INTERFACE, 6, UVC_FORMAT_MJPG, 1, 1, 1, 0, 0, 0, 0,                                                   \
    UVC_FRAME(7, UVC_FRAME_BYTES / 2), UVC_COLOUR,                                                                      \
    UVC_ENDPOINT(max_packet_bytes) }
/* clang-format on */

static const uint8_t uvc_config_full_speed[] = UVC_CONFIGURATION(64u);
static const uint8_t uvc_config_high_speed[] = UVC_CONFIGURATION(512u);
_Static_assert(sizeof uvc_config_high_speed == UVC_CONFIG_BYTES, "the lengths inside the descriptors");

static const uint8_t uvc_device[18] = {
    18, 1, UVC_U16(0x0200u), 0xef, 2, 1, 64, UVC_U16(0x1d6bu), UVC_U16(0x0102u), UVC_U16(0x0100u), 1, 2, 3, 1};

/* Strings 1 to 3: by them /dev/v4l/by-id names the camera. */
static const char *const uvc_strings[] = {"Outcrop", "Test camera", "0001"};

#endif
