// SPDX-License-Identifier: BSD-3-Clause
#include "paired.h"

#include <algorithm>
#include <chrono>
#include <iomanip>
#include <sstream>

#include "rivals.h"

namespace outcrop::bench {

namespace {

// The literal method is slow where there is much to see: as few pairs as this once they have taken this long.
constexpr std::size_t kLiteralPairs = 3;
constexpr double kLiteralEnoughMs = 1500;

template <class Detector>
double time_ms(Detector &detector, const cv::Mat &grey)
{
    const auto start = std::chrono::steady_clock::now();
    detector.detect(grey);
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

double median(std::vector<double> values)
{
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

void take_literal(PairedRow &row, const PairedOptions &options)
{
    const cv::Mat &grey = row.picture.grey;
    Judoca fixed(grey.size(), fixed_params()), literal(grey.size(), literal_params());
    row.n_literal = literal.detect(grey);
    fixed.detect(grey);
    std::vector<double> times, ratios;
    double sum_ms = 0;
    while (ratios.size() < options.n_pairs && (ratios.size() < kLiteralPairs || sum_ms < kLiteralEnoughMs)) {
        const double ours_ms = time_ms(fixed, grey);
        times.push_back(time_ms(literal, grey));
        ratios.push_back(times.back() / ours_ms);
        sum_ms += times.back();
    }
    row.literal_ms = median(times);
    row.literal_per_fixed = median(ratios);
}

// Stages without a clock inside the detector: with a threshold that hardly any pixel passes only the gradient is left,
// with the fewest candidates only the fits are gone.
void take_stages(PairedRow &row)
{
    oc_judoca_params_t gradient = fixed_params(), places = fixed_params();
    gradient.t_b = 100.0f;
    places.max_candidates = 16;
    const cv::Mat &grey = row.picture.grey;
    Judoca first(grey.size(), gradient), second(grey.size(), places);
    std::vector<double> gradient_ms, places_ms;
    for (int i = 0; i < 9; i++) {
        gradient_ms.push_back(time_ms(first, grey));
        places_ms.push_back(time_ms(second, grey));
    }
    row.gradient_ms = median(gradient_ms);
    row.places_ms = median(places_ms);
}

std::string figure(double value, int digits)
{
    std::ostringstream text;
    if (value > 0)
        text << std::fixed << std::setprecision(digits) << value;
    else
        text << '-';
    return text.str();
}

// "1.5 [1.2]"
std::string text_of(const Target &target)
{
    return target.ratio > 0 ? figure(target.ratio, 1) + " [" + figure(target.stretch, 1) + "]" : "-";
}

// "yes" when the target is met, "stretch" when the better one is.
const char *verdict(double ratio, const Target &target)
{
    if (target.ratio == 0) return "";
    if (ratio <= target.stretch) return "stretch";
    return ratio <= target.ratio ? "yes" : "NO";
}

} // namespace

Target target_of(const Picture &picture)
{
    switch (picture.kind) {
    case Kind::kStructured: return picture.grey.cols > 640 ? Target{1.3, 1.0, 0} : Target{1.5, 1.2, 0};
    case Kind::kNatural: return {2.5, 2.0, 50};
    case Kind::kNoise: break;
    }
    return {};
}

PairedRow take_pairs(const Picture &picture, const PairedOptions &options)
{
    PairedRow row;
    row.picture = picture;
    row.n_pairs = options.n_pairs;
    const cv::Mat &grey = picture.grey;
    BlurCanny canny;
    Judoca ours(grey.size(), oc_judoca_defaults()), fixed(grey.size(), fixed_params());
    for (int i = 0; i < 2; i++) { // caches and pages
        canny.detect(grey);
        row.n_ours = ours.detect(grey);
        row.n_fixed = fixed.detect(grey);
    }
    std::vector<double> canny_ms, ours_ms, fixed_ms, ours_ratio, fixed_ratio;
    for (std::size_t i = 0; i < options.n_pairs; i++) {
        ours_ms.push_back(time_ms(ours, grey));
        canny_ms.push_back(time_ms(canny, grey));
        ours_ratio.push_back(ours_ms.back() / canny_ms.back());
        fixed_ms.push_back(time_ms(fixed, grey));
        canny_ms.push_back(time_ms(canny, grey));
        fixed_ratio.push_back(fixed_ms.back() / canny_ms.back());
    }
    row.canny_ms = median(canny_ms);
    row.ours_ms = median(ours_ms);
    row.fixed_ms = median(fixed_ms);
    row.ours_per_canny = median(ours_ratio);
    row.fixed_per_canny = median(fixed_ratio);
    take_stages(row);
    if (options.has_literal) take_literal(row, options);
    return row;
}

void print_table(std::ostream &out, const std::vector<PairedRow> &rows)
{
    out << "ours: defaults; fixed: lambda 10, sigma 1.2, t_B 6, s_J 0.6; ratios to GaussianBlur(1.2)+Canny(48, 48, L2),\n"
           "medians over pairs. gradient, places: of fixed, time up to the edge maps and up to the fits.\n";
    out << std::left << std::setw(28) << "image" << std::right << std::setw(10) << "size";
    for (const char *head : {"Canny ms", "ours ms", "ratio", "fixed ms", "ratio", "target", "met", "gradient", "places",
                             "found", "literal ms", "lit/fixed"})
        out << std::setw(11) << head;
    out << '\n';
    for (const PairedRow &row : rows) {
        const Target target = target_of(row.picture);
        const cv::Mat &grey = row.picture.grey;
        out << std::left << std::setw(28) << row.picture.name << std::right << std::setw(10)
            << std::to_string(grey.cols) + "x" + std::to_string(grey.rows);
        for (const std::string &cell :
             {figure(row.canny_ms, 2), figure(row.ours_ms, 2), figure(row.ours_per_canny, 2), figure(row.fixed_ms, 2),
              figure(row.fixed_per_canny, 2), text_of(target), std::string(verdict(row.fixed_per_canny, target)),
              figure(row.gradient_ms, 2), figure(row.places_ms, 2), std::to_string(row.n_fixed),
              figure(row.literal_ms, 1), figure(row.literal_per_fixed, 1)})
            out << std::setw(11) << cell;
        out << '\n';
    }
}

nlohmann::json to_json(const PairedRow &row)
{
    const Target target = target_of(row.picture);
    nlohmann::json made = {
        {"image", row.picture.name},
        {"kind", name_of(row.picture.kind)},
        {"width_px", row.picture.grey.cols},
        {"height_px", row.picture.grey.rows},
        {"pairs", row.n_pairs},
        {"blur_canny_ms", row.canny_ms},
        {"ours_ms", row.ours_ms},
        {"ours_ratio", row.ours_per_canny},
        {"ours_junctions", row.n_ours},
        {"fixed_ms", row.fixed_ms},
        {"fixed_ratio", row.fixed_per_canny},
        {"fixed_junctions", row.n_fixed},
        {"fixed_gradient_ms", row.gradient_ms},
        {"fixed_places_ms", row.places_ms},
    };
    if (target.ratio > 0) made["target"] = {{"ratio", target.ratio}, {"stretch", target.stretch}};
    if (row.literal_ms > 0) {
        made["literal_ms"] = row.literal_ms;
        made["literal_per_fixed"] = row.literal_per_fixed;
        made["literal_junctions"] = row.n_literal;
    }
    return made;
}

} // namespace outcrop::bench
