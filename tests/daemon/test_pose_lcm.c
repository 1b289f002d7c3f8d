/* SPDX-License-Identifier: BSD-3-Clause
 * Poses as messages: both types, what is none of them, every damaged byte, and the listener in a network of its own. */
#include "unity.h"

#include <arpa/inet.h>
#include <lcm/lcm.h>
#include <net/if.h>
#include <net/route.h>
#include <poll.h>
#include <sched.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "bot_core_pose_t.h"
#include "counters.h"
#include "outcrop_pose_t.h"
#include "pose_lcm.h"
#include "thesis_tables.h"

#define URL "udpm://239.255.76.70:7670?ttl=0"
#define MAX_MESSAGE 1024

static oc_test_random_t random_numbers;
static bool has_network;

void setUp(void)
{
    random_numbers = oc_test_random_from(77);
}

void tearDown(void) {}

static outcrop_pose_t any_outcrop(void)
{
    outcrop_pose_t message = {.utime = 1764057600123456, .orientation = {1, 0, 0, 0}, .has_covariance = 1};
    for (int i = 0; i < 3; i++) message.position[i] = oc_test_uniform(&random_numbers, -100, 100);
    for (int i = 0; i < 6; i++) message.covariance[7 * i] = oc_test_uniform(&random_numbers, 0.5, 1);
    message.covariance[1] = message.covariance[6] = -0.25;
    return message;
}

static bot_core_pose_t any_bot_core(void)
{
    bot_core_pose_t message = {.utime = 1764057600123456};
    double norm = 0;
    for (int i = 0; i < 4; i++) {
        message.orientation[i] = oc_test_normal(&random_numbers);
        norm += message.orientation[i] * message.orientation[i];
    }
    for (int i = 0; i < 4; i++) message.orientation[i] /= sqrt(norm);
    for (int i = 0; i < 3; i++) {
        message.pos[i] = oc_test_uniform(&random_numbers, -100, 100);
        message.vel[i] = message.rotation_rate[i] = message.accel[i] = 5;
    }
    return message;
}

static size_t encode_outcrop(const outcrop_pose_t *message, uint8_t bytes[MAX_MESSAGE])
{
    const int n = outcrop_pose_t_encode(bytes, 0, MAX_MESSAGE, message);
    TEST_ASSERT_TRUE(n > 0);
    return (size_t)n;
}

static size_t encode_bot_core(const bot_core_pose_t *message, uint8_t bytes[MAX_MESSAGE])
{
    const int n = bot_core_pose_t_encode(bytes, 0, MAX_MESSAGE, message);
    TEST_ASSERT_TRUE(n > 0);
    return (size_t)n;
}

static size_t encode_any(oc_pose_type_t type, uint8_t bytes[MAX_MESSAGE])
{
    const outcrop_pose_t ours = any_outcrop();
    const bot_core_pose_t theirs = any_bot_core();
    return type == OC_POSE_OUTCROP ? encode_outcrop(&ours, bytes) : encode_bot_core(&theirs, bytes);
}

/* From a piece of its own, so that a sanitizer sees a read past its end. */
static bool decode(oc_pose_type_t type, const uint8_t *bytes, size_t n, oc_body_pose_t *pose)
{
    uint8_t *piece = malloc(n ? n : 1);
    TEST_ASSERT_NOT_NULL(piece);
    memcpy(piece, bytes, n);
    const bool is_decoded = oc_pose_decode(type, piece, n, pose);
    free(piece);
    return is_decoded;
}

/* ---- decoding ---- */

static void our_own_pose_comes_through_to_the_bit(void)
{
    for (int has = 0; has < 2; has++) {
        uint8_t bytes[MAX_MESSAGE];
        oc_body_pose_t pose;
        outcrop_pose_t message = any_outcrop();
        message.has_covariance = (int8_t)has;
        message.orientation[0] = 0.5;
        message.orientation[1] = -0.5;
        message.orientation[2] = 0.5;
        message.orientation[3] = -0.5;
        TEST_ASSERT_TRUE(decode(OC_POSE_OUTCROP, bytes, encode_outcrop(&message, bytes), &pose));
        TEST_ASSERT_EQUAL_INT64(message.utime, pose.utime_us);
        TEST_ASSERT_EQUAL_MEMORY(message.position, pose.position_m, sizeof pose.position_m);
        TEST_ASSERT_EQUAL_MEMORY(message.orientation, pose.q_wxyz, sizeof pose.q_wxyz);
        TEST_ASSERT_EQUAL(has == 1, pose.has_covariance);
        TEST_ASSERT_EQUAL_MEMORY(message.covariance, pose.covariance, sizeof pose.covariance);
    }
}

