// SPDX-License-Identifier: BSD-3-Clause
// How near the written frames come to what the virtual camera really sees.
#include "metrics_sequence.h"

#include "ground_view.h"
#include "image_file.h"
#include "image_quality.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace outcrop::eval {

namespace fs = std::filesystem;

namespace {

cv::Mat grey_of(const cv::Mat &image)
{
    cv::Mat grey;
    cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
    return grey;
}

// What one frame of the path is compared with; made once for all sequences.
struct FrameTruth {
    cv::Mat image;    // BGR
    cv::Mat mask;     // codes; empty when the site has none
    cv::Mat ground;   // 255 on true ground
    cv::Mat obstacle; // 255 on any obstacle
    std::optional<GroundView> overhead;
    cv::Mat flow, steady; // to the frame before; where both see ground
};

FrameTruth load_frame(const Truth &truth, std::size_t i, const FrameTruth *before)
{
    const TrueFrame &frame = (*truth.frames)[i];
    FrameTruth f;
    f.image = read_image(frame.image, cv::IMREAD_COLOR);
    const cv::Size size(frame.camera.width, frame.camera.height);
    if (f.image.size() != size) throw EvalError(frame.image, "size differs from path.json's");
    if (frame.mask.empty()) return f;
    f.mask = read_codes(frame.mask);
    if (f.mask.size() != size) throw EvalError(frame.mask, "size differs from path.json's");
    f.ground = ground_pixels(f.mask, frame.camera);
    cv::inRange(f.mask, 1, kMaskLitter - 1, f.obstacle);
    if (truth.overhead) {
        f.overhead = warp_overhead(*truth.overhead, frame.camera);
        f.overhead->known &= f.ground;
    }
    if (!before || before->ground.empty()) return f;
    f.flow = ground_flow(frame.camera, (*truth.frames)[i - 1].camera);
    cv::remap(before->ground, f.steady, f.flow, cv::noArray(), cv::INTER_NEAREST);
    f.steady &= f.ground;
    return f;
}

// Mean |now - before moved over the ground| over all frames.
class Flicker {
public:
    void add(const cv::Mat &image, const FrameTruth &f)
    {
        const cv::Mat grey = grey_of(image);
        if (!before_.empty() && !f.flow.empty()) {
            cv::Mat moved;
            cv::remap(before_, moved, f.flow, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
            sum_ += cv::norm(grey, moved, cv::NORM_L1, f.steady);
            n_ += cv::countNonZero(f.steady);
        }
        before_ = grey;
    }
    std::optional<double> mean() const
    {
        if (n_ == 0) return std::nullopt;
        return sum_ / static_cast<double>(n_);
    }

private:
    cv::Mat before_;
    double sum_ = 0;
    long n_ = 0;
};

struct Overlap {
    long common = 0, whole = 0;

    void add(const cv::Mat &a, const cv::Mat &b)
    {
        common += cv::countNonZero(a & b);
        whole += cv::countNonZero(a | b);
    }
    std::optional<double> iou() const
    {
        if (whole == 0) return std::nullopt;
        return static_cast<double>(common) / static_cast<double>(whole);
    }
};

// One sequence, frame by frame.
class Accumulator {
public:
    Accumulator(fs::path dir, bool has_masks) : dir_(std::move(dir)), has_masks_(has_masks) {}

    // False when the frame is not of the path's size.
    bool add(std::size_t i, const FrameTruth &f, const Truth &truth, const BoxMetrics *boxes)
    {
        const cv::Mat image = read_image(dir_ / numbered("frame_", i), cv::IMREAD_COLOR);
        if (image.size() != f.image.size()) return false;
        frames_++;
        whole_.add(image, f.image);
        ssim_sum_ += ssim(image, f.image);
        flicker_.add(image, f);
        flicker_truth_.add(f.image, f);
        if (!f.obstacle.empty()) obstacle_.add(image, f.image, f.obstacle);
        if (f.overhead) {
            ground_.add(image, f.overhead->image, f.overhead->known);
            ground_limit_.add(f.image, f.overhead->image, f.overhead->known);
        }
        return !has_masks_ || f.mask.empty() || add_mask(i, f, truth, boxes);
    }

