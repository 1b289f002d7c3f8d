// SPDX-License-Identifier: BSD-3-Clause
// Downlink packets of one vehicle into views, tiles and status: order, duplicates and losses do not matter.
#include "site/assemble.h"

#include <algorithm>
#include <memory>
#include <tuple>

namespace outcrop {

namespace {

constexpr std::size_t kHeadBytes = 4, kCrcBytes = 2;

// Without the head, whose sequence number differs between a packet and its resend, and the CRC over it.
std::vector<std::uint8_t> body_of(const std::vector<std::uint8_t> &datagram)
{
    return {datagram.begin() + kHeadBytes, datagram.end() - kCrcBytes};
}

constexpr int kMaskParts = 32;

} // namespace

bool TileKey::operator<(const TileKey &o) const
{
    return std::tie(view, ix, iy, tile_px, metres_per_pixel) <
           std::tie(o.view, o.ix, o.iy, o.tile_px, o.metres_per_pixel);
}

bool SilhouetteKey::operator<(const SilhouetteKey &o) const
{
    return std::tie(view, request, box) < std::tie(o.view, o.request, o.box);
}

bool TextureKey::operator<(const TextureKey &o) const
{
    return std::tie(view, step_px, tile_px, tile) < std::tie(o.view, o.step_px, o.tile_px, o.tile);
}

bool PacketAssembler::Relabel::operator<(const Relabel &o) const
{
    return std::tie(sequence, first, labels) < std::tie(o.sequence, o.first, o.labels);
}

PacketAssembler::PacketAssembler(const AssembleOptions &options) : options_(options) {}

FeedResult PacketAssembler::feed(const std::uint8_t *bytes, std::size_t n_bytes)
{
    const FeedResult result = dispatch(bytes, n_bytes);
    ++counts_[static_cast<std::size_t>(result)];
    return result;
}

FeedResult PacketAssembler::dispatch(const std::uint8_t *bytes, std::size_t n_bytes)
{
    oc_packet_head_t head;
    if (bytes == nullptr || oc_packet_decode_head(bytes, n_bytes, &head) != OC_OK) return FeedResult::kIllFormed;
    if (n_bytes < kHeadBytes + kCrcBytes) return FeedResult::kIllFormed;
    if (options_.vehicle >= 0 && head.vehicle != options_.vehicle) return FeedResult::kForeign;
    const Bytes datagram(bytes, bytes + n_bytes);
    switch (head.type) {
    case OC_PACKET_VIEW: return take_view(head, datagram);
    case OC_PACKET_RELABEL: return take_relabel(head, datagram);
    case OC_PACKET_PATCH: return take_patch(datagram);
    case OC_PACKET_OVERHEAD: return take_overhead(datagram);
    case OC_PACKET_SILHOUETTE: return take_silhouette(datagram);
    case OC_PACKET_TEXTURE: return take_texture(datagram);
    case OC_PACKET_STATUS: return take_status(head, datagram);
    case OC_PACKET_ANNOUNCE: return take_announce(datagram);
    default: return FeedResult::kOther;
    }
}

// Of a view, made when it is new; nullptr when there is no room.
PacketAssembler::Entry *PacketAssembler::entry(int view)
{
    const auto known = entries_.find(view);
    if (known != entries_.end()) return &known->second;
    if (entries_.size() >= options_.max_views) return nullptr;
    return &entries_[view];
}

FeedResult PacketAssembler::take_view(const oc_packet_head_t &head, const Bytes &datagram)
{
    const auto part = std::make_unique<oc_view_part_t>();
    if (oc_packet_decode_view(datagram.data(), datagram.size(), part.get()) != OC_OK) return FeedResult::kIllFormed;
    Entry *view = entry(part->head.view);
    if (!view) return FeedResult::kFull;
    if (!view->parts.empty() && part->head.utime_us < view->utime_us) {
        ++outdated_parts_;
        return FeedResult::kKnown;
    }
    if (!view->parts.empty() && part->head.utime_us > view->utime_us) {
        outdated_parts_ += view->parts.size();
        view->parts.clear();
    }
    view->utime_us = part->head.utime_us;
    Part fresh{body_of(datagram), head.sequence, part->head, part->first_junction, {}, {}};
    fresh.junctions.assign(part->junctions, part->junctions + part->n_junctions);
    fresh.ties.assign(part->ties, part->ties + part->n_ties);
    const auto [place, is_new] = view->parts.try_emplace(part->head.part, fresh);
    if (!is_new) {
        Part &old = place->second;
        if (std::tie(old.body, old.sequence) <= std::tie(fresh.body, fresh.sequence)) return FeedResult::kKnown;
        old = fresh;
    }
    view->is_dirty = true;
    return FeedResult::kTaken;
}

FeedResult PacketAssembler::take_relabel(const oc_packet_head_t &head, const Bytes &datagram)
{
    const auto relabel = std::make_unique<oc_relabel_t>();
    if (oc_packet_decode_relabel(datagram.data(), datagram.size(), relabel.get()) != OC_OK)
        return FeedResult::kIllFormed;
    Entry *view = entry(relabel->view);
    if (!view) return FeedResult::kFull;
    Relabel key{head.sequence, relabel->first, Bytes(relabel->labels, relabel->labels + relabel->n)};
    if (view->relabels.count(key)) return FeedResult::kKnown;
    if (view->relabels.size() >= options_.max_relabels) return FeedResult::kFull;
    view->relabels.insert(std::move(key));
    view->is_dirty = true;
    return FeedResult::kTaken;
}

FeedResult PacketAssembler::take_patch(const Bytes &datagram)
{
    const auto patch = std::make_unique<oc_patch_t>();
    if (oc_packet_decode_patch(datagram.data(), datagram.size(), patch.get()) != OC_OK) return FeedResult::kIllFormed;
    Entry *view = entry(patch->view);
    if (!view) return FeedResult::kFull;
    FeedResult result = FeedResult::kKnown;
    for (std::size_t i = 0; i < patch->n_blocks; ++i) {
        Block fresh;
        fresh.quality = patch->quality;
        std::copy(std::begin(patch->px[i]), std::end(patch->px[i]), fresh.px.begin());
        const std::pair<std::uint16_t, std::uint16_t> key{patch->blocks_per_row, patch->blocks[i]};
        const auto known = view->blocks.find(key);
        if (known == view->blocks.end()) {
            if (n_blocks_ >= options_.max_blocks) return FeedResult::kFull;
            ++n_blocks_;
        } else {
            const Block &old = known->second;
            if (old.quality > fresh.quality || (old.quality == fresh.quality && old.px <= fresh.px)) continue;
        }
        view->blocks[key] = fresh;
        view->is_dirty = true;
        result = FeedResult::kTaken;
    }
    return result;
}

FeedResult PacketAssembler::take_overhead(const Bytes &datagram)
{
    oc_overhead_t tile;
    if (oc_packet_decode_overhead(datagram.data(), datagram.size(), &tile) != OC_OK) return FeedResult::kIllFormed;
    const TileKey key{tile.view, tile.tile.ix, tile.tile.iy, tile.tile_px, tile.metres_per_pixel};
    return take_tile(key, {tile.codec, Bytes(tile.bytes, tile.bytes + tile.n_bytes)}, &tiles_);
}

template <typename Key>
FeedResult PacketAssembler::take_tile(const Key &key, TileBlob fresh, std::map<Key, TileBlob> *tiles) const
{
    const auto known = tiles->find(key);
    if (known == tiles->end()) {
        if (tiles->size() >= options_.max_tiles) return FeedResult::kFull;
        (*tiles)[key] = std::move(fresh);
        return FeedResult::kTaken;
    }
    TileBlob &old = known->second;
    const std::size_t n_old = old.bytes.size(), n_fresh = fresh.bytes.size();
    if (n_old > n_fresh) return FeedResult::kKnown;
    if (n_old == n_fresh && std::tie(old.bytes, old.codec) <= std::tie(fresh.bytes, fresh.codec))
        return FeedResult::kKnown;
    old = std::move(fresh);
    return FeedResult::kTaken;
}

FeedResult PacketAssembler::take_texture(const Bytes &datagram)
{
    oc_texture_t tile;
    if (oc_packet_decode_texture(datagram.data(), datagram.size(), &tile) != OC_OK) return FeedResult::kIllFormed;
    const TextureKey key{tile.view, tile.step_px, tile.tile_px, tile.tile};
    return take_tile(key, {tile.codec, Bytes(tile.bytes, tile.bytes + tile.n_bytes)}, &textures_);
}

FeedResult PacketAssembler::take_silhouette(const Bytes &datagram)
{
    oc_silhouette_t silhouette;
    Bytes labels(OC_MAX_SILHOUETTE_CELLS);
    if (oc_packet_decode_silhouette(datagram.data(), datagram.size(), &silhouette, labels.data(), labels.size()) !=
        OC_OK)
        return FeedResult::kIllFormed;
    const SilhouetteKey key{silhouette.view, silhouette.key, silhouette.box};
    const auto known = silhouettes_.find(key);
    if (known == silhouettes_.end()) {
        if (silhouettes_.size() >= options_.max_silhouettes) return FeedResult::kFull;
        silhouettes_[key] = datagram;
        return FeedResult::kTaken;
    }
    if (body_of(known->second) <= body_of(datagram)) return FeedResult::kKnown;
    known->second = datagram;
    return FeedResult::kTaken;
}

FeedResult PacketAssembler::take_status(const oc_packet_head_t &head, const Bytes &datagram)
{
    oc_vehicle_status_t status;
    if (oc_packet_decode_status(datagram.data(), datagram.size(), &status) != OC_OK) return FeedResult::kIllFormed;
    if (status_ && std::tie(status.uptime_s, head.sequence) <= std::tie(status_->uptime_s, status_sequence_))
        return FeedResult::kKnown;
    status_ = status;
    status_sequence_ = head.sequence;
    return FeedResult::kTaken;
}

FeedResult PacketAssembler::take_announce(const Bytes &datagram)
{
    oc_announce_t announce;
    if (oc_packet_decode_announce(datagram.data(), datagram.size(), &announce) != OC_OK) return FeedResult::kIllFormed;
    const auto known = announced_.find(announce.view);
    if (known != announced_.end() && known->second >= announce.utime_us) return FeedResult::kKnown;
    announced_[announce.view] = announce.utime_us;
    return FeedResult::kTaken;
}

// Number of the part that says it is the last (the least, should several say so), or -1.
int PacketAssembler::last_part(const Entry &entry)
{
    for (const auto &[number, part] : entry.parts)
        if (part.head.is_last) return number;
    return -1;
}

// All parts are there and their junctions follow on each other.
bool PacketAssembler::is_complete(const Entry &entry)
{
    const int last = last_part(entry);
    if (last < 0 || static_cast<int>(entry.parts.size()) <= last) return false;
    std::size_t n = 0;
    int expected = 0;
    for (const auto &[number, part] : entry.parts) {
        if (number > last) break;
        if (number != expected++ || part.first_junction != n) return false;
        n += part.junctions.size();
    }
    return true;
}

namespace {

void paint_block(std::uint16_t index, const std::array<std::uint8_t, OC_BLOCK_PX * OC_BLOCK_PX> &px, View *view)
{
    const int side = static_cast<int>(OC_BLOCK_PX);
    const int per_row = (view->grey.cols + side - 1) / side;
    const int x0 = index % per_row * side, y0 = index / per_row * side;
    for (int y = y0; y < std::min(y0 + side, view->grey.rows); ++y) {
        for (int x = x0; x < std::min(x0 + side, view->grey.cols); ++x) {
            view->grey(y, x) = px[static_cast<std::size_t>((y - y0) * side + x - x0)];
            view->known(y, x) = 255;
        }
    }
}

} // namespace

View PacketAssembler::build(int id, const Entry &entry)
{
    const Part &first = entry.parts.begin()->second;
    View view;
    view.id = id;
    view.camera_index = first.head.camera_index;
    view.utime_us = first.head.utime_us;
    view.camera = first.head.camera;
    view.margin = first.head.margin;
    view.has_distortion = first.head.has_distortion;
    view.distortion = first.head.distortion;
    const int last = last_part(entry);
    for (const auto &[number, part] : entry.parts) {
        if (number > last) break;
        view.junctions.insert(view.junctions.end(), part.junctions.begin(), part.junctions.end());
        view.ties.insert(view.ties.end(), part.ties.begin(), part.ties.end());
    }

    // Sequence numbers wrap: what counts is how long after part 0 a relabel was sent.
    std::vector<std::pair<std::uint16_t, const Relabel *>> relabels;
    for (const Relabel &r : entry.relabels)
        relabels.emplace_back(static_cast<std::uint16_t>(r.sequence - first.sequence), &r);
    std::stable_sort(relabels.begin(), relabels.end(), [](const auto &a, const auto &b) { return a.first < b.first; });
    for (const auto &[age, relabel] : relabels)
        for (std::size_t i = 0; i < relabel->labels.size() && relabel->first + i < view.junctions.size(); ++i)
            view.junctions[relabel->first + i].label = relabel->labels[i];

    view.grey = cv::Mat1b::zeros(static_cast<int>(view.camera.k.height_px), static_cast<int>(view.camera.k.width_px));
    view.known = cv::Mat1b::zeros(view.grey.size());
    const auto per_row = (view.camera.k.width_px + OC_BLOCK_PX - 1) / OC_BLOCK_PX;
    for (const auto &[key, block] : entry.blocks)
        if (key.first == per_row) paint_block(key.second, block.px, &view);
    return view;
}

const std::map<int, View> &PacketAssembler::views()
{
    for (auto &[id, entry] : entries_) {
        if (!entry.is_dirty) continue;
        entry.is_dirty = false;
        if (is_complete(entry)) {
            views_[id] = build(id, entry);
        } else {
            views_.erase(id); // a newer one of the same id has begun
        }
    }
    return views_;
}

std::map<int, std::uint32_t> PacketAssembler::missing() const
{
    constexpr std::uint32_t kAll = 0xffffffffu;
    std::map<int, std::uint32_t> missing;
    for (const auto &[id, entry] : entries_) {
        if (is_complete(entry)) continue;
        if (entry.parts.empty()) {
            missing[id] = kAll;
            continue;
        }
        const int last = last_part(entry);
        std::uint32_t mask = 0;
        bool is_maskable = true;
        for (int part = 0; part < (last >= 0 ? last + 1 : kMaskParts); ++part) {
            if (entry.parts.count(part)) continue;
            if (part >= kMaskParts) is_maskable = false;
            if (part < kMaskParts) mask |= 1u << part;
        }
        // Nothing to name: parts beyond the mask are missing, or the ones that came contradict each other.
        missing[id] = is_maskable && mask != 0 ? mask : kAll;
    }
    if (status_ && status_->n_views > 0) {
        const std::size_t n = std::min<std::size_t>(status_->newest_view + std::size_t{1}, options_.max_views);
        for (std::size_t i = 0; i < n; ++i) {
            const int id = static_cast<int>(i);
            if (!entries_.count(id) && !announced_.count(id)) missing[id] = kAll;
        }
    }
    return missing;
}

} // namespace outcrop
