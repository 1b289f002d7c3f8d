// SPDX-License-Identifier: BSD-3-Clause
// Asking the vehicle for the shapes of obstacles, and making them out of what came.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "site/assemble.h"
#include "site/carve.h"
#include "site/shape_plan.h"
#include "site/site_model.h"

namespace outcrop {

// When something was asked for, and how often.
struct Asked {
    double when_s = 0;
    int tries = 0;
};

// What a desk needs of the session to ask.
struct Asker {
    std::function<bool(Asked *)> may_ask; // now? Counts the try
    std::function<bool(const Asked &)> is_given_up;
    std::function<oc_packet_head_t()> next_head;
    std::function<void(const std::uint8_t *, std::size_t)> send;
};

// Plans follow from one settled model; plan() forgets what was planned for another.
class ShapeDesk {
public:
    explicit ShapeDesk(const ShapeOptions &options) : options_(options) {}

    void plan(const SiteModel &model, const std::map<int, View> &views);

    // Ask for what has not come; true while something is still expected.
    bool ask_silhouettes(const PacketAssembler &assembler, const Asker &asker);
    bool ask_textures(const SiteModel &model, const std::map<int, View> &views, const PacketAssembler &assembler,
                      const Asker &asker);

    // Per obstacle of the model, what the views that answered say; a function of the model and the packets only.
    // n_bad: textures that are no picture of their size.
    std::vector<std::vector<CarveView>> gather(const SiteModel &model, const std::map<int, View> &views,
                                               const PacketAssembler &assembler, int *n_bad) const;

private:
    std::vector<std::vector<CarveView>> gather_labels(const SiteModel &model, const std::map<int, View> &views,
                                                      const PacketAssembler &assembler) const;

    ShapeOptions options_;
    std::vector<SilhouettePlan> silhouettes_;
    std::vector<TexturePlan> textures_;
    bool are_textures_planned_ = false;
    std::map<std::size_t, Asked> asked_silhouettes_; // by plan
    std::map<int, Asked> asked_textures_;            // by view
};

} // namespace outcrop
