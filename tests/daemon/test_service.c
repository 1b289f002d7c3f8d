/* SPDX-License-Identifier: BSD-3-Clause
 * The service manager is played by a socket; signs of life must not cost a call of the heap. */
#include "unity.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "allocation_guard.h"
#include "service.h"

static int manager = -1;
static char heard[512];

void setUp(void)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    snprintf(address.sun_path, sizeof address.sun_path, "/tmp/outcrop-notify-%d", (int)getpid());
    unlink(address.sun_path);
    manager = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    TEST_ASSERT_EQUAL(0, bind(manager, (const struct sockaddr *)&address, sizeof address));
    setenv("NOTIFY_SOCKET", address.sun_path, 1);
}

void tearDown(void)
{
    unlink(getenv("NOTIFY_SOCKET") ? getenv("NOTIFY_SOCKET") : "");
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    unsetenv("WATCHDOG_PID");
    close(manager);
}

static void hear(void)
{
    const ssize_t n = recv(manager, heard, sizeof heard - 1, 0);
    heard[n > 0 ? n : 0] = '\0';
}

static void the_manager_hears_each_state(void)
{
    oc_service_ready("running");
    hear();
    TEST_ASSERT_EQUAL_STRING("READY=1\nSTATUS=running", heard);
    oc_service_stopping();
    hear();
    TEST_ASSERT_EQUAL_STRING("STOPPING=1", heard);
}

static void signs_of_life_and_status_leave_the_heap_alone(void)
{
    static char long_status[600];
    memset(long_status, 'x', sizeof long_status - 1);
    guard_is_armed = true;
    oc_service_alive();
    oc_service_status("12 views");
    oc_service_status(long_status);
    guard_is_armed = false;
    hear();
    TEST_ASSERT_EQUAL_STRING("WATCHDOG=1", heard);
    hear();
    TEST_ASSERT_EQUAL_STRING("STATUS=12 views", heard);
    hear();
    TEST_ASSERT_EQUAL(255, strlen(heard)); /* cut, not lost */
}

static void nobody_listens_and_nothing_happens(void)
{
    unlink(getenv("NOTIFY_SOCKET"));
    oc_service_ready("running"); /* a socket that has gone */
    oc_service_alive();
    unsetenv("NOTIFY_SOCKET");
    oc_service_ready("running");
    oc_service_alive();
    oc_service_status("idle");
    oc_service_stopping();
    hear();
    TEST_ASSERT_EQUAL_STRING("", heard);
}

static void the_watchdogs_limit_is_halved(void)
{
    TEST_ASSERT_EQUAL_INT64(0, oc_service_watchdog_ns());
    setenv("WATCHDOG_USEC", "3000000", 1);
    TEST_ASSERT_EQUAL_INT64(1500000000, oc_service_watchdog_ns());
    setenv("WATCHDOG_PID", "1", 1); /* meant for somebody else */
    TEST_ASSERT_EQUAL_INT64(0, oc_service_watchdog_ns());
    unsetenv("WATCHDOG_PID");
    setenv("WATCHDOG_USEC", "soon", 1);
    TEST_ASSERT_EQUAL_INT64(0, oc_service_watchdog_ns());
}

int main(void)
{
    guard_install();
    UNITY_BEGIN();
    RUN_TEST(the_manager_hears_each_state);
    RUN_TEST(signs_of_life_and_status_leave_the_heap_alone);
    RUN_TEST(nobody_listens_and_nothing_happens);
    RUN_TEST(the_watchdogs_limit_is_halved);
    return UNITY_END();
}
