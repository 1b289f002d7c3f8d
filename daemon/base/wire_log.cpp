// SPDX-License-Identifier: BSD-3-Clause
// The log's form: big-endian sync, event number, time, two lengths, then channel and payload.
#include "wire_log.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace outcrop {
namespace {

constexpr std::uint32_t kSync = 0xEDA1DA01;
constexpr std::size_t kHeadBytes = 28;
constexpr std::uint32_t kMaxChannelBytes = 63; // LCM_MAX_CHANNEL_NAME_LENGTH
constexpr std::uint32_t kMaxPayloadBytes = 1u << 20;

std::uint64_t get_be(const std::uint8_t *in, int n)
{
    std::uint64_t value = 0;
    for (int i = 0; i < n; i++) value = value << 8 | in[i];
    return value;
}

void put_be(std::uint8_t *out, std::uint64_t value, int n)
{
    for (int i = 0; i < n; i++) out[i] = static_cast<std::uint8_t>(value >> (8 * (n - 1 - i)));
}

std::vector<std::uint8_t> read_file(const std::string &path)
{
    std::ifstream file(path, std::ios::binary);
    if (!file) throw std::runtime_error(path + ": " + std::strerror(errno));
    std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    if (file.bad()) throw std::runtime_error(path + ": cannot be read");
    return bytes;
}

} // namespace

LogFaults read_log(const std::string &path, const std::function<void(const LogEvent &)> &take)
{
    const std::vector<std::uint8_t> bytes = read_file(path);
    LogFaults faults;
    std::size_t at = 0, n_events = 0;
    while (at < bytes.size()) {
        const std::size_t left = bytes.size() - at;
        const std::uint8_t *head = bytes.data() + at;
        if (left < 4 || get_be(head, 4) != kSync) {
            at++;
            faults.garbage_bytes++;
            continue;
        }
        if (left < kHeadBytes) {
            faults.is_cut = true;
            break;
        }
        const auto channel_bytes = static_cast<std::uint32_t>(get_be(head + 20, 4));
        const auto payload_bytes = static_cast<std::uint32_t>(get_be(head + 24, 4));
        if (channel_bytes == 0 || channel_bytes > kMaxChannelBytes || payload_bytes > kMaxPayloadBytes) {
            at += 4;
            faults.garbage_bytes += 4;
            continue;
        }
        if (left - kHeadBytes < std::size_t{channel_bytes} + payload_bytes) {
            faults.is_cut = true;
            break;
        }
        const std::uint8_t *channel = head + kHeadBytes, *payload = channel + channel_bytes;
        LogEvent event;
        event.utime_us = static_cast<std::int64_t>(get_be(head + 12, 8));
        event.channel.assign(channel, payload);
        event.payload.assign(payload, payload + payload_bytes);
        take(event);
        n_events++;
        at += kHeadBytes + channel_bytes + payload_bytes;
    }
    if (n_events == 0) throw std::runtime_error(path + ": holds no LCM event");
    return faults;
}

LogWriter::LogWriter(const std::string &path) : file_(std::fopen(path.c_str(), "wb")), path_(path)
{
    if (!file_) throw std::runtime_error(path + ": " + std::strerror(errno));
}

void LogWriter::write(std::int64_t utime_us, const std::string &channel, const std::uint8_t *payload,
                      std::size_t n_bytes)
{
    std::vector<std::uint8_t> event(kHeadBytes);
    put_be(event.data(), kSync, 4);
    put_be(event.data() + 4, next_event_++, 8);
    put_be(event.data() + 12, static_cast<std::uint64_t>(utime_us), 8);
    put_be(event.data() + 20, channel.size(), 4);
    put_be(event.data() + 24, n_bytes, 4);
    event.insert(event.end(), channel.begin(), channel.end());
    event.insert(event.end(), payload, payload + n_bytes);
    if (std::fwrite(event.data(), 1, event.size(), file_.get()) != event.size() || std::fflush(file_.get()) != 0)
        throw std::runtime_error(path_ + ": " + std::strerror(errno));
}

} // namespace outcrop
