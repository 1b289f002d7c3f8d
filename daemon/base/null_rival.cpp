// SPDX-License-Identifier: BSD-3-Clause
// Whole keyframes: pieces to pictures, pictures through the vehicle's own pipeline.
#include "null_rival.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <new>
#include <stdexcept>
#include <tuple>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace outcrop {
namespace {

constexpr std::size_t kMaxKeyframes = 4096; // of at most 256 datagrams each
constexpr int kMaskParts = 32;

struct RectifyDelete {
    void operator()(oc_rectify_t *rectify) const { oc_rectify_destroy(rectify); }
};

oc_image_t image_of(const cv::Mat &mat)
{
    return oc_image_t{mat.data, static_cast<std::uint32_t>(mat.cols), static_cast<std::uint32_t>(mat.rows),
                      static_cast<std::uint32_t>(mat.step[0]), static_cast<std::uint32_t>(mat.channels())};
}

struct Free {
    void operator()(void *block) const { std::free(block); }
};

} // namespace

NullRival::NullRival() = default;
NullRival::~NullRival() = default;

FeedResult NullRival::take(const oc_image_piece_t &piece)
{
    const auto known = keyframes_.find(piece.head.view);
    if (known == keyframes_.end() && keyframes_.size() >= kMaxKeyframes) return FeedResult::kFull;
    Keyframe &keyframe = keyframes_[piece.head.view];
    if (piece.head.utime_us < keyframe.head.utime_us) return FeedResult::kKnown;
    const bool is_other = piece.head.utime_us != keyframe.head.utime_us || piece.total_bytes != keyframe.total_bytes;
    if (!is_other && !keyframe.rgb.empty()) return FeedResult::kKnown;
    if (is_other) keyframe = Keyframe{};
    Piece fresh{piece.offset_bytes, {piece.bytes, piece.bytes + piece.n_bytes}};
    const auto [place, is_new] = keyframe.parts.try_emplace(piece.head.part, fresh);
    Piece &old = place->second;
    if (!is_new && std::tie(old.offset_bytes, old.bytes) <= std::tie(fresh.offset_bytes, fresh.bytes))
        return FeedResult::kKnown;
    old = std::move(fresh);
    if (keyframe.parts.size() == 1 || piece.head.part == 0) keyframe.head = piece.head;
    keyframe.codec = piece.codec;
    keyframe.total_bytes = piece.total_bytes;
    decode(&keyframe);
    return FeedResult::kTaken;
}

