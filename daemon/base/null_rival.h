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

    // Take one piece of a keyframe; true when it completed one.
    bool take(const oc_image_piece_t &piece);

    // Run the vehicle's pipeline on all complete keyframes, in the order of
    // their ids, and give its packets to an assembler; then every pixel is
    // known. A function of the set of pieces.
    std::map<int, View> make_views(const std::optional<Area> &area);

    // Pieces to ask for again, as PacketAssembler::missing.
    std::map<int, std::uint32_t> missing(const std::optional<oc_vehicle_status_t> &status) const;

    // Warp what an overhead plan wants out of the keyframes, losslessly.
    void make_tiles(const std::vector<TileRequest> &plan);
    const std::map<TileKey, TileBlob> &tiles() const { return tiles_; }

private:
    struct Keyframe {
        oc_view_head_t head{};
        std::uint8_t codec = 0;
        std::uint32_t total_bytes = 0;
        std::map<std::uint32_t, std::vector<std::uint8_t>> pieces; // by offset
        std::map<int, std::uint32_t> parts;                        // part -> offset
        bool has_last = false;
        cv::Mat3b rgb; // rectified, once whole
    };

    bool decode(Keyframe *keyframe);

    std::map<int, Keyframe> keyframes_;
    std::map<TileKey, TileBlob> tiles_;
};

} // namespace outcrop
