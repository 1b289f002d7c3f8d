// SPDX-License-Identifier: BSD-3-Clause
// LCM log files, byte-compatible with lcm-logger's, read with distrust.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace outcrop {

struct LogEvent {
    std::int64_t utime_us = 0;
    std::string channel;
    std::vector<std::uint8_t> payload; // an LCM payload: fingerprint first
};

// What reading met besides events.
struct LogFaults {
    std::uint64_t garbage_bytes = 0; // skipped until the next sync word
    bool is_cut = false;             // the last event is not whole
    std::uint64_t n_events = 0;
    std::uint64_t whole_bytes = 0; // up to the end of the last whole event
};

// Calls take for every whole event in file order; skips garbage and an event
// with impossible lengths, stops at a cut one. Throws std::runtime_error with
// one line that names the file when it cannot be read or holds no event.
LogFaults read_log(const std::string &path, const std::function<void(const LogEvent &)> &take);

// Writes events; flushes each, so a killed base leaves at most one cut event.
class LogWriter {
public:
    explicit LogWriter(const std::string &path); // a new log; throws std::runtime_error

    // Goes on with a log of which so much was read; what follows its last whole event is cut off.
    LogWriter(const std::string &path, const LogFaults &read);
    void write(std::int64_t utime_us, const std::string &channel, const std::uint8_t *payload, std::size_t n_bytes);

private:
    struct Close {
        void operator()(std::FILE *file) const { std::fclose(file); }
    };
    std::unique_ptr<std::FILE, Close> file_;
    std::string path_;
    std::uint64_t next_event_ = 0;
};

} // namespace outcrop
