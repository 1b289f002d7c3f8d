// SPDX-License-Identifier: BSD-3-Clause
// Blocks round junctions with a candidate, less what is known.
#include "site/wanted_blocks.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "core/packet.h"

namespace outcrop {
namespace {

constexpr int kBlock = static_cast<int>(OC_BLOCK_PX);

int blocks_across(std::uint32_t side_px)
{
    return (static_cast<int>(side_px) + kBlock - 1) / kBlock;
}

// Of every junction of every view: with how many junctions of other views it may match.
std::vector<std::vector<int>> count_partners(const std::vector<PosedView> &views, const std::vector<ViewPair> &pairs,
                                             const Area &area, const StripOptions &strip)
{
    std::vector<std::vector<int>> partners(views.size());
    for (std::size_t i = 0; i < views.size(); i++) partners[i].resize(views[i].view->junctions.size(), 0);
    for (const ViewPair &pair : pairs) {
        const PosedView &left = views.at(pair.left);
        const PosedView &right = views.at(pair.right);
        oc_pair_t prepared;
        if (!prepare_pair(left, right, strip, &prepared)) continue;
        for (const Candidate &c : find_candidates(prepared, left, right, area, strip)) {
            if (c.is_rival) continue;
            partners[pair.left][c.left]++;
            partners[pair.right][c.right]++;
        }
    }
    return partners;
}

// Whether all pixels of a block inside the image have arrived.
bool is_known(const cv::Mat1b &known, int bx, int by)
{
    const cv::Rect block = cv::Rect(bx * kBlock, by * kBlock, kBlock, kBlock) & cv::Rect(0, 0, known.cols, known.rows);
    return cv::countNonZero(known(block)) == block.area();
}

void mark(const oc_junction_t &junction, int radius_px, int n_x, int n_y, std::vector<char> *wanted)
{
    const auto block_of = [](double coordinate, int n) {
        return static_cast<int>(std::clamp(coordinate / kBlock, 0.0, n - 1.0));
    };
    for (int by = block_of(junction.y_px - radius_px, n_y); by <= block_of(junction.y_px + radius_px, n_y); by++) {
        for (int bx = block_of(junction.x_px - radius_px, n_x); bx <= block_of(junction.x_px + radius_px, n_x); bx++) {
            (*wanted)[static_cast<std::size_t>(by) * n_x + bx] = 1;
        }
    }
}

WantedBlocks blocks_of(const PosedView &posed, const std::vector<int> &partners, const std::vector<std::uint8_t> *asked,
                       const WantedBlocksOptions &options)
{
    const View &view = *posed.view;
    const int n_x = blocks_across(view.camera.k.width_px);
    const int n_y = blocks_across(view.camera.k.height_px);
    const std::size_t n_blocks = static_cast<std::size_t>(n_x) * n_y;
    if (asked != nullptr && asked->size() != n_blocks) {
        throw std::invalid_argument("wanted_blocks: a table of asked blocks has the wrong size");
    }
    std::vector<int> order;
    for (std::size_t i = 0; i < partners.size(); i++) {
        if (partners[i] > 0) order.push_back(static_cast<int>(i));
    }
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return partners[a] > partners[b]; });
    if (static_cast<int>(order.size()) > options.max_per_view) order.resize(options.max_per_view);

    std::vector<char> wanted(n_blocks, 0);
    for (const int i : order) mark(view.junctions[i], options.radius_px, n_x, n_y, &wanted);
    WantedBlocks result;
    result.view = view.id;
    for (std::size_t b = 0; b < n_blocks; b++) {
        if (wanted[b] == 0 || (asked != nullptr && (*asked)[b] != 0)) continue;
        if (is_known(view.known, static_cast<int>(b) % n_x, static_cast<int>(b) / n_x)) continue;
        result.blocks.push_back(static_cast<std::uint16_t>(b));
    }
    return result;
}

} // namespace

std::vector<WantedBlocks> wanted_blocks(const std::vector<PosedView> &views, const std::vector<ViewPair> &pairs,
                                        const Area &area, const std::vector<std::vector<std::uint8_t>> &asked,
                                        const WantedBlocksOptions &options)
{
    if (options.radius_px < 0 || options.radius_px > 64 || options.max_per_view < 0) {
        throw std::invalid_argument("wanted_blocks: an option is out of range");
    }
    if (!asked.empty() && asked.size() != views.size()) {
        throw std::invalid_argument("wanted_blocks: one table of asked blocks per view, or none");
    }
    const std::vector<std::vector<int>> partners = count_partners(views, pairs, area, options.strip);
    std::vector<WantedBlocks> all;
    for (std::size_t i = 0; i < views.size(); i++) {
        WantedBlocks one = blocks_of(views[i], partners[i], asked.empty() ? nullptr : &asked[i], options);
        if (!one.blocks.empty()) all.push_back(std::move(one));
    }
    return all;
}

} // namespace outcrop