static void check_axes(const oc_body_pose_t *pose, const double forward[3], const double left[3], const double up[3])
{
    double R[9];
    TEST_ASSERT_EQUAL(OC_OK, oc_rotation_from_quat(pose->q_wxyz, R));
    for (int i = 0; i < 3; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, forward[i], R[3 * i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, left[i], R[3 * i + 1]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, up[i], R[3 * i + 2]);
    }
}

static void the_z_down_body_is_turned_over(void)
{
    const double h = 0.70710678118654752, c15 = 0.96592582628906829, s15 = 0.25881904510252076,
                 c30 = 0.86602540378443865;
    const struct {
        double q[4], forward[3], left[3], up[3];
    } cases[] = {
        {{0, 1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},              /* level, to the east */
        {{0, h, h, 0}, {0, 1, 0}, {-1, 0, 0}, {0, 0, 1}},             /* level, to the north */
        {{0, 0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}},            /* level, to the west */
        {{1, 0, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 0, -1}},            /* its z is the world's: upside down */
        {{0, c15, 0, s15}, {c30, 0, 0.5}, {0, 1, 0}, {-0.5, 0, c30}}, /* to the east, nose up by 30 degrees */
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        uint8_t bytes[MAX_MESSAGE];
        oc_body_pose_t pose;
        bot_core_pose_t message = {.utime = 99, .pos = {1, 2, 3}};
        memcpy(message.orientation, cases[i].q, sizeof message.orientation);
        TEST_ASSERT_TRUE(decode(OC_POSE_BOT_CORE, bytes, encode_bot_core(&message, bytes), &pose));
        check_axes(&pose, cases[i].forward, cases[i].left, cases[i].up);
        TEST_ASSERT_EQUAL_INT64(99, pose.utime_us);
        TEST_ASSERT_EQUAL_MEMORY(message.pos, pose.position_m, sizeof pose.position_m);
        TEST_ASSERT_FALSE(pose.has_covariance);
    }
    for (int draw = 0; draw < 500; draw++) {
        uint8_t bytes[MAX_MESSAGE];
        oc_body_pose_t pose;
        double R[9];
        const bot_core_pose_t message = any_bot_core();
        TEST_ASSERT_TRUE(decode(OC_POSE_BOT_CORE, bytes, encode_bot_core(&message, bytes), &pose));
        TEST_ASSERT_EQUAL(OC_OK, oc_rotation_from_quat(message.orientation, R));
        check_axes(&pose, (const double[3]){R[0], R[3], R[6]}, (const double[3]){-R[1], -R[4], -R[7]},
                   (const double[3]){-R[2], -R[5], -R[8]});
    }
}

/* As bot_core's own publishers have it: the hash of its fields, turned left by one bit. */
static void bot_core_has_its_published_fingerprint(void)
{
    static const uint8_t published[8] = {0x2e, 0x16, 0xef, 0xb0, 0x52, 0xb0, 0x10, 0x5e};
    const uint64_t fields = 0x170b77d82958082fu, turned = fields << 1 | fields >> 63;
    uint8_t bytes[MAX_MESSAGE];
    const size_t n = encode_any(OC_POSE_BOT_CORE, bytes);
    TEST_ASSERT_EQUAL(8 + 8 + 8 * 16, n);
    TEST_ASSERT_EQUAL_MEMORY(published, bytes, 8);
    for (int i = 0; i < 8; i++) TEST_ASSERT_EQUAL_HEX8(turned >> (56 - 8 * i) & 0xffu, bytes[i]);
}

static void what_is_cut_or_too_long_or_of_another_type_is_refused(void)
{
    for (int type = 0; type < 2; type++) {
        const oc_pose_type_t own = type == 0 ? OC_POSE_OUTCROP : OC_POSE_BOT_CORE;
        uint8_t bytes[MAX_MESSAGE] = {0};
        oc_body_pose_t pose;
        const size_t n = encode_any(own, bytes);
        TEST_ASSERT_TRUE(decode(own, bytes, n, &pose));
        TEST_ASSERT_FALSE(decode(own == OC_POSE_OUTCROP ? OC_POSE_BOT_CORE : OC_POSE_OUTCROP, bytes, n, &pose));
        for (size_t cut = 0; cut < MAX_MESSAGE; cut++) TEST_ASSERT_EQUAL(cut == n, decode(own, bytes, cut, &pose));
        uint8_t *large = calloc(1, 1u << 20);
        TEST_ASSERT_NOT_NULL(large);
        memcpy(large, bytes, n);
        TEST_ASSERT_FALSE(oc_pose_decode(own, large, 1u << 20, &pose));
        TEST_ASSERT_FALSE(oc_pose_decode(own, large, SIZE_MAX, &pose)); /* not read, as it is too long */
        TEST_ASSERT_FALSE(oc_pose_decode(own, large, ((size_t)1 << 32) + n, &pose));
        free(large);
    }
}

static void no_damaged_byte_hurts(void)
{
    for (int type = 0; type < 2; type++) {
        const oc_pose_type_t own = type == 0 ? OC_POSE_OUTCROP : OC_POSE_BOT_CORE;
        uint8_t bytes[MAX_MESSAGE];
        const size_t n = encode_any(own, bytes);
        uint32_t n_refused = 0, n_taken = 0;
        for (size_t i = 0; i < n; i++) {
            oc_pose_track_t *track = oc_pose_track_create(4, 1000000);
            TEST_ASSERT_NOT_NULL(track);
            for (int value = 0; value < 256; value++) {
                oc_body_pose_t pose;
                const uint8_t right = bytes[i];
                bytes[i] = (uint8_t)value;
                const bool is_decoded = decode(own, bytes, n, &pose);
                TEST_ASSERT_EQUAL(i >= 8 || value == right, is_decoded);
                const oc_status_t status = is_decoded ? oc_pose_track_add(track, &pose) : OC_E_FORMAT;
                n_refused += status == OC_E_ARG;
                n_taken += status == OC_OK;
                if (status == OC_OK) TEST_ASSERT_EQUAL(OC_POSE_OK, oc_pose_track_at(track, pose.utime_us, &pose));
                bytes[i] = right;
            }
            oc_pose_track_destroy(track);
        }
        TEST_ASSERT_TRUE(n_refused > 100 && n_taken > 100);
    }
}

static void random_bytes_are_no_pose(void)
{
    uint8_t bytes[MAX_MESSAGE];
    for (int draw = 0; draw < 20000; draw++) {
        oc_body_pose_t pose;
        const size_t n = encode_any(OC_POSE_OUTCROP, bytes);
        for (size_t i = draw % 2 ? 8 : 0; i < n; i++) bytes[i] = (uint8_t)oc_test_uniform(&random_numbers, 0, 256);
        TEST_ASSERT_EQUAL(draw % 2 == 1, decode(OC_POSE_OUTCROP, bytes, n, &pose));
        if (draw % 2 == 0) continue;
        oc_pose_track_t *track = oc_pose_track_create(2, 1);
        TEST_ASSERT_EQUAL(OC_E_ARG, oc_pose_track_add(track, &pose)); /* no unit quaternion, nearly surely */
        oc_pose_track_destroy(track);
    }
}

/* ---- the listener ---- */

static bool bring_up_loopback(int fd)
{
    struct ifreq interface = {.ifr_flags = IFF_UP | IFF_RUNNING};
    memcpy(interface.ifr_name, "lo", 3);
    if (ioctl(fd, SIOCSIFFLAGS, &interface) != 0) return false;
    char name[] = "lo";
    struct rtentry route = {.rt_flags = RTF_UP, .rt_dev = name};
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr = {htonl(0xef000000u)}}; /* 239.0.0.0/8 */
    memcpy(&route.rt_dst, &address, sizeof address);
    address.sin_addr.s_addr = htonl(0xff000000u);
    memcpy(&route.rt_genmask, &address, sizeof address);
    return ioctl(fd, SIOCADDRT, &route) == 0;
}

