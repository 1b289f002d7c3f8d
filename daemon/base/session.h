// SPDX-License-Identifier: BSD-3-Clause
// What the base does with packets: gathers views, asks for what it needs, settles the model.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "null_rival.h"
#include "shapes.h"
#include "site/assemble.h"
#include "site/model.h"
#include "site/overhead.h"
#include "site/wanted_blocks.h"

namespace outcrop {

struct SessionOptions {
    int vehicle = -1;               // listen to this one only; -1: the first that is heard
    unsigned datagram_bytes = 1380; // of requests
    std::optional<Area> area;       // before what the vehicle says, before what the views share
    BuildOptions build;
    OverheadOptions overhead;
    WantedBlocksOptions wanted;
    bool with_shapes = false; // silhouettes and textures as well as boxes
    ShapeOptions shapes;
    int patch_quality = 8;             // 1..31
    double quiet_s = 0.25;             // without packets before more is asked for
    double longest_wait_s = 2.0;       // or after so long while packets keep coming
    double longest_plan_wait_s = 10.0; // for a source to end before pixels are asked for
    double retry_s = 1.0;              // unanswered requests are repeated after this
    int max_tries = 10;                // and given up after so many
    double settle_quiet_s = 3.0;       // an endless source settles after so long without news
};

// A state machine without clock and network: time comes in with every call,
// requests go out through `send`. One thread.
class Session {
public:
    using Send = std::function<void(const std::uint8_t *packet, std::size_t n_bytes)>;

    // send may be empty: nothing is asked for then (replay).
    Session(const SessionOptions &options, Send send);
    ~Session();

    // One packet of the downlink. Returns what became of it.
    FeedResult receive(const std::uint8_t *packet, std::size_t n_bytes, double now_s);

    // What was received so far comes from a journal: labels that changed while nobody listened are asked for.
    void resume();

    // Do what is due: resend, patch and overhead requests, solving. Call it every 50 ms or so.
    void step(double now_s);

    // The vehicle's source has ended (or been quiet for long), everything asked
    // for has come or been given up, and model() is of all that came.
    bool is_settled() const { return phase_ == Phase::kSettled; }

    // Solve now from all that has come. The model is a pure function of the
    // views and of those pixels that the views together call for.
    const SiteModel &settle();

    // What the views say about each obstacle of model(); empty without shapes. n_bad: textures that could not be decoded.
    std::vector<std::vector<CarveView>> carve_views(int *n_bad);

    const std::map<int, View> &views();
    const SiteModel &model() const { return model_; }
    const SessionOptions &options() const { return options_; }
    const std::map<TileKey, TileBlob> &tiles() const;
    const PacketAssembler &assembler() const { return assembler_; }
    std::optional<Area> area() const;
    std::uint64_t given_up() const { return n_given_up_; }
    int vehicle() const { return vehicle_; } // -1 before one was heard
    bool is_null_rival() const { return rival_ != nullptr; }
    std::uint64_t keyframes_refused() const { return rival_ ? rival_->refused() : 0; }

private:
    enum class Phase { kGather, kOverhead, kSilhouettes, kTextures, kSettled };

    void on_evidence(double now_s);
    FeedResult take_image(const std::uint8_t *packet, std::size_t n_bytes, double now_s);
    void note_status(double now_s);
    void note_relabel(const std::uint8_t *packet, std::size_t n_bytes);
    void note_view(const std::uint8_t *packet, std::size_t n_bytes);
    std::map<int, std::uint32_t> missing();
    bool ask_missing_parts(double now_s);
    bool ask_labels(double now_s);
    void send_resend(int view, std::uint32_t parts);
    bool ask_blocks(bool is_waiting_for_parts, double now_s);
    bool ask_tiles(double now_s);
    std::vector<WantedBlocks> blocks_for(std::vector<View> list) const;
    bool may_plan(bool is_waiting_for_parts, double now_s) const;
    void plan_blocks(double now_s);
    void keep_wanted(std::vector<View> *list) const;
    void send_blocks(int view, const std::vector<std::uint16_t> &blocks);
    void send_tiles(const TileRequest &request);
    bool may_ask(Asked *asked, double now_s);
    Asker asker(double now_s);
    bool is_source_done(double now_s) const;
    oc_packet_head_t next_head();

    SessionOptions options_;
    Send send_;
    PacketAssembler assembler_;
    std::unique_ptr<NullRival> rival_;
    std::map<int, View> rival_views_;
    Phase phase_ = Phase::kGather;
    ShapeDesk shapes_;
    SiteModel model_;
    std::optional<Area> known_area_;
    bool is_model_current_ = false;
    bool is_plan_current_ = false;

    std::set<int> heard_;                             // views of which a part came
    std::map<int, std::vector<std::uint8_t>> wanted_; // per view one byte per block, 1: wanted
    std::map<int, Asked> asked_labels_;               // views whose labels may be old
    std::map<int, Asked> asked_blocks_, asked_parts_, asked_tiles_;
    std::vector<TileRequest> tile_plan_;
    std::uint64_t n_given_up_ = 0;
    std::uint16_t sequence_ = 0;
    int vehicle_ = -1;
    double last_news_s_ = 0, last_plan_s_ = 0, last_blocks_s_ = 0;
    bool has_news_ = false;
};

} // namespace outcrop
