// SPDX-License-Identifier: BSD-3-Clause
// The null rival: keyframes that arrive whole. The base then does the vehicle's work too, with the vehicle's own code.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "core/packet.h"
#include "rectify.h"
#include "site/assemble.h"
#include "site/overhead.h"
#include "vehicle/vehicle.h"

namespace outcrop {

class NullRival {
public:
    NullRival();
    ~NullRival();
    NullRival(const NullRival &) = delete;
    NullRival &operator=(const NullRival &) = delete;

    // Take one piece of a keyframe; kTaken when it is new, kFull when there
    // is no room. What comes of it is a function of the set of pieces.
    FeedResult take(const oc_image_piece_t &piece);

    // Run the vehicle's pipeline on all complete keyframes, in the order of
    // their ids, and give its packets to an assembler; then every pixel is
    // known. A function of the set of pieces.
    std::map<int, View> make_views(const std::optional<Area> &area);

    // Whole keyframes that the vehicle's code would not take, at the last make_views.
    std::uint64_t refused() const { return n_refused_; }

    // Pieces to ask for again, as PacketAssembler::missing. Views that were
    // announced have no pieces.
    std::map<int, std::uint32_t> missing(const std::optional<oc_vehicle_status_t> &status,
                                         const std::map<int, std::int64_t> &announced) const;

    // Warp what an overhead plan wants out of the keyframes, losslessly.
    void make_tiles(const std::vector<TileRequest> &plan);
    const std::map<TileKey, TileBlob> &tiles() const { return tiles_; }

private:
    struct Piece {
        std::uint32_t offset_bytes = 0;
        std::vector<std::uint8_t> bytes;
    };
    struct Keyframe {
        oc_view_head_t head{}; // of part 0 once that is there
        std::uint8_t codec = 0;
        std::uint32_t total_bytes = 0;
        std::map<int, Piece> parts;
        cv::Mat3b rgb; // rectified, once whole
    };

    static std::uint32_t missing_parts(const Keyframe &keyframe);
    static void decode(Keyframe *keyframe);
    void push(oc_vehicle_t *vehicle, int id, const Keyframe &keyframe, PacketAssembler *assembler);

    std::map<int, Keyframe> keyframes_;
    std::uint64_t n_refused_ = 0;
    std::map<TileKey, TileBlob> tiles_;
};

} // namespace outcrop
