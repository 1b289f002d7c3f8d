// SPDX-License-Identifier: BSD-3-Clause
// Requests follow from what is known, so a complete link always ends with the same set of packets and one model.
#include "session.h"

#include <algorithm>
#include <iterator>
#include <tuple>

namespace outcrop {
namespace {

std::size_t block_count(const View &view)
{
    const std::size_t across = (view.camera.k.width_px + OC_BLOCK_PX - 1) / OC_BLOCK_PX;
    const std::size_t down = (view.camera.k.height_px + OC_BLOCK_PX - 1) / OC_BLOCK_PX;
    return across * down;
}

bool is_block_known(const View &view, std::size_t block)
{
    const int across = static_cast<int>((view.camera.k.width_px + OC_BLOCK_PX - 1) / OC_BLOCK_PX);
    const int x = static_cast<int>(block) % across * static_cast<int>(OC_BLOCK_PX);
    const int y = static_cast<int>(block) / across * static_cast<int>(OC_BLOCK_PX);
    return view.known(y, x) != 0;
}

bool is_same(const std::optional<Area> &a, const std::optional<Area> &b)
{
    if (!a || !b) return a.has_value() == b.has_value();
    return std::tie(a->x_min, a->x_max, a->y_min, a->y_max, a->z_max) ==
           std::tie(b->x_min, b->x_max, b->y_min, b->y_max, b->z_max);
}

// Only the named blocks stay known; the pixels are shared, what is known is not.
void keep_blocks(const std::vector<std::uint16_t> &blocks, View *view)
{
    const int side = static_cast<int>(OC_BLOCK_PX), across = (view->known.cols + side - 1) / side;
    cv::Mat1b kept(view->known.size(), std::uint8_t{0});
    for (const std::uint16_t block : blocks) {
        const cv::Rect place(block % across * side, block / across * side, side, side);
        const cv::Rect inside = place & cv::Rect(0, 0, kept.cols, kept.rows);
        view->known(inside).copyTo(kept(inside));
    }
    view->known = kept;
}

} // namespace

Session::Session(const SessionOptions &options, Send send)
    : options_(options), send_(std::move(send)), shapes_(options.shapes)
{
    AssembleOptions assemble;
    assemble.vehicle = options.vehicle;
    assembler_ = PacketAssembler(assemble);
    vehicle_ = options.vehicle;
}

Session::~Session() = default;

void Session::on_evidence(double now_s)
{
    if (!has_news_) last_blocks_s_ = last_plan_s_ = now_s;
    has_news_ = true;
    last_news_s_ = now_s;
}

FeedResult Session::receive(const std::uint8_t *packet, std::size_t n_bytes, double now_s)
{
    oc_packet_head_t head;
    if (oc_packet_decode_head(packet, n_bytes, &head) != OC_OK) return assembler_.feed(packet, n_bytes);
    if (vehicle_ < 0) vehicle_ = head.vehicle;
    if (head.vehicle != vehicle_) return FeedResult::kForeign;

    if (head.type == OC_PACKET_IMAGE) return take_image(packet, n_bytes, now_s);
    const FeedResult result = assembler_.feed(packet, n_bytes);
    if (head.type == OC_PACKET_RELABEL) note_relabel(packet, n_bytes);
    if (result != FeedResult::kTaken) return result;
    if (head.type == OC_PACKET_STATUS) {
        note_status(now_s);
        return result;
    }
    if (head.type == OC_PACKET_VIEW) note_view(packet, n_bytes);
    on_evidence(now_s);
    if (head.type == OC_PACKET_OVERHEAD || head.type == OC_PACKET_SILHOUETTE || head.type == OC_PACKET_TEXTURE)
        return result;
    is_model_current_ = false;
    if (head.type != OC_PACKET_PATCH) is_plan_current_ = false; // pixels say nothing about what else is wanted
    phase_ = Phase::kGather;
    return result;
}

FeedResult Session::take_image(const std::uint8_t *packet, std::size_t n_bytes, double now_s)
{
    oc_image_piece_t piece;
    if (oc_packet_decode_image(packet, n_bytes, &piece) != OC_OK) return FeedResult::kIllFormed;
    if (!rival_) rival_ = std::make_unique<NullRival>();
    const FeedResult result = rival_->take(piece);
    if (result != FeedResult::kTaken) return result;
    on_evidence(now_s);
    is_model_current_ = false;
    phase_ = Phase::kGather;
    return result;
}

// A status says that there are views, also when none of them came through; and where the work is.
void Session::note_status(double now_s)
{
    const auto &status = assembler_.status();
    if (status && status->n_views > 0 && !has_news_) on_evidence(now_s);
    if (is_same(area(), known_area_)) return;
    known_area_ = area();
    is_model_current_ = is_plan_current_ = false;
    phase_ = Phase::kGather;
}

void Session::note_view(const std::uint8_t *packet, std::size_t n_bytes)
{
    const auto part = std::make_unique<oc_view_part_t>();
    if (oc_packet_decode_view(packet, n_bytes, part.get()) == OC_OK) heard_.insert(part->head.view);
}

// What the assembler misses, less the numbers that were never given out: a site folder's views need not be 0, 1, 2 ...
std::map<int, std::uint32_t> Session::missing()
{
    const auto &status = assembler_.status();
    if (rival_) return rival_->missing(status, assembler_.announced());
    auto out = assembler_.missing();
    // A view that was held back is announced first and comes later.
    std::size_t n_known = heard_.size();
    for (const auto &[id, utime_us] : assembler_.announced()) n_known += heard_.count(id) == 0;
    if (!status || n_known < status->n_views) return out;
    for (auto entry = out.begin(); entry != out.end();)
        entry = heard_.count(entry->first) ? std::next(entry) : out.erase(entry);
    return out;
}

const std::map<int, View> &Session::views()
{
    return rival_ ? rival_views_ : assembler_.views();
}

const std::map<TileKey, TileBlob> &Session::tiles() const
{
    return rival_ ? rival_->tiles() : assembler_.tiles();
}

std::optional<Area> Session::area() const
{
    if (options_.area) return options_.area;
    const auto &status = assembler_.status();
    if (!status || !status->area.is_set) return std::nullopt;
    const oc_area_t &a = status->area;
    return Area{a.x_min, a.x_max, a.y_min, a.y_max, a.z_max};
}

bool Session::may_ask(Asked *asked, double now_s)
{
    // While anything still comes, the vehicle may be about to answer this one.
    const double since_s = now_s - std::max(asked->when_s, last_news_s_);
    if (asked->tries > 0 && since_s < options_.retry_s) return false;
    if (asked->tries == options_.max_tries) {
        asked->tries++;
        n_given_up_++;
    }
    if (asked->tries > options_.max_tries) return false;
    asked->when_s = now_s;
    asked->tries++;
    return true;
}

oc_packet_head_t Session::next_head()
{
    oc_packet_head_t head{};
    head.vehicle = static_cast<std::uint8_t>(std::max(vehicle_, 0));
    head.sequence = sequence_++;
    return head;
}

// True while something is still expected.
bool Session::ask_missing_parts(double now_s)
{
    bool is_waiting = false;
    for (const auto &[view, parts] : missing()) {
        Asked &asked = asked_parts_[view];
        if (asked.tries > options_.max_tries) continue;
        is_waiting = true;
        if (may_ask(&asked, now_s)) send_resend(view, parts);
    }
    return is_waiting;
}

void Session::send_resend(int view, std::uint32_t parts)
{
    const oc_resend_request_t request{static_cast<std::uint16_t>(view), parts};
    const oc_packet_head_t head = next_head();
    std::uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    std::size_t n_bytes = 0;
    if (oc_packet_encode_resend(&head, &request, buf, options_.datagram_bytes, &n_bytes) == OC_OK) send_(buf, n_bytes);
}

void Session::resume()
{
    if (rival_) return;
    for (const auto &[id, view] : assembler_.views())
        if (!view.junctions.empty()) asked_labels_[id];
}

bool Session::ask_labels(double now_s)
{
    bool is_waiting = false;
    for (auto &[view, asked] : asked_labels_) {
        if (asked.tries > options_.max_tries) continue;
        is_waiting = true;
        if (may_ask(&asked, now_s)) send_resend(view, 0);
    }
    return is_waiting;
}

// The labels that were asked for have come, in one packet or, for very many junctions, the first of some.
void Session::note_relabel(const std::uint8_t *packet, std::size_t n_bytes)
{
    const auto relabel = std::make_unique<oc_relabel_t>();
    if (oc_packet_decode_relabel(packet, n_bytes, relabel.get()) != OC_OK) return;
    const auto asked = asked_labels_.find(relabel->view);
    if (asked != asked_labels_.end() && asked->second.tries > 0) asked_labels_.erase(asked);
}

// Blocks that a set of views calls for, whatever of them is known already.
std::vector<WantedBlocks> Session::blocks_for(std::vector<View> list) const
{
    if (list.size() < 2) return {};
    for (View &view : list)
        view.known = cv::Mat1b(view.known.size(), std::uint8_t{0}); // not zeros(): that writes into the shared pixels
    // The ties alone already narrow the poses, and narrow strips hold fewer candidates.
    const RefineResult refined = refine_poses(list, {}, options_.build.refine);
    std::vector<PosedView> posed;
    for (std::size_t i = 0; i < list.size(); i++)
        posed.push_back({&list[i], refined.views[i].camera, refined.matching_margins[i]});
    WantedBlocksOptions wanted = options_.wanted;
    wanted.strip.angles = OC_ANGLE_ERROR_LOCAL; // as refine_poses states its margins
    const Area where = area().value_or(derive_area(list, options_.build));
    return wanted_blocks(posed, select_pairs(posed, where, options_.build.pairs), where, {}, wanted);
}

// What the views seen so far call for joins what was called for before.
void Session::plan_blocks(double now_s)
{
    is_plan_current_ = true;
    last_blocks_s_ = now_s;
    std::vector<View> list;
    for (const auto &[id, view] : assembler_.views()) {
        list.push_back(view);
        wanted_[id].resize(block_count(view), 0);
    }
    for (const WantedBlocks &more : blocks_for(list)) {
        auto &flags = wanted_[more.view];
        bool is_more = false;
        for (const std::uint16_t block : more.blocks) {
            is_more = is_more || flags[block] == 0;
            flags[block] = 1;
        }
        if (is_more) asked_blocks_[more.view] = Asked{};
    }
}

// Later views relabel junctions as ground, which saves their pixels; so it
// pays to wait for the end of the source, but not for long.
bool Session::may_plan(bool is_waiting_for_parts, double now_s) const
{
    return (is_source_done(now_s) && !is_waiting_for_parts) || now_s - last_blocks_s_ >= options_.longest_plan_wait_s;
}

void Session::send_blocks(int view, const std::vector<std::uint16_t> &blocks)
{
    std::size_t at = 0;
    while (at < blocks.size()) {
        oc_patch_request_t request{};
        request.view = static_cast<std::uint16_t>(view);
        request.quality = static_cast<std::uint8_t>(options_.patch_quality);
        const std::size_t n = std::min<std::size_t>(blocks.size() - at, OC_MAX_PACKET_BLOCKS);
        request.n_blocks = static_cast<std::uint16_t>(n);
        std::copy_n(blocks.begin() + static_cast<std::ptrdiff_t>(at), n, request.blocks);
        const oc_packet_head_t head = next_head();
        std::uint8_t buf[OC_MAX_DATAGRAM_BYTES];
        std::size_t n_bytes = 0;
        std::uint16_t taken = 0;
        if (oc_packet_encode_patch_request(&head, &request, buf, options_.datagram_bytes, &n_bytes, &taken) != OC_OK ||
            taken == 0)
            return;
        send_(buf, n_bytes);
        at += taken;
    }
}

bool Session::ask_blocks(bool is_waiting_for_parts, double now_s)
{
    if (!is_plan_current_ && may_plan(is_waiting_for_parts, now_s)) plan_blocks(now_s);
    bool is_waiting = !is_plan_current_;
    for (const auto &[id, view] : assembler_.views()) {
        const auto wanted = wanted_.find(id);
        if (wanted == wanted_.end()) continue;
        std::vector<std::uint16_t> blocks;
        for (std::size_t i = 0; i < wanted->second.size(); i++) {
            if (wanted->second[i] && !is_block_known(view, i)) blocks.push_back(static_cast<std::uint16_t>(i));
        }
        Asked &asked = asked_blocks_[id];
        if (blocks.empty() || asked.tries > options_.max_tries) continue;
        is_waiting = true;
        if (may_ask(&asked, now_s)) send_blocks(id, blocks);
    }
    return is_waiting;
}

void Session::send_tiles(const TileRequest &plan)
{
    std::size_t at = 0;
    while (at < plan.tiles.size()) {
        oc_overhead_request_t request{};
        request.view = static_cast<std::uint16_t>(plan.view);
        std::copy(plan.image_from_ground.begin(), plan.image_from_ground.end(), request.image_from_ground);
        request.metres_per_pixel = plan.metres_per_pixel;
        request.tile_px = static_cast<std::uint16_t>(plan.tile_px);
        request.quality = static_cast<std::uint8_t>(plan.quality);
        const std::size_t n = std::min<std::size_t>(plan.tiles.size() - at, OC_MAX_REQUEST_TILES);
        request.n_tiles = static_cast<std::uint16_t>(n);
        std::copy_n(plan.tiles.begin() + static_cast<std::ptrdiff_t>(at), n, request.tiles);
        const oc_packet_head_t head = next_head();
        std::uint8_t buf[OC_MAX_DATAGRAM_BYTES];
        std::size_t n_bytes = 0;
        std::uint16_t taken = 0;
        if (oc_packet_encode_overhead_request(&head, &request, buf, options_.datagram_bytes, &n_bytes, &taken) !=
                OC_OK ||
            taken == 0)
            return;
        send_(buf, n_bytes);
        at += taken;
    }
}

bool Session::ask_tiles(double now_s)
{
    if (rival_) return false; // settle() has made them
    bool is_waiting = false;
    for (const TileRequest &plan : tile_plan_) {
        TileRequest left = plan;
        left.tiles.clear();
        for (const oc_tile_id_t tile : plan.tiles) {
            TileKey key;
            key.view = static_cast<std::uint16_t>(plan.view);
            key.ix = tile.ix;
            key.iy = tile.iy;
            key.tile_px = static_cast<std::uint16_t>(plan.tile_px);
            key.metres_per_pixel = static_cast<double>(static_cast<float>(plan.metres_per_pixel));
            if (assembler_.tiles().count(key) == 0) left.tiles.push_back(tile);
        }
        Asked &asked = asked_tiles_[plan.view];
        if (left.tiles.empty() || asked.tries > options_.max_tries) continue;
        is_waiting = true;
        if (may_ask(&asked, now_s)) send_tiles(left);
    }
    return is_waiting;
}

bool Session::is_source_done(double now_s) const
{
    const auto &status = assembler_.status();
    return (status && status->is_source_done) || now_s - last_news_s_ > options_.settle_quiet_s;
}

// Pixels that were asked for when less was known would make the model depend
// on when the packets came; only what all views together call for counts.
void Session::keep_wanted(std::vector<View> *list) const
{
    std::map<int, std::vector<std::uint16_t>> wanted;
    for (WantedBlocks &one : blocks_for(*list)) wanted[one.view] = std::move(one.blocks);
    for (View &view : *list) keep_blocks(wanted[view.id], &view);
}

const SiteModel &Session::settle()
{
    if (is_model_current_) return model_;
    if (rival_) rival_views_ = rival_->make_views(area());
    std::vector<View> list;
    for (const auto &[id, view] : views()) list.push_back(view);
    if (!rival_) keep_wanted(&list);
    model_ = build_site(list, area(), options_.build);
    if (rival_) rival_->make_tiles(plan_overhead(model_, options_.overhead));
    is_model_current_ = true;
    if (options_.with_shapes && !rival_) shapes_.plan(model_, views());
    return model_;
}

std::vector<std::vector<CarveView>> Session::carve_views(int *n_bad)
{
    *n_bad = 0;
    if (!options_.with_shapes || rival_ || !is_model_current_) return {};
    return shapes_.gather(model_, views(), assembler_, n_bad);
}

Asker Session::asker(double now_s)
{
    Asker asker;
    asker.may_ask = [this, now_s](Asked *asked) { return may_ask(asked, now_s); };
    asker.is_given_up = [this](const Asked &asked) { return asked.tries > options_.max_tries; };
    asker.next_head = [this] { return next_head(); };
    asker.send = send_;
    return asker;
}

void Session::step(double now_s)
{
    if (!send_ || !has_news_ || phase_ == Phase::kSettled) return;
    const bool is_quiet = now_s - last_news_s_ >= options_.quiet_s;
    if (!is_quiet && now_s - last_plan_s_ < options_.longest_wait_s) return;
    last_plan_s_ = now_s;

    if (phase_ == Phase::kGather) {
        bool is_waiting = ask_missing_parts(now_s);
        is_waiting = ask_labels(now_s) || is_waiting;
        if (!rival_) is_waiting = ask_blocks(is_waiting, now_s) || is_waiting;
        if (is_waiting || !is_source_done(now_s)) return;
        settle();
        if (views().empty()) return;
        tile_plan_ = plan_overhead(model_, options_.overhead);
        asked_tiles_.clear();
        phase_ = Phase::kOverhead;
    }
    if (phase_ == Phase::kOverhead && !ask_tiles(now_s))
        phase_ = options_.with_shapes && !rival_ ? Phase::kSilhouettes : Phase::kSettled;
    if (phase_ == Phase::kSilhouettes && !shapes_.ask_silhouettes(assembler_, asker(now_s))) phase_ = Phase::kTextures;
    if (phase_ == Phase::kTextures && !shapes_.ask_textures(model_, views(), assembler_, asker(now_s)))
        phase_ = Phase::kSettled;
}

} // namespace outcrop
