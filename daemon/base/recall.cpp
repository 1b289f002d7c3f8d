// SPDX-License-Identifier: BSD-3-Clause
// One request, and what comes of it.
#include "recall.h"

#include <chrono>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <stdexcept>

#include "link_lcm.h"

namespace outcrop {
namespace {

using clock = std::chrono::steady_clock;

struct Ears {
    int vehicle; // -1: the first that is heard
    oc_recall_request_t request;
    int n_views = 0;
    std::unique_ptr<oc_view_part_t> part = std::make_unique<oc_view_part_t>();
};

void on_packet(void *user, const std::uint8_t *packet, std::size_t n_bytes)
{
    Ears *ears = static_cast<Ears *>(user);
    oc_packet_head_t head;
    if (oc_packet_decode_head(packet, n_bytes, &head) != OC_OK) return;
    if (ears->vehicle < 0) ears->vehicle = head.vehicle;
    if (head.vehicle != ears->vehicle || head.type != OC_PACKET_VIEW) return;
    if (oc_packet_decode_view(packet, n_bytes, ears->part.get()) != OC_OK) return;
    const std::int64_t utime_us = ears->part->head.utime_us;
    const oc_recall_request_t &r = ears->request;
    ears->n_views += r.is_relative || (utime_us >= r.from_us && utime_us <= r.to_us);
}

// Listen until `is_done` or the time is over.
template <typename Done>
bool listen(oc_link_t *link, int wait_ms, Done is_done)
{
    const auto end = clock::now() + std::chrono::milliseconds(wait_ms);
    while (!is_done() && clock::now() < end) {
        if (oc_link_handle(link, 100) < 0) throw std::runtime_error("the link failed");
    }
    return is_done();
}

void send(oc_link_t *link, const Ears &ears, int n)
{
    oc_packet_head_t head{};
    head.vehicle = static_cast<std::uint8_t>(ears.vehicle);
    head.sequence = static_cast<std::uint16_t>(n);
    std::uint8_t packet[64];
    std::size_t n_bytes = 0;
    if (oc_packet_encode_recall(&head, &ears.request, packet, sizeof packet, &n_bytes) != OC_OK)
        throw std::runtime_error("the time asked for ends before it begins, or cannot be told on the link");
    if (!oc_link_send(link, packet, n_bytes)) throw std::runtime_error("the request could not be sent");
}

int digits(const std::string &text, std::size_t at, std::size_t n)
{
    int value = 0;
    for (std::size_t i = at; i < at + n; i++) {
        if (i >= text.size() || text[i] < '0' || text[i] > '9') return -1;
        value = 10 * value + (text[i] - '0');
    }
    return value;
}

// ".5" after the seconds, in microseconds; -1 when it is no fraction.
std::int64_t fraction_us(const std::string &text)
{
    if (text.empty()) return 0;
    if (text[0] != '.' || text.size() < 2 || text.find_first_not_of("0123456789", 1) != std::string::npos) return -1;
    return std::strtoll((text.substr(1, 6) + std::string(6 - std::min<std::size_t>(6, text.size() - 1), '0')).c_str(),
                        nullptr, 10);
}

std::int64_t parse_iso(const std::string &text)
{
    std::tm t{};
    t.tm_year = digits(text, 0, 4) - 1900;
    t.tm_mon = digits(text, 5, 2) - 1;
    t.tm_mday = digits(text, 8, 2);
    t.tm_hour = digits(text, 11, 2);
    t.tm_min = digits(text, 14, 2);
    t.tm_sec = digits(text, 17, 2);
    const bool has_marks = text.size() >= 20 && text[4] == '-' && text[7] == '-' && text[10] == 'T' &&
                           text[13] == ':' && text[16] == ':' && text.back() == 'Z';
    const std::int64_t fraction = has_marks ? fraction_us(text.substr(19, text.size() - 20)) : -1;
    const std::tm given = t;
    const std::time_t seconds = timegm(&t);
    // timegm makes the 32nd of a month the 1st of the next: then this is no date.
    const bool is_date = t.tm_year == given.tm_year && t.tm_mon == given.tm_mon && t.tm_mday == given.tm_mday &&
                         t.tm_hour == given.tm_hour && t.tm_min == given.tm_min && t.tm_sec == given.tm_sec;
    return fraction < 0 || !is_date || seconds < 0 ? -1 : static_cast<std::int64_t>(seconds) * 1000000 + fraction;
}

} // namespace

std::int64_t parse_utc(const std::string &text)
{
    const bool is_number =
        !text.empty() && text.size() <= 17 && text.find_first_not_of("0123456789") == std::string::npos;
    const std::int64_t utime_us = is_number ? std::strtoll(text.c_str(), nullptr, 10) : parse_iso(text);
    if (utime_us < 0 || utime_us >= std::int64_t{1} << 56)
        throw std::runtime_error("\"" + text.substr(0, 40) +
                                 "\" is no UTC time: 2026-01-31T12:00:00Z, or microseconds since 1970");
    return utime_us;
}

int send_recall(const oc_base_config_t &config, const oc_recall_request_t &request, const RecallOptions &options)
{
    Ears ears{config.vehicle, request};
    char error[512];
    const std::unique_ptr<oc_link_t, decltype(&oc_link_close)> link(oc_link_open(config.up_url, OC_CHANNEL_UP,
                                                                                 config.down_url, OC_CHANNEL_DOWN,
                                                                                 on_packet, &ears, error, sizeof error),
                                                                    oc_link_close);
    if (!link) throw std::runtime_error(error);
    if (!listen(link.get(), options.n_tries * options.wait_ms, [&] { return ears.vehicle >= 0; }))
        throw std::runtime_error("no vehicle is heard, and the configuration names none");
    ears.n_views = 0;
    for (int i = 0; i < options.n_tries; i++) {
        send(link.get(), ears, i);
        if (!listen(link.get(), options.wait_ms, [&] { return ears.n_views > 0; })) continue;
        listen(link.get(), options.wait_ms, [] { return false; }); // those that follow
        return ears.n_views;
    }
    throw std::runtime_error("no view of that time came: none is stored on board, or the link is down");
}

} // namespace outcrop
