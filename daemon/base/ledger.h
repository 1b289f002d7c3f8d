// SPDX-License-Identifier: BSD-3-Clause
// Bytes on the wire by layer: what every figure about the link is read from.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

namespace outcrop {

// A message costs its LCM payload, channel name with NUL and LCM's 8-byte
// header; `ip` counts UDP's and IPv4's 28 bytes as well.
struct LedgerLine {
    std::uint64_t messages = 0, bytes = 0, bytes_ip = 0;
};

class Ledger {
public:
    // The layer's name is "view", "patch", "silhouette", "texture", "overhead",
    // "request", "status", "image" or, for what does not decode, "other".
    void add(const std::string &channel, const std::uint8_t *payload, std::size_t payload_bytes);

    const std::map<std::string, LedgerLine> &lines() const { return lines_; }
    LedgerLine total() const;

private:
    std::map<std::string, LedgerLine> lines_;
};

} // namespace outcrop
