// SPDX-License-Identifier: BSD-3-Clause
// A real vehicle and a link that loses, doubles and reorders, in virtual time: what the tests of the session share.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

extern "C" {
#include "vehicle/capture.h"
#include "vehicle/image_sender.h"
#include "vehicle/pixel_codec.h"
}

#include "core/packet.h"
#include "session.h"
#include "vehicle/vehicle.h"

namespace outcrop {

using Packet = std::vector<std::uint8_t>;

struct LinkFaults {
    double loss = 0, duplicate = 0, reorder = 0; // shares of the packets
    bool spares_relabels = false;
};

// One direction. Everything that is sent arrives 10 ms later, if at all; what is reordered, up to 200 ms later.
class FakeLink {
public:
    FakeLink(const LinkFaults &faults, unsigned seed) : faults_(faults), random_(seed) {}

    void send(const Packet &packet, double now_s)
    {
        oc_packet_head_t head{};
        const bool is_relabel =
            oc_packet_decode_head(packet.data(), packet.size(), &head) == OC_OK && head.type == OC_PACKET_RELABEL;
        n_sent_++;
        if (!(is_relabel && faults_.spares_relabels) && chance() < faults_.loss) return;
        const int copies = chance() < faults_.duplicate ? 2 : 1;
        for (int i = 0; i < copies; i++)
            waiting_.emplace_back(now_s + 0.01 + (chance() < faults_.reorder ? 0.2 * chance() : 0), packet);
    }

    // What has arrived by now, earliest first.
    std::vector<Packet> receive(double now_s)
    {
        std::stable_sort(waiting_.begin(), waiting_.end(),
                         [](const auto &a, const auto &b) { return a.first < b.first; });
        std::vector<Packet> out;
        while (!waiting_.empty() && waiting_.front().first <= now_s) {
            out.push_back(waiting_.front().second);
            waiting_.erase(waiting_.begin());
        }
        return out;
    }

    int n_sent() const { return n_sent_; }

private:
    double chance() { return static_cast<double>(random_() >> 5) * 0x1p-27; }

    LinkFaults faults_;
    std::mt19937 random_;
    std::vector<std::pair<double, Packet>> waiting_;
    int n_sent_ = 0;
};

// The vehicle's end without network and clock, as daemon/vehicle/run.c plays it.
class FakeVehicle {
public:
    // Views of tests/data/sites/SITE; quality > 0 sends whole JPEG pictures instead of layers.
    FakeVehicle(const std::string &site, std::vector<int> views, int quality = 0, std::uint32_t n_datagram_bytes = 1000,
                std::uint32_t n_junctions = 300)
        : datagram_bytes(n_datagram_bytes), views_(std::move(views)), quality_(quality)
    {
        char error[512];
        const oc_margin_option_t none{NAN, NAN};
        const oc_site_option_t at_once{};
        oc_margin_t margin;
        capture_.reset(oc_capture_open_site((OUTCROP_TEST_DATA "/sites/" + site).c_str(), &at_once, &none, &margin,
                                            error, sizeof error));
        if (!capture_) throw std::runtime_error(error);
        oc_vehicle_config_t config = oc_vehicle_defaults();
        config.vehicle = kId;
        config.datagram_bytes = datagram_bytes;
        config.judoca.max_junctions = std::max(config.judoca.max_junctions, n_junctions);
        config.max_sent_junctions = n_junctions;
        config.max_width_px = capture_->max_width_px;
        config.max_height_px = capture_->max_height_px;
        config.stored_views = 16;
        config.keep_colour = true;
        config.area = capture_->area;
        const std::size_t n_bytes = oc_vehicle_size(&config);
        block_.reset(std::aligned_alloc(64, (n_bytes + 63) / 64 * 64));
        if (oc_vehicle_init(&config, block_.get(), n_bytes, &vehicle_) != OC_OK)
            throw std::runtime_error("the vehicle's configuration was refused");
        images_.reset(oc_image_sender_create(16, OC_CODEC_JPEG, std::max(quality, 1), datagram_bytes));
    }