// Sets rgb when all pieces are there and make a picture.
void NullRival::decode(Keyframe *keyframe)
{
    std::vector<std::uint8_t> bytes;
    int expected = 0;
    for (const auto &[part, piece] : keyframe->parts) {
        if (part != expected++ || piece.offset_bytes != bytes.size()) return;
        bytes.insert(bytes.end(), piece.bytes.begin(), piece.bytes.end());
    }
    if (bytes.size() != keyframe->total_bytes) return;
    cv::Mat bgr = cv::imdecode(bytes, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
    const oc_intrinsics_t &k = keyframe->head.camera.k;
    if (bgr.empty() || bgr.cols != static_cast<int>(k.width_px) || bgr.rows != static_cast<int>(k.height_px)) return;
    cv::cvtColor(bgr, keyframe->rgb, cv::COLOR_BGR2RGB);
    if (!keyframe->head.has_distortion) return;
    const std::unique_ptr<oc_rectify_t, RectifyDelete> rectify(oc_rectify_create(k.width_px, k.height_px));
    if (!rectify) throw std::bad_alloc();
    const oc_image_t image = image_of(keyframe->rgb);
    const oc_raw_image_t raw = oc_raw_from_image(&image);
    const oc_lens_t lens = oc_lens_plumb_bob(&k, &keyframe->head.distortion);
    const oc_image_t flat = oc_rectify_apply(rectify.get(), &raw, &lens);
    if (!flat.px) { // a lens that cannot be
        keyframe->rgb.release();
        return;
    }
    cv::Mat3b copy(bgr.rows, bgr.cols);
    std::memcpy(copy.data, flat.px, copy.total() * 3);
    keyframe->rgb = copy;
}

void NullRival::push(oc_vehicle_t *vehicle, int id, const Keyframe &keyframe, PacketAssembler *assembler)
{
    oc_frame_t frame{};
    frame.image = image_of(keyframe.rgb);
    frame.camera = keyframe.head.camera;
    frame.margin = keyframe.head.margin;
    frame.has_distortion = keyframe.head.has_distortion;
    frame.distortion = keyframe.head.distortion;
    frame.utime_us = keyframe.head.utime_us;
    frame.camera_index = keyframe.head.camera_index;
    frame.has_view_id = true;
    frame.view_id = static_cast<std::uint16_t>(id);
    frame.is_forced = true;
    oc_push_report_t report;
    if (oc_vehicle_push(vehicle, &frame, &report) != OC_OK) {
        n_refused_++;
        return;
    }
    for (;;) {
        std::uint8_t packet[OC_MAX_DATAGRAM_BYTES];
        std::size_t packet_bytes = 0;
        if (oc_vehicle_next(vehicle, packet, sizeof packet, &packet_bytes) != OC_OK || packet_bytes == 0) return;
        assembler->feed(packet, packet_bytes);
    }
}

std::map<int, View> NullRival::make_views(const std::optional<Area> &area)
{
    oc_vehicle_config_t config = oc_vehicle_defaults();
    config.datagram_bytes = OC_MAX_DATAGRAM_BYTES;
    config.keep_colour = false;
    config.max_width_px = config.max_height_px = 0;
    for (const auto &[id, keyframe] : keyframes_) {
        config.max_width_px = std::max(config.max_width_px, keyframe.head.camera.k.width_px);
        config.max_height_px = std::max(config.max_height_px, keyframe.head.camera.k.height_px);
    }
    if (area) config.area = oc_area_t{true, area->x_min, area->x_max, area->y_min, area->y_max, area->z_max};
    const std::size_t n_bytes = oc_vehicle_size(&config);
    const std::unique_ptr<void, Free> block(std::aligned_alloc(64, (n_bytes + 63) / 64 * 64));
    oc_vehicle_t *vehicle = nullptr;
    if (!block || oc_vehicle_init(&config, block.get(), n_bytes, &vehicle) != OC_OK)
        throw std::runtime_error("cannot set up the vehicle's pipeline for whole images");

    PacketAssembler assembler;
    n_refused_ = 0;
    for (const auto &[id, keyframe] : keyframes_) {
        if (!keyframe.rgb.empty()) push(vehicle, id, keyframe, &assembler);
    }
    std::map<int, View> views = assembler.views();
    for (auto &[id, view] : views) {
        cv::cvtColor(keyframes_.at(id).rgb, view.grey, cv::COLOR_RGB2GRAY);
        view.known = cv::Mat1b(view.grey.size(), 255);
    }
    return views;
}

// All pieces but the last are of one size, so any of them says how many there are.
std::uint32_t NullRival::missing_parts(const Keyframe &keyframe)
{
    int n_parts = 0;
    for (const auto &[part, piece] : keyframe.parts) {
        const std::size_t end = piece.offset_bytes + piece.bytes.size();
        if (end < keyframe.total_bytes || part == 0)
            n_parts = static_cast<int>((keyframe.total_bytes + piece.bytes.size() - 1) / piece.bytes.size());
    }
    std::uint32_t mask = 0;
    for (int part = 0; part < n_parts; part++) {
        if (keyframe.parts.count(part)) continue;
        if (part >= kMaskParts) return UINT32_MAX;
        mask |= 1u << part;
    }
    return mask ? mask : UINT32_MAX; // only the last came, or what came contradicts itself
}

std::map<int, std::uint32_t> NullRival::missing(const std::optional<oc_vehicle_status_t> &status,
                                                const std::map<int, std::int64_t> &announced) const
{
    std::map<int, std::uint32_t> out;
    for (const auto &[id, keyframe] : keyframes_) {
        if (keyframe.rgb.empty()) out[id] = missing_parts(keyframe);
    }
    if (!status || keyframes_.size() + announced.size() >= status->n_views) return out;
    for (int id = 0; id <= status->newest_view && id < static_cast<int>(kMaxKeyframes); id++) {
        if (keyframes_.count(id) == 0 && announced.count(id) == 0) out[id] = UINT32_MAX;
    }
    return out;
}

void NullRival::make_tiles(const std::vector<TileRequest> &plan)
{
    for (const TileRequest &request : plan) {
        const auto keyframe = keyframes_.find(request.view);
        if (keyframe == keyframes_.end() || keyframe->second.rgb.empty()) continue;
        const cv::Matx33d image_from_ground(request.image_from_ground.data());
        for (const oc_tile_id_t tile : request.tiles) {
            const double s = request.metres_per_pixel;
            const cv::Matx33d ground_from_tile(s, 0, (tile.ix * request.tile_px + 0.5) * s, 0, -s,
                                               ((tile.iy + 1) * request.tile_px - 0.5) * s, 0, 0, 1);
            cv::Mat3b rgb;
            cv::warpPerspective(keyframe->second.rgb, rgb, image_from_ground * ground_from_tile,
                                cv::Size(request.tile_px, request.tile_px), cv::INTER_AREA | cv::WARP_INVERSE_MAP,
                                cv::BORDER_CONSTANT, cv::Scalar(128, 128, 128));
            cv::Mat bgr;
            cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
            TileBlob blob;
            blob.codec = OC_CODEC_WEBP;
            cv::imencode(".webp", bgr, blob.bytes, {cv::IMWRITE_WEBP_QUALITY, 101}); // over 100: lossless
            TileKey key;
            key.view = static_cast<std::uint16_t>(request.view);
            key.ix = tile.ix;
            key.iy = tile.iy;
            key.tile_px = static_cast<std::uint16_t>(request.tile_px);
            key.metres_per_pixel = static_cast<double>(static_cast<float>(s));
            tiles_[key] = std::move(blob);
        }
    }
}

} // namespace outcrop
