// SPDX-License-Identifier: BSD-3-Clause
// Homographic correlation of junctions: planes from branches, warps, scores.
#include "site/correlate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "core/homography.h"
#include "core/mat3.h"

namespace outcrop {
namespace {

constexpr int kMaxWindow = 31;
constexpr double kSadFullScale = 64; // grey levels of mean difference that score 0
constexpr double kTan30 = 0.57735;
constexpr double kSameWarp = 0.08;    // two planes whose local warps differ by less are one
constexpr float kWedgeSlackPx = 1.0F; // the edges' own blur belongs to the wedge

using Window = std::array<float, kMaxWindow * kMaxWindow>;

int coarse_step(int window_px)
{
    return std::max(1, (window_px / 2) / (PreparedView::kCoarseSide / 2));
}

// Samples of `to` under H, on the side x side grid of given step round (x, y) of the source.
void warp(const PreparedView &to, const double H[9], double x_px, double y_px, int side, int step, float out[])
{
    // Written round the apex, so that floats keep their precision.
    const double w0 = H[6] * x_px + H[7] * y_px + H[8];
    const double s = 1.0 / w0;
    const auto u0 = static_cast<float>((H[0] * x_px + H[1] * y_px + H[2]) * s);
    const auto v0 = static_cast<float>((H[3] * x_px + H[4] * y_px + H[5]) * s);
    std::array<float, 9> h{};
    for (std::size_t i = 0; i < 9; i++) h[i] = static_cast<float>(H[i] * s);
    // u - u0 = ((h0 - u0 h6) dx + (h1 - u0 h7) dy) / (1 + h6 dx + h7 dy)
    const float ux = h[0] - u0 * h[6];
    const float uy = h[1] - u0 * h[7];
    const float vx = h[3] - v0 * h[6];
    const float vy = h[4] - v0 * h[7];

    const int r = side / 2;
    for (int j = -r; j <= r; j++) {
        const auto dy = static_cast<float>(j * step);
        for (int i = -r; i <= r; i++) {
            const auto dx = static_cast<float>(i * step);
            const float w = 1.0F + h[6] * dx + h[7] * dy;
            *out++ = w > 0.1F ? to.sample(u0 + (ux * dx + uy * dy) / w, v0 + (vx * dx + vy * dy) / w) : -1.0F;
        }
    }
}

// Weighted sums over the samples that both have.
struct Sums {
    float w = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
};

Sums sum_known(const float a[], const float b[], const float weight[], int n)
{
    Sums s;
    for (int i = 0; i < n; i++) {
        const float w = a[i] >= 0 && b[i] >= 0 ? weight[i] : 0.0F;
        // Centred on mid grey: the squares stay small enough for floats.
        const float x = a[i] - 128.0F;
        const float y = b[i] - 128.0F;
        s.w += w;
        s.a += w * x;
        s.b += w * y;
        s.aa += w * x * x;
        s.bb += w * y * y;
        s.ab += w * x * y;
    }
    return s;
}

// Nothing when less than min_weight is known in both or one of them is flat.
std::optional<double> vnc(const float a[], const float b[], const float weight[], int n, double min_weight,
                          double min_contrast)
{
    const Sums s = sum_known(a, b, weight, n);
    if (!(s.w > 0) || s.w < min_weight) return std::nullopt;
    const double va = s.aa / s.w - (s.a / s.w) * (s.a / s.w);
    const double vb = s.bb / s.w - (s.b / s.w) * (s.b / s.w);
    if (!(va > min_contrast * min_contrast) || !(vb > min_contrast * min_contrast)) return std::nullopt;
    return (s.ab / s.w - (s.a / s.w) * (s.b / s.w)) / std::sqrt(va * vb);
}

std::optional<double> sad(const float a[], const float b[], const float weight[], int n, double min_weight,
                          double min_contrast)
{
    const Sums s = sum_known(a, b, weight, n);
    if (!(s.w > 0) || s.w < min_weight) return std::nullopt;
    const double va = s.aa / s.w - (s.a / s.w) * (s.a / s.w);
    if (!(va > min_contrast * min_contrast)) return std::nullopt;
    const float offset = (s.a - s.b) / s.w;
    double total = 0;
    for (int i = 0; i < n; i++) {
        if (a[i] >= 0 && b[i] >= 0) total += weight[i] * std::abs(a[i] - b[i] - offset);
    }
    return std::max(0.0, 1.0 - total / s.w / kSadFullScale);
}

std::optional<double> measure(Measure which, const float a[], const float b[], const float weight[], int n,
                              double min_weight, double min_contrast)
{
    return which == Measure::kVnc ? vnc(a, b, weight, n, min_weight, min_contrast)
                                  : sad(a, b, weight, n, min_weight, min_contrast);
}

double total_of(const float weight[], int n)
{
    double total = 0;
    for (int i = 0; i < n; i++) total += weight[i];
    return total;
}

std::vector<float> window_weights(const CorrelateOptions &options)
{
    const int r = options.window_px / 2;
    std::vector<float> weights;
    for (int y = -r; y <= r; y++) {
        for (int x = -r; x <= r; x++) {
            const double s = options.gauss_sigma_px;
            weights.push_back(s > 0 ? static_cast<float>(std::exp(-0.5 * (x * x + y * y) / (s * s))) : 1.0F);
        }
    }
    return weights;
}

// Weights of a grid of samples, `side` squared and `step` pixels apart, outside the wedge between two branches set to 0.
void cut_wedge(double angle_a, double angle_b, int side, float step, const float weights[], float out[])
{
    auto ax = static_cast<float>(std::cos(angle_a));
    auto ay = static_cast<float>(std::sin(angle_a));
    auto bx = static_cast<float>(std::cos(angle_b));
    auto by = static_cast<float>(std::sin(angle_b));
    if (ax * by - ay * bx < 0) { // a to b the short way round
        std::swap(ax, bx);
        std::swap(ay, by);
    }
    const int r = side / 2;
    std::size_t i = 0;
    for (int y = -r; y <= r; y++) {
        for (int x = -r; x <= r; x++, i++) {
            const float px = static_cast<float>(x) * step;
            const float py = static_cast<float>(y) * step;
            const bool inside = ax * py - ay * px >= -kWedgeSlackPx && px * by - py * bx >= -kWedgeSlackPx;
            out[i] = inside ? weights[i] : 0.0F;
        }
    }
}

void check(const CorrelateOptions &o)
{
    const bool ok = o.window_px >= 7 && o.window_px <= kMaxWindow && o.window_px % 2 == 1 && o.gauss_sigma_px >= 0 &&
                    o.smooth_sigma_px >= 0 && o.smooth_sigma_px <= 5 && o.min_known > 0 && o.min_known <= 1 &&
                    o.min_contrast >= 0 && o.min_sine > 0 && o.min_bend_sine > 0 && o.max_scale >= 1 &&
                    o.max_stretch >= 1 && o.max_fine >= 1;
    if (!ok) throw std::invalid_argument("correlation: an option is out of range");
}

} // namespace

// ---- a view made ready ----

PreparedView::PreparedView(const PosedView &posed, const CorrelateOptions &options)
    : posed_(posed), n_patch_(static_cast<std::size_t>(options.window_px) * options.window_px)
{
    check(options);
    if (posed.view == nullptr) throw std::invalid_argument("PreparedView: no view");
    const cv::Size size(static_cast<int>(posed.camera.k.width_px), static_cast<int>(posed.camera.k.height_px));
    if (posed.view->grey.size() != size || posed.view->known.size() != size) {
        throw std::invalid_argument("PreparedView: the pixels do not have the camera's size");
    }
    prepare_pixels(options.smooth_sigma_px);
    prepare_junctions(options);
}

void PreparedView::prepare_pixels(double smooth_sigma_px)
{
    const cv::Mat1b &known = posed_.view->known;
    const cv::Mat1b is_known = known > 0;
    posed_.view->grey.convertTo(grey_, CV_32F);
    if (smooth_sigma_px > 0) {
        // Normalised: unknown pixels neither darken nor brighten their neighbours.
        cv::Mat1f share;
        is_known.convertTo(share, CV_32F, 1.0 / 255.0);
        grey_ = grey_.mul(share);
        cv::GaussianBlur(grey_, grey_, cv::Size(), smooth_sigma_px, smooth_sigma_px, cv::BORDER_REPLICATE);
        cv::GaussianBlur(share, share, cv::Size(), smooth_sigma_px, smooth_sigma_px, cv::BORDER_REPLICATE);
        grey_ /= cv::max(share, 1e-3F);
        cv::min(grey_, 255.0, grey_);
    }
    is_known_ = cv::Mat1b::zeros(known.size());
    for (int y = 0; y + 1 < known.rows; y++) {
        for (int x = 0; x + 1 < known.cols; x++) {
            is_known_(y, x) = is_known(y, x) & is_known(y, x + 1) & is_known(y + 1, x) & is_known(y + 1, x + 1);
        }
    }
}

void PreparedView::prepare_junctions(const CorrelateOptions &options)
{
    const std::vector<oc_junction_t> &junctions = posed_.view->junctions;
    weights_ = window_weights(options);
    const double min_weight = options.min_known * total_of(weights_.data(), static_cast<int>(n_patch_));
    const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    edges_.resize(junctions.size() * OC_MAX_BRANCHES);
    patches_.resize(junctions.size() * n_patch_);
    coarse_.resize(junctions.size() * kCoarse);
    for (std::size_t i = 0; i < junctions.size(); i++) {
        const oc_junction_t &junction = junctions[i];
        for (std::size_t k = 0; k < junction.n_branches && k < OC_MAX_BRANCHES; k++) {
            const oc_edge2_t edge{junction.x_px, junction.y_px, junction.branch[k].angle_rad};
            oc_edge_prepare(&posed_.camera, &edge, &edges_[i * OC_MAX_BRANCHES + k]);
        }
        float *patch = &patches_[i * n_patch_];
        warp(*this, identity, junction.x_px, junction.y_px, options.window_px, 1, patch);
        warp(*this, identity, junction.x_px, junction.y_px, kCoarseSide, coarse_step(options.window_px),
             &coarse_[i * kCoarse]);
        // A window correlates with itself exactly when enough of it is known and it is not flat.
        is_usable_.push_back(
            vnc(patch, patch, weights_.data(), static_cast<int>(n_patch_), min_weight, options.min_contrast) ? 1 : 0);
    }
}

// ---- planes ----

struct Correlator::Hypothesis {
    oc_plane_t plane{};
    std::array<double, 9> H{}; // right from left, anchored unless told otherwise
    std::array<double, 9> H_back{};
    std::array<double, 4> J{};
    int left_branch[2] = {-1, -1}; // that span the plane; -1: an extra plane
    int right_branch[2] = {-1, -1};
    double coarse = 0;
};

namespace {

bool is_sane_warp(const std::array<double, 4> &J, const CorrelateOptions &options)
{
    const double det = J[0] * J[3] - J[1] * J[2];
    if (!(det > 0)) return false;
    const double scale2 = options.max_scale * options.max_scale;
    if (!(det < scale2 && det * scale2 > 1)) return false;
    // Singular values s1 s2 = det, s1^2 + s2^2 = |J|^2.
    const double norm2 = J[0] * J[0] + J[1] * J[1] + J[2] * J[2] + J[3] * J[3];
    const double k = options.max_stretch;
    return norm2 <= det * (k + 1 / k);
}

bool is_same_warp(const std::array<double, 4> &a, const std::array<double, 4> &b)
{
    double worst = 0;
    for (std::size_t i = 0; i < 4; i++) worst = std::max(worst, std::abs(a[i] - b[i]));
    return worst < kSameWarp;
}

// An upright plane's normal turned by 30 degrees towards a side.
Eigen::Vector3d turned(const Eigen::Vector3d &normal, const Eigen::Vector3d &side)
{
    return (normal + kTan30 * side).normalized();
}

double turn(const oc_junction_t &junction, int from, int to)
{
    return std::sin(static_cast<double>(junction.branch[to].angle_rad) - junction.branch[from].angle_rad);
}

} // namespace

Correlator::Correlator(const PreparedView &left, const PreparedView &right, const oc_pair_t &pair,
                       const CorrelateOptions &options)
    : left_(left), right_(right), pair_(pair), options_(options), weights_(window_weights(options))
{
    check(options);
    oc_pose_centre(&pair.left.pose, left_centre_.data());
    oc_pose_centre(&pair.right.pose, right_centre_.data());
}

// Homography of the hypothesis' plane; false when it cannot be what both cameras see.
bool Correlator::complete(int left, int right, Hypothesis *hypothesis) const
{
    const oc_plane_t &plane = hypothesis->plane;
    const double at_left = oc_vec3_dot(plane.n, left_centre_.data()) + plane.d_m;
    const double at_right = oc_vec3_dot(plane.n, right_centre_.data()) + plane.d_m;
    if (!(at_left * at_right > 0)) return false;

    // H = H_inf - e' (M^-T n)^T / (n . C + d), thesis Eq 5.30 in world form.
    double n_px[3];
    oc_mat3_mul_vec_t(pair_.left_ray, plane.n, n_px);
    double H[9];
    for (int i = 0; i < 9; i++) H[i] = pair_.H_inf[i] - pair_.e_right[i / 3] * n_px[i % 3] / at_left;

    const oc_junction_t &l = left_.junction(left);
    const oc_junction_t &r = right_.junction(right);
    if (oc_homography_jacobian(H, l.x_px, l.y_px, hypothesis->J.data()) != OC_OK) return false;
    if (!is_sane_warp(hypothesis->J, options_)) return false;
    if (options_.warp == Warp::kUnanchored) {
        std::copy(H, H + 9, hypothesis->H.begin());
    } else if (oc_homography_anchor(H, l.x_px, l.y_px, r.x_px, r.y_px, hypothesis->H.data()) != OC_OK) {
        return false;
    }
    return oc_mat3_inverse(hypothesis->H.data(), hypothesis->H_back.data()) == OC_OK;
}

void Correlator::add_branch_planes(int left, int right, const Eigen::Vector3d &point, Hypotheses *out) const
{
    const oc_junction_t &l = left_.junction(left);
    const oc_junction_t &r = right_.junction(right);
    const int n_left = std::min<int>(l.n_branches, OC_MAX_BRANCHES);
    const int n_right = std::min<int>(r.n_branches, OC_MAX_BRANCHES);
    // Edges in space of every left branch with every right one.
    struct Edge {
        int left, right;
        oc_edge_direction_t direction;
    };
    std::vector<Edge> edges;
    for (int a = 0; a < n_left; a++) {
        for (int b = 0; b < n_right; b++) {
            Edge edge{a, b, {}};
            if (oc_edge_direction(&left_.edges(left)[a], &right_.edges(right)[b], &edge.direction) != OC_OK) continue;
            if (edge.direction.agrees && edge.direction.sine >= options_.min_sine) edges.push_back(edge);
        }
    }
    for (std::size_t i = 0; i < edges.size(); i++) {
        for (std::size_t k = i + 1; k < edges.size(); k++) {
            const Edge &a = edges[i];
            const Edge &b = edges[k];
            if (a.left == b.left || a.right == b.right) continue;
            // One straight edge, the bar of a T say: any plane through it would do.
            if (oc_junction_is_straight(&l.branch[a.left], &l.branch[b.left]) ||
                oc_junction_is_straight(&r.branch[a.right], &r.branch[b.right]))
                continue;
            // The order round the apex is the same from either camera on one side of the plane.
            if (!(turn(l, a.left, b.left) * turn(r, a.right, b.right) > 0)) continue;
            const double cosine = oc_vec3_dot(a.direction.d, b.direction.d);
            if (1 - cosine * cosine < options_.min_bend_sine * options_.min_bend_sine) continue;
            Hypothesis hypothesis;
            if (oc_plane_from_directions(a.direction.d, b.direction.d, point.data(), &hypothesis.plane) != OC_OK)
                continue;
            if (!complete(left, right, &hypothesis)) continue;
            const bool is_new = std::none_of(out->begin(), out->end(),
                                             [&](const Hypothesis &h) { return is_same_warp(h.J, hypothesis.J); });
            if (!is_new && options_.support == Support::kWindow) continue;
            hypothesis.left_branch[0] = a.left;
            hypothesis.left_branch[1] = b.left;
            hypothesis.right_branch[0] = a.right;
            hypothesis.right_branch[1] = b.right;
            out->push_back(hypothesis);
        }
    }
}

// Obstacles have level tops and upright faces more often than not; and where
// branches give no plane, one that faces both cameras is the least wrong.
void Correlator::add_extra_planes(int left, int right, const Eigen::Vector3d &point, Hypotheses *out) const
{
    const Eigen::Vector3d facing =
        ((left_centre_ - point).normalized() + (right_centre_ - point).normalized()).normalized();
    const Eigen::Vector3d upright = Eigen::Vector3d(facing.x(), facing.y(), 0).normalized();
    const Eigen::Vector3d side(-upright.y(), upright.x(), 0);
    for (const Eigen::Vector3d &normal :
         {Eigen::Vector3d(0, 0, 1), upright, facing, turned(upright, side), turned(upright, Eigen::Vector3d(-side))}) {
        if (!normal.allFinite()) continue;
        Hypothesis hypothesis;
        Eigen::Vector3d::Map(hypothesis.plane.n) = normal;
        hypothesis.plane.d_m = -normal.dot(point);
        if (!complete(left, right, &hypothesis)) continue;
        const bool is_new = std::none_of(out->begin(), out->end(),
                                         [&](const Hypothesis &h) { return is_same_warp(h.J, hypothesis.J); });
        if (is_new) out->push_back(hypothesis);
    }
}

// ---- scores ----

double Correlator::coarse_score(int left, const Hypothesis &hypothesis) const
{
    static const std::vector<float> ones(PreparedView::kCoarse, 1.0F);
    const oc_junction_t &l = left_.junction(left);
    std::array<float, PreparedView::kCoarse> samples;
    warp(right_, hypothesis.H.data(), l.x_px, l.y_px, PreparedView::kCoarseSide, coarse_step(options_.window_px),
         samples.data());
    const float *weight = ones.data();
    std::array<float, PreparedView::kCoarse> cut;
    if (options_.support == Support::kWedge && hypothesis.left_branch[0] >= 0) {
        cut_wedge(l.branch[hypothesis.left_branch[0]].angle_rad, l.branch[hypothesis.left_branch[1]].angle_rad,
                  PreparedView::kCoarseSide, coarse_step(options_.window_px), ones.data(), cut.data());
        weight = cut.data();
    }
    const double min_weight = options_.min_known * total_of(weight, PreparedView::kCoarse);
    return vnc(left_.coarse_patch(left), samples.data(), weight, PreparedView::kCoarse, min_weight, 0).value_or(-1);
}

double Correlator::full_score(int left, int right, const Hypothesis &hypothesis, double to_beat) const
{
    const int n = options_.window_px * options_.window_px;
    const oc_junction_t &l = left_.junction(left);
    const oc_junction_t &r = right_.junction(right);
    const bool is_wedge = options_.support == Support::kWedge && hypothesis.left_branch[0] >= 0;

    Window samples;
    Window cut;
    const float *weight = weights_.data();
    if (is_wedge) {
        cut_wedge(l.branch[hypothesis.left_branch[0]].angle_rad, l.branch[hypothesis.left_branch[1]].angle_rad,
                  options_.window_px, 1, weights_.data(), cut.data());
        weight = cut.data();
    }
    warp(right_, hypothesis.H.data(), l.x_px, l.y_px, options_.window_px, 1, samples.data());
    const std::optional<double> forth = measure(options_.measure, left_.patch(left), samples.data(), weight, n,
                                                options_.min_known * total_of(weight, n), options_.min_contrast);
    if (!forth || *forth <= to_beat) return -1;

    if (is_wedge) {
        cut_wedge(r.branch[hypothesis.right_branch[0]].angle_rad, r.branch[hypothesis.right_branch[1]].angle_rad,
                  options_.window_px, 1, weights_.data(), cut.data());
    }
    warp(left_, hypothesis.H_back.data(), r.x_px, r.y_px, options_.window_px, 1, samples.data());
    const std::optional<double> back = measure(options_.measure, right_.patch(right), samples.data(), weight, n,
                                               options_.min_known * total_of(weight, n), options_.min_contrast);
    return back ? std::min(*forth, *back) : -1;
}

std::optional<Correlation> Correlator::correlate_upright(int left, int right, const Eigen::Vector3d &point) const
{
    const int n = options_.window_px * options_.window_px;
    const std::optional<double> score =
        measure(options_.measure, left_.patch(left), right_.patch(right), weights_.data(), n,
                options_.min_known * total_of(weights_.data(), n), options_.min_contrast);
    if (!score) return std::nullopt;
    Correlation result;
    result.score = *score;
    const Eigen::Vector3d facing = (left_centre_ - point).normalized();
    Eigen::Vector3d::Map(result.plane.n) = facing;
    result.plane.d_m = -facing.dot(point);
    return result;
}

std::optional<Correlation> Correlator::correlate(int left, int right, const Eigen::Vector3d &point) const
{
    if (!left_.is_usable(left) || !right_.is_usable(right)) return std::nullopt;
    if (options_.warp == Warp::kNone) return correlate_upright(left, right, point);

    Hypotheses hypotheses;
    add_branch_planes(left, right, point, &hypotheses);
    if (options_.with_extra_planes) add_extra_planes(left, right, point, &hypotheses);

    // Two levels: a sparse sample of every plane, the full window for the best of them.
    const bool is_sampled = options_.measure == Measure::kVnc;
    if (is_sampled) {
        for (Hypothesis &h : hypotheses) h.coarse = coarse_score(left, h);
        std::stable_sort(hypotheses.begin(), hypotheses.end(),
                         [](const Hypothesis &a, const Hypothesis &b) { return a.coarse > b.coarse; });
    }
    std::optional<Correlation> best;
    int n_fine = 0;
    for (const Hypothesis &h : hypotheses) {
        if (is_sampled && (h.coarse < options_.coarse_reject || n_fine == options_.max_fine)) break;
        n_fine++;
        const double to_beat = best ? best->score : 0.0;
        const double score = full_score(left, right, h, to_beat);
        if (score > to_beat) best = Correlation{score, h.plane};
    }
    return best;
}

std::optional<double> Correlator::score_on_plane(int left, int right, const oc_plane_t &plane) const
{
    Hypothesis hypothesis;
    hypothesis.plane = plane;
    if (!complete(left, right, &hypothesis)) return std::nullopt;
    const double score = full_score(left, right, hypothesis, -1);
    if (score < 0) return std::nullopt;
    return score;
}

std::optional<double> correlate_warped(const PreparedView &from, int junction, const PreparedView &to,
                                       const double to_from_from[9], const CorrelateOptions &options)
{
    const int n = options.window_px * options.window_px;
    const std::vector<float> &weights = from.weights();
    Window samples;
    const oc_junction_t &j = from.junction(junction);
    warp(to, to_from_from, j.x_px, j.y_px, options.window_px, 1, samples.data());
    return vnc(from.patch(junction), samples.data(), weights.data(), n, options.min_known * total_of(weights.data(), n),
               options.min_contrast);
}

} // namespace outcrop