    static constexpr std::uint8_t kId = 3;
    const std::uint32_t datagram_bytes;

    bool is_done() const { return is_done_; }

    // The next of the chosen frames; all of them are keyframes.
    void take_frame()
    {
        char error[512];
        oc_captured_t captured;
        for (;;) {
            const oc_capture_result_t result = capture_->next(capture_.get(), 1, &captured, error, sizeof error);
            if (result == OC_CAPTURE_ERROR) throw std::runtime_error(error);
            is_done_ = result == OC_CAPTURE_DONE;
            if (is_done_) return;
            if (std::count(views_.begin(), views_.end(), captured.view_id)) break;
        }
        newest_ = captured.view_id;
        n_views_++;
        if (quality_ > 0) {
            push_image(captured);
        } else {
            push_frame(captured);
        }
    }

    // The next datagram, empty when there is none.
    Packet next()
    {
        Packet out(OC_MAX_DATAGRAM_BYTES);
        std::size_t n_bytes = 0;
        if (quality_ > 0) {
            const oc_packet_head_t head = packet_head();
            if (!oc_image_sender_next(images_.get(), &head, out.data(), &n_bytes)) n_bytes = 0;
        } else if (oc_vehicle_next(vehicle_, out.data(), datagram_bytes, &n_bytes) != OC_OK) {
            n_bytes = 0;
        }
        out.resize(n_bytes);
        return n_bytes == 0 ? next_tile() : out;
    }

    Packet status(double now_s)
    {
        oc_vehicle_status_t status;
        oc_vehicle_get_status(vehicle_, &status);
        status.n_views = n_views_;
        status.newest_view = newest_;
        status.uptime_s = static_cast<std::uint32_t>(now_s);
        status.is_source_done = is_done_;
        const oc_packet_head_t head = packet_head();
        Packet out(OC_MAX_DATAGRAM_BYTES);
        std::size_t n_bytes = 0;
        if (oc_packet_encode_status(&head, &status, out.data(), out.size(), &n_bytes) != OC_OK)
            throw std::runtime_error("a status was refused");
        out.resize(n_bytes);
        return out;
    }

    void take(const Packet &packet)
    {
        oc_packet_head_t head;
        if (oc_packet_decode_head(packet.data(), packet.size(), &head) != OC_OK || head.vehicle != kId) return;
        if (head.type == OC_PACKET_OVERHEAD_REQUEST) {
            oc_overhead_request_t request;
            if (oc_packet_decode_overhead_request(packet.data(), packet.size(), &request) != OC_OK) return;
            for (std::uint16_t i = 0; i < request.n_tiles; i++) tiles_.emplace_back(request, request.tiles[i]);
        } else if (quality_ > 0) {
            oc_resend_request_t request;
            if (oc_packet_decode_resend(packet.data(), packet.size(), &request) == OC_OK)
                n_resends_ += oc_image_sender_resend(images_.get(), &request);
        } else {
            n_refused_ += oc_vehicle_handle(vehicle_, packet.data(), packet.size()) != OC_OK;
        }
    }

    int n_resends() const { return n_resends_; }
    int n_refused() const { return n_refused_; }

private:
    struct Close {
        void operator()(oc_capture_t *capture) const { capture->close(capture); }
        void operator()(void *block) const { std::free(block); }
        void operator()(oc_image_sender_t *sender) const { oc_image_sender_destroy(sender); }
    };

    oc_packet_head_t packet_head() { return oc_packet_head_t{0, kId, oc_vehicle_next_sequence(vehicle_)}; }

    void push_frame(const oc_captured_t &captured)
    {
        oc_frame_t frame{};
        frame.image = oc_image_from_raw(&captured.raw);
        frame.camera = captured.camera;
        frame.margin = captured.margin;
        frame.utime_us = captured.utime_us;
        frame.has_view_id = true;
        frame.view_id = captured.view_id;
        frame.is_forced = true;
        oc_push_report_t report;
        if (oc_vehicle_push(vehicle_, &frame, &report) != OC_OK) throw std::runtime_error("a frame was refused");
    }

