// SPDX-License-Identifier: BSD-3-Clause
// unshare(2), then two ioctls.
#include "private_net.h"

#include <arpa/inet.h>
#include <net/if.h>
#include <net/route.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>

namespace outcrop {
namespace {

[[noreturn]] void refuse(const std::string &what)
{
    throw std::runtime_error("cannot make a private network namespace: " + what + ": " + std::strerror(errno));
}

void write_file(const std::string &path, const std::string &text)
{
    std::ofstream file(path);
    file << text;
    if (!file.flush()) refuse(path);
}

void enter_namespaces()
{
    if (unshare(CLONE_NEWNET) == 0) return;
    const auto uid = std::to_string(getuid()), gid = std::to_string(getgid());
    if (unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) refuse("unshare");
    write_file("/proc/self/setgroups", "deny");
    write_file("/proc/self/uid_map", "0 " + uid + " 1");
    write_file("/proc/self/gid_map", "0 " + gid + " 1");
}

void bring_up_lo(int fd)
{
    ifreq request{};
    std::strcpy(request.ifr_name, "lo");
    if (ioctl(fd, SIOCGIFFLAGS, &request) != 0) refuse("lo");
    request.ifr_flags = static_cast<short>(request.ifr_flags | IFF_UP | IFF_RUNNING);
    if (ioctl(fd, SIOCSIFFLAGS, &request) != 0) refuse("lo up");
}

void set_address(sockaddr *out, const char *address)
{
    sockaddr_in in{};
    in.sin_family = AF_INET;
    inet_pton(AF_INET, address, &in.sin_addr);
    std::memcpy(out, &in, sizeof in);
}

void route_multicast(int fd)
{
    char device[] = "lo";
    rtentry route{};
    set_address(&route.rt_dst, "239.0.0.0");
    set_address(&route.rt_genmask, "255.0.0.0");
    route.rt_flags = RTF_UP;
    route.rt_dev = device;
    if (ioctl(fd, SIOCADDRT, &route) != 0) refuse("multicast route on lo");
}

} // namespace

void enter_private_net()
{
    enter_namespaces();
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0) refuse("socket");
    bring_up_lo(fd);
    route_multicast(fd);
    close(fd);
}

} // namespace outcrop
