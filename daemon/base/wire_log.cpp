// SPDX-License-Identifier: BSD-3-Clause
// The log's form: big-endian sync, event number, time, two lengths, then channel and payload.
#include "wire_log.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
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
    if (std::filesystem::is_directory(path)) throw std::runtime_error(path + ": is a folder");
    std::ifstream file(path, std::ios::binary);
    if (!file) throw std::runtime_error(path + ": " + std::strerror(errno));
    std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    if (file.bad()) throw std::runtime_error(path + ": cannot be read");
    return bytes;
}

// A sync word, or as much of one as the file has left.
bool is_sync(const std::vector<std::uint8_t> &bytes, std::size_t at)
{
    std::uint8_t sync[4];
    put_be(sync, kSync, 4);
    const std::size_t n = std::min<std::size_t>(4, bytes.size() - at);
    return std::equal(sync, sync + n, bytes.begin() + static_cast<std::ptrdiff_t>(at));
}

// The next sync word at or after a place, the file's size when there is none.
std::size_t next_sync(const std::vector<std::uint8_t> &bytes, std::size_t at)
{
    while (at < bytes.size() && !is_sync(bytes, at)) at++;
    return at;
}

std::size_t channel_bytes_at(const std::vector<std::uint8_t> &bytes, std::size_t at)
{
    return static_cast<std::size_t>(get_be(bytes.data() + at + 20, 4));
}

std::size_t payload_bytes_at(const std::vector<std::uint8_t> &bytes, std::size_t at)
{
    return static_cast<std::size_t>(get_be(bytes.data() + at + 24, 4));
}

// True when the lengths are possible or not there to be judged.
bool has_possible_lengths(const std::vector<std::uint8_t> &bytes, std::size_t at)
{
    if (bytes.size() - at < kHeadBytes) return true;
    return channel_bytes_at(bytes, at) > 0 && channel_bytes_at(bytes, at) <= kMaxChannelBytes &&
           payload_bytes_at(bytes, at) <= kMaxPayloadBytes;
}

// Length of the event that begins here, 0 when there is none. An event that
// another sync word follows neither at its end nor before it is followed by
// garbage; with one inside and none at its end its length is wrong.
std::size_t whole_event(const std::vector<std::uint8_t> &bytes, std::size_t at)
{
    const std::size_t left = bytes.size() - at;
    if (left < kHeadBytes || !is_sync(bytes, at) || !has_possible_lengths(bytes, at)) return 0;
    const std::size_t n = kHeadBytes + channel_bytes_at(bytes, at) + payload_bytes_at(bytes, at);
    if (n > left) return 0;
    if (n == left || is_sync(bytes, at + n)) return n;
    return next_sync(bytes, at + 4) < at + n ? 0 : n;
}

LogEvent event_at(const std::vector<std::uint8_t> &bytes, std::size_t at)
{
    const std::uint8_t *channel = bytes.data() + at + kHeadBytes, *payload = channel + channel_bytes_at(bytes, at);
    LogEvent event;
    event.utime_us = static_cast<std::int64_t>(get_be(bytes.data() + at + 12, 8));
    event.channel.assign(channel, payload);
    event.payload.assign(payload, payload + payload_bytes_at(bytes, at));
    return event;
}

} // namespace

LogFaults read_log(const std::string &path, const std::function<void(const LogEvent &)> &take)
{
    const std::vector<std::uint8_t> bytes = read_file(path);
    LogFaults faults;
    std::size_t at = 0, n_events = 0;
    while (at < bytes.size()) {
        const std::size_t event_bytes = whole_event(bytes, at);
        if (event_bytes > 0) {
            take(event_at(bytes, at));
            n_events++;
            at += event_bytes;
            faults.whole_bytes = at;
            continue;
        }
        const bool is_event = is_sync(bytes, at);
        const std::size_t next = next_sync(bytes, at + 1);
        // An event that begins and has no successor is cut; anything else that is no event is garbage.
        faults.is_cut = next == bytes.size() && is_event && has_possible_lengths(bytes, at);
        if (!faults.is_cut) faults.garbage_bytes += next - at;
        at = next;
    }
    if (n_events == 0) throw std::runtime_error(path + ": holds no LCM event");
    faults.n_events = n_events;
    return faults;
}

LogWriter::LogWriter(const std::string &path) : file_(std::fopen(path.c_str(), "wb")), path_(path)
{
    if (!file_) throw std::runtime_error(path + ": " + std::strerror(errno));
}

LogWriter::LogWriter(const std::string &path, const LogFaults &read) : path_(path), next_event_(read.n_events)
{
    std::filesystem::resize_file(path, read.whole_bytes);
    file_.reset(std::fopen(path.c_str(), "ab"));
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