    void push_image(const oc_captured_t &captured)
    {
        oc_view_head_t head{};
        head.view = captured.view_id;
        head.utime_us = captured.utime_us;
        head.camera = captured.camera;
        head.margin = captured.margin;
        const oc_image_t image = oc_image_from_raw(&captured.raw);
        if (!oc_image_sender_push(images_.get(), &head, &image)) throw std::runtime_error("an image was refused");
    }

    Packet next_tile()
    {
        if (tiles_.empty()) return {};
        const auto [request, tile] = tiles_.front();
        tiles_.erase(tiles_.begin());
        std::vector<std::uint8_t> px(3u * request.tile_px * request.tile_px), bytes(datagram_bytes - 32);
        oc_image_mut_t out = {px.data(), request.tile_px, request.tile_px, 3u * request.tile_px, 3};
        std::uint32_t n_seen = 0;
        std::size_t n_bytes = 0;
        if (oc_vehicle_tile(vehicle_, &request, tile, &out, &n_seen) != OC_OK) return next_tile();
        const oc_image_t image = {out.px, out.width_px, out.height_px, out.stride_bytes, 3};
        if (!oc_pixel_encode_within(&image, request.quality, bytes.data(), bytes.size(), &n_bytes)) return next_tile();
        const oc_overhead_t overhead = {request.view,    request.metres_per_pixel,
                                        request.tile_px, tile,
                                        OC_CODEC_WEBP,   static_cast<std::uint16_t>(n_bytes),
                                        bytes.data()};
        const oc_packet_head_t head = packet_head();
        Packet packet(OC_MAX_DATAGRAM_BYTES);
        if (oc_packet_encode_overhead(&head, &overhead, packet.data(), packet.size(), &n_bytes) != OC_OK) return {};
        packet.resize(n_bytes);
        return packet;
    }

    std::vector<int> views_;
    int quality_;
    std::unique_ptr<oc_capture_t, Close> capture_;
    std::unique_ptr<void, Close> block_;
    std::unique_ptr<oc_image_sender_t, Close> images_;
    oc_vehicle_t *vehicle_ = nullptr;
    std::vector<std::pair<oc_overhead_request_t, oc_tile_id_t>> tiles_;
    bool is_done_ = false;
    std::uint16_t n_views_ = 0, newest_ = 0;
    int n_resends_ = 0, n_refused_ = 0;
};

// Both ends until the session has settled, a frame every frame_s; returns the virtual time that took, or -1. The
// clock is what the session's send takes its time from.
inline double play(FakeVehicle &vehicle, FakeLink &down, FakeLink &up, Session &session, double frame_s,
                   double *clock_s)
{
    constexpr double kStepS = 0.05, kLongestS = 300;
    double next_frame_s = 0, next_status_s = 0;
    double &now_s = *clock_s;
    for (now_s = 100; now_s < 100 + kLongestS; now_s += kStepS) {
        if (now_s >= next_status_s) {
            down.send(vehicle.status(now_s), now_s);
            next_status_s = now_s + 1;
        }
        if (!vehicle.is_done() && now_s >= next_frame_s) {
            vehicle.take_frame();
            next_frame_s = now_s + frame_s;
        }
        for (int i = 0; i < 40; i++) { // some 6 Mbit/s
            const Packet packet = vehicle.next();
            if (packet.empty()) break;
            down.send(packet, now_s);
        }
        for (const Packet &packet : down.receive(now_s)) session.receive(packet.data(), packet.size(), now_s);
        session.step(now_s);
        for (const Packet &packet : up.receive(now_s)) vehicle.take(packet);
        if (session.is_settled() && vehicle.is_done()) return now_s - 100;
    }
    return -1;
}

} // namespace outcrop