/* A network that nobody else hears; before any thread is there. */
static bool enter_own_network(void)
{
    if (unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const bool is_up = fd >= 0 && bring_up_loopback(fd);
    if (fd >= 0) close(fd);
    return is_up;
}

static void await_count(oc_pose_listener_t *listener, const oc_counters_t *counters, oc_counter_t counter, uint32_t n)
{
    while (oc_counters_get(counters, counter) < n) {
        struct pollfd fd = {oc_pose_listener_fd(listener), POLLIN, 0};
        TEST_ASSERT_EQUAL_MESSAGE(1, poll(&fd, 1, 60000), "no message has come");
        TEST_ASSERT_TRUE(oc_pose_listener_handle(listener));
    }
    TEST_ASSERT_EQUAL(n, oc_counters_get(counters, counter));
}

static void publish_all(lcm_t *lcm, oc_pose_listener_t *listener, const oc_counters_t *counters)
{
    uint8_t bytes[MAX_MESSAGE] = {0};
    outcrop_pose_t message = any_outcrop();
    TEST_ASSERT_EQUAL(0, outcrop_pose_t_publish(lcm, "POSES", &message));
    await_count(listener, counters, OC_COUNT_POSES_IN, 1);
    TEST_ASSERT_EQUAL(0, outcrop_pose_t_publish(lcm, "POSES", &message)); /* not newer */
    await_count(listener, counters, OC_COUNT_POSES_LATE, 1);
    TEST_ASSERT_EQUAL(0, lcm_publish(lcm, "POSES", bytes, 20)); /* of no type */
    await_count(listener, counters, OC_COUNT_POSES_BAD, 1);
    TEST_ASSERT_EQUAL(0, lcm_publish(lcm, "POSES", bytes, 0));
    await_count(listener, counters, OC_COUNT_POSES_BAD, 2);
    static uint8_t large[100000]; /* in fragments */
    TEST_ASSERT_EQUAL(0, lcm_publish(lcm, "POSES", large, sizeof large));
    await_count(listener, counters, OC_COUNT_POSES_BAD, 3);
    message.utime++;
    message.position[1] = (double)NAN;
    TEST_ASSERT_EQUAL(0, outcrop_pose_t_publish(lcm, "POSES", &message));
    await_count(listener, counters, OC_COUNT_POSES_BAD, 4);
    message.position[1] = 0;
    TEST_ASSERT_EQUAL(0, outcrop_pose_t_publish(lcm, "POSES_TOO", &message)); /* somebody else's */
    for (int i = 0; i < 100; i++) {
        message.utime++;
        TEST_ASSERT_EQUAL(0, outcrop_pose_t_publish(lcm, "POSES", &message));
        await_count(listener, counters, OC_COUNT_POSES_IN, 2u + (uint32_t)i);
    }
    TEST_ASSERT_EQUAL(4, oc_counters_get(counters, OC_COUNT_POSES_BAD));
    TEST_ASSERT_EQUAL(1, oc_counters_get(counters, OC_COUNT_POSES_LATE));
}

static void the_listener_adds_what_it_hears_and_counts_the_rest(void)
{
    if (!has_network) TEST_IGNORE_MESSAGE("no network namespace of our own is allowed here");
    static oc_counters_t counters;
    char error[256] = "";
    oc_pose_track_t *track = oc_pose_track_create(256, 1000000);
    TEST_ASSERT_NOT_NULL(track);
    oc_pose_listener_t *listener =
        oc_pose_listener_open(URL, "POSES", OC_POSE_OUTCROP, track, &counters, error, sizeof error);
    TEST_ASSERT_NOT_NULL_MESSAGE(listener, error);
    lcm_t *lcm = lcm_create(URL);
    TEST_ASSERT_NOT_NULL(lcm);
    publish_all(lcm, listener, &counters);
    TEST_ASSERT_EQUAL_INT64(1764057600123456 + 101, oc_pose_track_newest_us(track));
    lcm_destroy(lcm);
    oc_pose_listener_close(listener);
    oc_pose_track_destroy(track);
}

static void says_in_one_line_what_is_wrong_with_a_url(void)
{
    static const char *const urls[] = {"nonsense", "udpm://1.2.3:7667", "udpm://239.0.0.1:99999?ttl=0"};
    oc_counters_t counters;
    memset(&counters, 0, sizeof counters);
    for (int i = 0; i < 3; i++) {
        char error[256] = "";
        TEST_ASSERT_NULL(oc_pose_listener_open(urls[i], "P", OC_POSE_OUTCROP, NULL, &counters, error, sizeof error));
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error, urls[i]), error);
        TEST_ASSERT_NULL(strchr(error, '\n'));
    }
    oc_pose_listener_close(NULL);
}

int main(void)
{
    has_network = enter_own_network();
    UNITY_BEGIN();
    RUN_TEST(our_own_pose_comes_through_to_the_bit);
    RUN_TEST(the_z_down_body_is_turned_over);
    RUN_TEST(bot_core_has_its_published_fingerprint);
    RUN_TEST(what_is_cut_or_too_long_or_of_another_type_is_refused);
    RUN_TEST(no_damaged_byte_hurts);
    RUN_TEST(random_bytes_are_no_pose);
    RUN_TEST(the_listener_adds_what_it_hears_and_counts_the_rest);
    RUN_TEST(says_in_one_line_what_is_wrong_with_a_url);
    return UNITY_END();
}
