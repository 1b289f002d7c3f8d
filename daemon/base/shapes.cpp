// SPDX-License-Identifier: BSD-3-Clause
// Silhouettes of every obstacle first; textures only where silhouettes say that there is something.
#include "shapes.h"

namespace outcrop {

void ShapeDesk::plan(const SiteModel &model, const std::map<int, View> &views)
{
    silhouettes_ = plan_silhouettes(model, views, options_);
    textures_.clear();
    are_textures_planned_ = false;
    asked_silhouettes_.clear();
    asked_textures_.clear();
}

bool ShapeDesk::ask_silhouettes(const PacketAssembler &assembler, const Asker &asker)
{
    bool is_waiting = false;
    for (std::size_t p = 0; p < silhouettes_.size(); p++) {
        const SilhouettePlan &plan = silhouettes_[p];
        oc_silhouette_request_t left = plan.request;
        bool is_any = false;
        for (std::size_t v = 0; v < left.n_views; v++) {
            if (!left.views[v].is_wanted) continue;
            bool has_all = true;
            for (std::size_t b = 0; b < plan.obstacle.size(); b++) {
                const SilhouetteKey key{left.views[v].view, plan.key, static_cast<std::uint8_t>(b)};
                if (plan.obstacle[b] >= 0 && assembler.silhouettes().count(key) == 0) has_all = false;
            }
            left.views[v].is_wanted = !has_all;
            is_any = is_any || !has_all;
        }
        Asked &asked = asked_silhouettes_[p];
        if (!is_any || asker.is_given_up(asked)) continue;
        is_waiting = true;
        if (!asker.may_ask(&asked)) continue;
        const oc_packet_head_t head = asker.next_head();
        std::uint8_t buf[OC_MAX_DATAGRAM_BYTES];
        std::size_t n_bytes = 0;
        std::uint16_t key = 0;
        if (oc_packet_encode_silhouette_request(&head, &left, buf, options_.datagram_bytes, &n_bytes, &key) == OC_OK)
            asker.send(buf, n_bytes);
    }
    return is_waiting;
}

bool ShapeDesk::ask_textures(const SiteModel &model, const std::map<int, View> &views, const PacketAssembler &assembler,
                             const Asker &asker)
{
    if (!options_.with_textures) return false;
    if (!are_textures_planned_) {
        textures_ = plan_textures(model, gather_labels(model, views, assembler), options_);
        are_textures_planned_ = true;
    }
    bool is_waiting = false;
    for (const TexturePlan &plan : textures_) {
        oc_texture_request_t left = plan.request;
        left.n_tiles = 0;
        for (std::size_t i = 0; i < plan.request.n_tiles; i++) {
            const TextureKey key{left.view, left.step_px, left.tile_px, plan.request.tiles[i]};
            if (assembler.textures().count(key) == 0) left.tiles[left.n_tiles++] = plan.request.tiles[i];
        }
        Asked &asked = asked_textures_[left.view];
        if (left.n_tiles == 0 || asker.is_given_up(asked)) continue;
        is_waiting = true;
        if (!asker.may_ask(&asked)) continue;
        for (std::size_t at = 0; at < left.n_tiles;) {
            oc_texture_request_t some = left;
            some.n_tiles = static_cast<std::uint16_t>(left.n_tiles - at);
            std::copy(left.tiles + at, left.tiles + left.n_tiles, some.tiles);
            const oc_packet_head_t head = asker.next_head();
            std::uint8_t buf[OC_MAX_DATAGRAM_BYTES];
            std::size_t n_bytes = 0;
            std::uint16_t taken = 0;
            if (oc_packet_encode_texture_request(&head, &some, buf, options_.datagram_bytes, &n_bytes, &taken) !=
                    OC_OK ||
                taken == 0)
                break;
            asker.send(buf, n_bytes);
            at += taken;
        }
    }
    return is_waiting;
}

std::vector<std::vector<CarveView>> ShapeDesk::gather_labels(const SiteModel &model, const std::map<int, View> &views,
                                                             const PacketAssembler &assembler) const
{
    std::vector<std::vector<CarveView>> all;
    for (std::size_t i = 0; i < model.obstacles.size(); i++)
        all.push_back(gather_silhouettes(model, views, silhouettes_, assembler.silhouettes(), static_cast<int>(i)));
    return all;
}

std::vector<std::vector<CarveView>> ShapeDesk::gather(const SiteModel &model, const std::map<int, View> &views,
                                                      const PacketAssembler &assembler, int *n_bad) const
{
    *n_bad = 0;
    auto all = gather_labels(model, views, assembler);
    if (!options_.with_textures) return all;
    const std::vector<TexturePlan> plans = plan_textures(model, all, options_);
    for (std::vector<CarveView> &of_obstacle : all)
        *n_bad += gather_textures(assembler.textures(), plans, options_, &of_obstacle);
    return all;
}

} // namespace outcrop
