// SPDX-License-Identifier: BSD-3-Clause
// All figures of one run, and how they are shown.
#include "report.h"

#include <iomanip>
#include <sstream>

namespace outcrop::eval {

namespace {

using Out = nlohmann::ordered_json;

Out maybe(const std::optional<double> &x)
{
    return x ? Out(*x) : Out(nullptr);
}

Out share_json(const std::optional<ShareMetric> &m, bool has_recall)
{
    if (!m) return nullptr;
    Out o = {{"n", m->n}, {"correct", m->correct}, {"precision", maybe(m->precision)}};
    if (has_recall) {
        o["recall"] = maybe(m->recall);
        o["obstacle_as_ground"] = maybe(m->obstacle_as_ground);
    }
    return o;
}

void put_boxes(const std::optional<BoxMetrics> &m, Out &out)
{
    for (const char *key : {"boxes", "missed", "missed_truths", "false", "false_boxes", "duplicates"})
        out[key] = nullptr;
    if (!m) return;
    out["boxes"] = Out::array();
    for (const BoxMetric &b : m->boxes)
        out["boxes"].push_back({{"truth", b.truth},
                                {"name", b.name},
                                {"found", b.found ? Out(*b.found) : Out(nullptr)},
                                {"iou", b.iou},
                                {"obb_iou", b.obb_iou},
                                {"yaw_error_deg", maybe(b.yaw_error_deg)},
                                {"centre_error_m", maybe(b.centre_error_m)}});
    out["missed"] = m->missed.size();
    out["missed_truths"] = m->missed;
    out["false"] = m->false_boxes.size();
    out["false_boxes"] = m->false_boxes;
    out["duplicates"] = m->duplicates;
}

void put_voxels(const std::optional<std::vector<VoxelMetric>> &m, Out &out)
{
    out["voxels"] = out["hull"] = nullptr;
    if (!m) return;
    out["voxels"] = out["hull"] = Out::array();
    for (const VoxelMetric &v : *m) {
        out["voxels"].push_back({{"truth", v.truth}, {"iou", v.iou}, {"chamfer_m", maybe(v.chamfer_m)}});
        out["hull"].push_back({{"truth", v.truth}, {"iou", maybe(v.hull_iou)}});
    }
}

Out sequence_json(const std::optional<SequenceMetrics> &m)
{
    if (!m) return nullptr;
    return {{"frames", m->frames},
            {"psnr_db", m->psnr_db},
            {"ssim", m->ssim},
            {"psnr_obstacle_db", maybe(m->psnr_obstacle_db)},
            {"psnr_ground_db", maybe(m->psnr_ground_db)},
            {"psnr_ground_limit_db", maybe(m->psnr_ground_limit_db)},
            {"mask_iou", maybe(m->mask_iou)},
            {"mask_iou_obstacle", maybe(m->mask_iou_obstacle)},
            {"flicker", maybe(m->flicker)},
            {"flicker_truth", maybe(m->flicker_truth)}};
}

// Rows of text; columns as wide as their widest cell, numbers to the right.
class Table {
public:
    void row(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
    std::string text() const
    {
        std::vector<std::size_t> width;
        for (const auto &r : rows_)
            for (std::size_t i = 0; i < r.size(); i++) {
                if (width.size() <= i) width.push_back(0);
                width[i] = std::max(width[i], r[i].size());
            }
        std::ostringstream out;
        for (const auto &r : rows_) {
            for (std::size_t i = 0; i < r.size(); i++)
                out << (i ? "  " : "") << (i ? std::right : std::left) << std::setw(static_cast<int>(width[i])) << r[i];
            out << '\n';
        }
        return out.str();
    }

private:
    std::vector<std::vector<std::string>> rows_;
};

std::string number(const std::optional<double> &x, int digits, const char *unit = "")
{
    if (!x) return "-";
    std::ostringstream out;
    out << std::fixed << std::setprecision(digits) << *x << unit;
    return out.str();
}

std::string percent(const std::optional<double> &x)
{
    return x ? number(*x * 100, 1, " %") : "-";
}

std::string share_table(const Report &r)
{
    Table t;
    t.row({"", "n", "correct", "precision", "recall", "obstacle as ground"});
    const auto add = [&](const char *name, const std::optional<ShareMetric> &m) {
        if (!m) return t.row({name, "-", "-", "-", "-", "-"});
        t.row({name, std::to_string(m->n), std::to_string(m->correct), percent(m->precision), percent(m->recall),
               percent(m->obstacle_as_ground)});
    };
    add("obstacle matches", r.matches);
    add("ground", r.ground);
    return t.text();
}

std::string box_table(const BoxMetrics &m)
{
    Table t;
    t.row({"obstacle", "box", "IoU", "yaw IoU", "yaw off", "centre off"});
    for (const BoxMetric &b : m.boxes)
        t.row({std::to_string(b.truth) + " " + b.name, b.found ? std::to_string(*b.found) : "-", number(b.iou, 3),
               number(b.obb_iou, 3), number(b.yaw_error_deg, 1, " deg"), number(b.centre_error_m, 4, " m")});
    std::ostringstream out;
    out << t.text() << "missed " << m.missed.size() << ", false " << m.false_boxes.size() << ", duplicates "
        << m.duplicates.size() << '\n';
    return out.str();
}

std::string voxel_table(const std::vector<VoxelMetric> &m)
{
    Table t;
    t.row({"voxels of", "IoU", "chamfer", "hull IoU"});
    for (const VoxelMetric &v : m)
        t.row({std::to_string(v.truth), number(v.iou, 3), number(v.chamfer_m, 4, " m"), number(v.hull_iou, 3)});
    return t.text();
}

std::string sequence_table(const Sequences &sequences)
{
    Table t;
    t.row({"sequence", "frames", "PSNR dB", "SSIM", "obstacle dB", "ground dB", "(limit)", "mask IoU", "each",
           "flicker", "(true)"});
    for (const auto &[as, m] : sequences) {
        if (!m) {
            t.row({as, "-"});
            continue;
        }
        t.row({as, std::to_string(m->frames), number(m->psnr_db, 2), number(m->ssim, 4), number(m->psnr_obstacle_db, 2),
               number(m->psnr_ground_db, 2), number(m->psnr_ground_limit_db, 2), number(m->mask_iou, 3),
               number(m->mask_iou_obstacle, 3), number(m->flicker, 2), number(m->flicker_truth, 2)});
    }
    return t.text();
}

std::string byte_table(const Json &bytes)
{
    Table t;
    std::vector<std::string> names{"layer"}, counts{"bytes"};
    for (const auto &[name, count] : bytes.items()) {
        names.push_back(name);
        counts.push_back(count.dump());
    }
    t.row(names);
    t.row(counts);
    return t.text();
}

} // namespace

nlohmann::ordered_json to_json(const Report &r)
{
    Out out;
    out["matches"] = share_json(r.matches, false);
    out["ground"] = share_json(r.ground, true);
    put_boxes(r.boxes, out);
    put_voxels(r.voxels, out);
    out["poses"] = r.poses ? Out{{"n", r.poses->n},
                                 {"position_rmse_m", r.poses->position_rmse_m},
                                 {"angle_rmse_deg", r.poses->angle_rmse_deg}}
                           : Out(nullptr);
    out["sequence"] = nullptr;
    if (r.sequences) {
        out["sequence"] = Out::object();
        for (const auto &[as, m] : *r.sequences) out["sequence"][as] = sequence_json(m);
    }
    out["footprint"] = r.footprint ? Out{{"cell_m", r.footprint->cell_m},
                                         {"covered", maybe(r.footprint->covered)},
                                         {"false_free_m2", r.footprint->false_free_m2},
                                         {"free_recall", maybe(r.footprint->free_recall)}}
                                   : Out(nullptr);
    out["bytes"] = r.bytes ? Out(*r.bytes) : Out(nullptr);
    return out;
}

std::string to_table(const Report &r)
{
    std::ostringstream out;
    out << share_table(r) << '\n';
    out << (r.boxes ? box_table(*r.boxes) : "boxes -\n") << '\n';
    if (r.voxels) out << voxel_table(*r.voxels) << '\n';
    out << (r.poses
                ? "poses off by " + number(r.poses->position_rmse_m * 1e3, 2, " mm, ") +
                      number(r.poses->angle_rmse_deg, 3, " deg (RMSE of ") + std::to_string(r.poses->n) + " views)\n"
                : "poses -\n");
    if (r.footprint)
        out << "footprint covered " << percent(r.footprint->covered) << ", shown free "
            << number(r.footprint->false_free_m2, 4, " m2") << ", free ground shown free "
            << percent(r.footprint->free_recall) << '\n';
    else
        out << "footprint -\n";
    out << '\n' << (r.sequences ? sequence_table(*r.sequences) : "sequence -\n") << '\n';
    out << (r.bytes ? byte_table(*r.bytes) : "bytes -\n");
    return out.str();
}

} // namespace outcrop::eval