    SequenceMetrics finish() const
    {
        SequenceMetrics m;
        m.frames = frames_;
        m.psnr_db = whole_.psnr_db().value_or(0);
        m.ssim = ssim_sum_ / frames_;
        m.psnr_obstacle_db = obstacle_.psnr_db();
        m.psnr_ground_db = ground_.psnr_db();
        m.psnr_ground_limit_db = ground_limit_.psnr_db();
        m.mask_iou = any_.iou();
        m.mask_iou_obstacle = mean_iou();
        m.flicker = flicker_.mean();
        m.flicker_truth = flicker_truth_.mean();
        return m;
    }

private:
    bool add_mask(std::size_t i, const FrameTruth &f, const Truth &truth, const BoxMetrics *boxes)
    {
        const cv::Mat mask = read_codes(dir_ / numbered("mask_", i));
        if (mask.size() != f.mask.size()) return false;
        cv::Mat ours;
        cv::inRange(mask, 1, kMaskLitter - 1, ours);
        any_.add(ours, f.obstacle);
        if (!boxes || !truth.obstacles) return true;
        for (const BoxMetric &box : boxes->boxes) {
            const cv::Mat one = box.found ? cv::Mat(mask == *box.found) : cv::Mat::zeros(mask.size(), CV_8U);
            each_[box.truth].add(one, f.mask == box.truth);
        }
        return true;
    }

    std::optional<double> mean_iou() const
    {
        double sum = 0;
        int n = 0;
        for (const auto &[index, overlap] : each_) {
            if (!overlap.iou()) continue; // never in sight, and we never drew it
            sum += *overlap.iou();
            n++;
        }
        return n > 0 ? std::optional(sum / n) : std::nullopt;
    }

    fs::path dir_;
    bool has_masks_;
    int frames_ = 0;
    double ssim_sum_ = 0;
    SquaredError whole_, obstacle_, ground_, ground_limit_;
    Overlap any_;
    std::map<int, Overlap> each_;
    Flicker flicker_, flicker_truth_;
};

int count_numbered(const fs::path &dir, const std::string &stem)
{
    int n = 0;
    for (const auto &entry : fs::directory_iterator(dir)) {
        const std::string name = entry.path().filename().string();
        n += name.rfind(stem, 0) == 0 && entry.path().extension() == ".png";
    }
    return n;
}

bool has_all(const fs::path &dir, const std::string &stem, std::size_t n)
{
    if (static_cast<std::size_t>(count_numbered(dir, stem)) != n) return false;
    for (std::size_t i = 0; i < n; i++)
        if (!fs::exists(dir / numbered(stem, i))) return false;
    return true;
}

// The sequences whose files are those of the path, ready to accumulate.
std::map<std::string, Accumulator> open_sequences(const Truth &truth, const Run &run, Sequences &out, Notes &notes)
{
    std::map<std::string, Accumulator> open;
    const std::size_t n = truth.frames->size();
    for (const std::string &as : run.sequences) {
        const fs::path dir = run.dir / "sequence" / as;
        out[as] = std::nullopt;
        if (!has_all(dir, "frame_", n)) {
            notes.push_back(dir.string() + " does not hold the " + std::to_string(n) +
                            " frames of the site's path: sequence." + as + " is null");
            continue;
        }
        const bool has_masks = has_all(dir, "mask_", n);
        if (!has_masks) notes.push_back(dir.string() + " does not hold all masks: mask_iou is null");
        open.emplace(as, Accumulator(dir, has_masks));
    }
    return open;
}

} // namespace

std::optional<Sequences> evaluate_sequences(const Truth &truth, const Run &run, const std::optional<BoxMetrics> &boxes,
                                            Notes &notes)
{
    if (!truth.frames || run.sequences.empty()) return std::nullopt;
    Sequences out;
    auto open = open_sequences(truth, run, out, notes);
    FrameTruth before;
    for (std::size_t i = 0; i < truth.frames->size() && !open.empty(); i++) {
        const FrameTruth frame = load_frame(truth, i, i > 0 ? &before : nullptr);
        for (auto it = open.begin(); it != open.end();) {
            if (it->second.add(i, frame, truth, boxes ? &*boxes : nullptr)) {
                ++it;
                continue;
            }
            notes.push_back("sequence." + it->first + " is null: frame or mask " + std::to_string(i) +
                            " is not of the path's size");
            it = open.erase(it);
        }
        before = frame;
    }
    for (const auto &[as, accumulator] : open) out[as] = accumulator.finish();
    return out;
}

} // namespace outcrop::eval
