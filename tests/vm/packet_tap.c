/* SPDX-License-Identifier: BSD-3-Clause
 * packet_tap DOWN_URL: one line for each packet that leaves the vehicle.
 *
 *   view ID camera I part P last 0|1 junctions N utime T centre X Y Z
 *   announce ID
 *   status views N
 *   other TYPE
 *   bad */
#include <inttypes.h>
#include <stdio.h>

#include "core/packet.h"
#include "link_lcm.h"

static void print_view(const uint8_t *bytes, size_t n_bytes)
{
    static oc_view_part_t part;
    if (oc_packet_decode_view(bytes, n_bytes, &part) != OC_OK) {
        puts("bad");
        return;
    }
    double centre[3];
    oc_pose_centre(&part.head.camera.pose, centre);
    printf("view %u camera %u part %u last %d junctions %u utime %" PRId64 " centre %.4f %.4f %.4f\n", part.head.view,
           part.head.camera_index, part.head.part, part.head.is_last, part.n_junctions, part.head.utime_us, centre[0],
           centre[1], centre[2]);
}

static void print_packet(void *user, const uint8_t *bytes, size_t n_bytes)
{
    (void)user;
    oc_packet_head_t head;
    oc_announce_t announce;
    oc_vehicle_status_t status;
    if (oc_packet_decode_head(bytes, n_bytes, &head) != OC_OK) {
        puts("bad");
    } else if (head.type == OC_PACKET_VIEW) {
        print_view(bytes, n_bytes);
    } else if (head.type == OC_PACKET_ANNOUNCE && oc_packet_decode_announce(bytes, n_bytes, &announce) == OC_OK) {
        printf("announce %u\n", announce.view);
    } else if (head.type == OC_PACKET_STATUS && oc_packet_decode_status(bytes, n_bytes, &status) == OC_OK) {
        printf("status views %u\n", status.n_views);
    } else {
        printf("other %u\n", head.type);
    }
}

int main(int argc, char **argv)
{
    if (argc != 2) {
        fputs("usage: packet_tap DOWN_URL\n", stderr);
        return 2;
    }
    setvbuf(stdout, NULL, _IOLBF, 0);
    char error[256];
    oc_link_t *link =
        oc_link_open("memq://", OC_CHANNEL_UP, argv[1], OC_CHANNEL_DOWN, print_packet, NULL, error, sizeof error);
    if (!link) {
        fprintf(stderr, "packet_tap: %s\n", error);
        return 1;
    }
    puts("ready");
    while (oc_link_handle(link, 1000) >= 0) continue;
    oc_link_close(link);
    return 1;
}
