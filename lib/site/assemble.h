// SPDX-License-Identifier: BSD-3-Clause
// Downlink packets of one vehicle into views, tiles and status: order, duplicates and losses do not matter.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "core/packet.h"
#include "site/view.h"

namespace outcrop {

struct AssembleOptions {
    int vehicle = -1;                       // take packets of this vehicle only; -1: of any (one vehicle per assembler)
    std::size_t max_views = 4096;           // views, complete or not, and views known from relabels and patches only
    std::size_t max_blocks = 1u << 20;      // pixel blocks in all, 64 bytes each
    std::size_t max_relabels = 256;         // kept per view
    std::size_t max_tiles = 1u << 16;       // overhead tiles in all, a datagram each; texture tiles as many again
    std::size_t max_silhouettes = 1u << 15; // a datagram each
};

enum class FeedResult {
    kTaken,     // new, the state may have changed
    kKnown,     // duplicate, or worse than what is there
    kForeign,   // of another vehicle
    kIllFormed, // does not decode
    kOther,     // a type that is not assembled here (image pieces, uplink)
    kFull       // a bound was hit
};

// One overhead tile as it came; decoding the pixels is the overhead module's.
struct TileKey {
    std::uint16_t view = 0;
    std::int16_t ix = 0, iy = 0;
    std::uint16_t tile_px = 0;
    double metres_per_pixel = 0;
    bool operator<(const TileKey &o) const;
};
struct TileBlob {
    std::uint8_t codec = 0; // oc_codec_t
    std::vector<std::uint8_t> bytes;
};

// One silhouette as it came, a whole datagram; oc_packet_decode_silhouette makes labels of it.
struct SilhouetteKey {
    std::uint16_t view = 0, request = 0; // oc_silhouette_t::key
    std::uint8_t box = 0;
    bool operator<(const SilhouetteKey &o) const;
};

// One tile of a view's colour, coded.
struct TextureKey {
    std::uint16_t view = 0;
    std::uint8_t step_px = 0, tile_px = 0;
    std::uint16_t tile = 0;
    bool operator<(const TextureKey &o) const;
};

// The state is a function of the set of packets taken, not of their order, as long as no bound is hit:
// - parts of a view: the newest capture time wins over older ones of the same id (a vehicle that restarted); of two
//   different packets for one part the one whose body is less as a byte string;
// - pixel blocks: the higher quality; at equal quality the lesser bytes;
// - labels of a junction: the relabel sent last, counted from the view's own part 0 modulo 65536; at equal sequence
//   the greater labels as a byte string;
// - tiles, of ground or texture: per view, place and scale the one with more bytes (the codec adapts quality to fit),
//   then the lesser bytes;
// - silhouettes: per view, request and box the one whose body is less as a byte string;
// - status: greatest uptime, then sequence.
// Not thread-safe.
class PacketAssembler {
public:
    explicit PacketAssembler(const AssembleOptions &options = {});

    // One datagram. Never throws on bad data.
    FeedResult feed(const std::uint8_t *bytes, std::size_t n_bytes);
    FeedResult feed(const std::vector<std::uint8_t> &bytes) { return feed(bytes.data(), bytes.size()); }

    // Complete views by id: parts 0..last are all there and follow on each other. Pixels are not shared with later
    // states. Rebuilds only what changed since the last call.
    const std::map<int, View> &views();

    // Parts to ask for again: per view a bit mask as in oc_resend_request_t (all ones: everything, for views of which
    // nothing came although the status says they exist, and where a missing part has no bit). A view whose last part
    // is not known asks for all parts after the greatest that came.
    std::map<int, std::uint32_t> missing() const;

    const std::map<TileKey, TileBlob> &tiles() const { return tiles_; }
    const std::map<SilhouetteKey, std::vector<std::uint8_t>> &silhouettes() const { return silhouettes_; }
    const std::map<TextureKey, TileBlob> &textures() const { return textures_; }
    const std::optional<oc_vehicle_status_t> &status() const { return status_; }
    const std::map<int, std::int64_t> &announced() const { return announced_; } // view id -> utime_us

    std::uint64_t count(FeedResult result) const { return counts_[static_cast<std::size_t>(result)]; }
    // Parts that came for a view but belong to an older one of the same id.
    std::uint64_t outdated_parts() const { return outdated_parts_; }

private:
    using Bytes = std::vector<std::uint8_t>;
    struct Part {
        Bytes body;
        std::uint16_t sequence = 0;
        oc_view_head_t head{};
        std::size_t first_junction = 0;
        std::vector<oc_junction_t> junctions;
        std::vector<oc_tie_t> ties;
    };
    struct Relabel {
        std::uint16_t sequence = 0, first = 0;
        Bytes labels;
        bool operator<(const Relabel &o) const;
    };
    struct Block {
        std::uint8_t quality = 0;
        std::array<std::uint8_t, OC_BLOCK_PX * OC_BLOCK_PX> px{};
    };
    struct Entry {
        std::int64_t utime_us = 0;
        std::map<int, Part> parts; // of that capture time only
        std::set<Relabel> relabels;
        // By blocks per row of the image they were cut from, and index; only those of the view's own width show.
        std::map<std::pair<std::uint16_t, std::uint16_t>, Block> blocks;
        bool is_dirty = true;
    };

    FeedResult dispatch(const std::uint8_t *bytes, std::size_t n_bytes);
    FeedResult take_view(const oc_packet_head_t &head, const Bytes &datagram);
    FeedResult take_relabel(const oc_packet_head_t &head, const Bytes &datagram);
    FeedResult take_patch(const Bytes &datagram);
    FeedResult take_overhead(const Bytes &datagram);
    FeedResult take_silhouette(const Bytes &datagram);
    FeedResult take_texture(const Bytes &datagram);
    template <typename Key>
    FeedResult take_tile(const Key &key, TileBlob fresh, std::map<Key, TileBlob> *tiles) const;
    FeedResult take_status(const oc_packet_head_t &head, const Bytes &datagram);
    FeedResult take_announce(const Bytes &datagram);
    Entry *entry(int view);
    static int last_part(const Entry &entry);
    static bool is_complete(const Entry &entry);
    static View build(int id, const Entry &entry);

    AssembleOptions options_;
    std::map<int, Entry> entries_;
    std::map<int, View> views_;
    std::map<TileKey, TileBlob> tiles_;
    std::map<SilhouetteKey, Bytes> silhouettes_;
    std::map<TextureKey, TileBlob> textures_;
    std::map<int, std::int64_t> announced_;
    std::optional<oc_vehicle_status_t> status_;
    std::uint16_t status_sequence_ = 0;
    std::size_t n_blocks_ = 0;
    std::array<std::uint64_t, 6> counts_{};
    std::uint64_t outdated_parts_ = 0;
};

} // namespace outcrop
