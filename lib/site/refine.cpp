// SPDX-License-Identifier: BSD-3-Clause
// Refinement of all poses at once: bundle adjustment with the sensors' margins as priors and the ground at Z = 0.
#include "site/refine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include "site/components.h"

namespace outcrop {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using RowMatrix3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

struct Pixel {
    int view = 0;
    double x_px = 0, y_px = 0;
};

// A point with its sightings; on the ground it has no Z of its own.
struct Point {
    bool is_ground = false;
    Vector3d position = Vector3d::Zero();
    std::vector<Pixel> pixels;
};

// What is solved for, per view: moves of the centre and a turn, both zero at the sensor's pose.
struct PoseState {
    std::array<double, 3> move{0, 0, 0}, turn{0, 0, 0};
    bool is_held = false;  // margins say that the pose is exact
    bool is_fixed = false; // too few sightings: not solved for
    int n_sightings = 0;
    Matrix6d prior = Matrix6d::Identity(); // covariance
};

// ---- residuals ----

struct CameraTerm {
    const oc_camera_t *camera;
    Vector3d centre;
    double x_px, y_px, sigma_px;

    template <typename T>
    bool operator()(const T *move, const T *turn, const T *point, T *residual) const
    {
        const double *r = camera->pose.R;
        T off[3], at_rest[3], in_cam[3];
        for (int i = 0; i < 3; ++i) off[i] = point[i] - centre[i] - move[i];
        for (int i = 0; i < 3; ++i) at_rest[i] = r[3 * i] * off[0] + r[3 * i + 1] * off[1] + r[3 * i + 2] * off[2];
        ceres::AngleAxisRotatePoint(turn, at_rest, in_cam);
        if (!(in_cam[2] > T(1e-9))) return false;
        residual[0] = (camera->k.fx_px * in_cam[0] / in_cam[2] + camera->k.cx_px - x_px) / sigma_px;
        residual[1] = (camera->k.fy_px * in_cam[1] / in_cam[2] + camera->k.cy_px - y_px) / sigma_px;
        return true;
    }
};

struct GroundTerm {
    CameraTerm term;

    template <typename T>
    bool operator()(const T *move, const T *turn, const T *xy, T *residual) const
    {
        const T point[3] = {xy[0], xy[1], T(0)};
        return term(move, turn, point, residual);
    }
};

struct PriorTerm {
    Matrix6d root; // of the information

    template <typename T>
    bool operator()(const T *move, const T *turn, T *residual) const
    {
        Eigen::Matrix<T, 6, 1> x;
        x << move[0], move[1], move[2], turn[0], turn[1], turn[2];
        Eigen::Map<Eigen::Matrix<T, 6, 1>> out(residual);
        out = root.cast<T>() * x;
        return true;
    }
};

struct FlatTerm {
    double sigma_m;

    template <typename T>
    bool operator()(const T *point, T *residual) const
    {
        residual[0] = point[2] / sigma_m;
        return true;
    }
};

oc_camera_t moved(const oc_camera_t &camera, const PoseState &state)
{
    const Vector3d turn(state.turn[0], state.turn[1], state.turn[2]);
    const double angle = turn.norm();
    const Matrix3d by = angle > 0 ? Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() : Matrix3d::Identity();
    const Vector3d centre = camera_centre(camera) + Vector3d(state.move[0], state.move[1], state.move[2]);
    // Back on the manifold, so that repeated refinement does not let R drift from a rotation.
    const Matrix3d rotation = Eigen::Quaterniond(by * camera_rotation(camera)).normalized().toRotationMatrix();
    oc_camera_t result = camera;
    const RowMatrix3d rows = rotation;
    oc_pose_from_centre(rows.data(), centre.data(), &result.pose);
    return result;
}

// ---- ground points from ties ----

// Gives positions of one view that are nearer than the limit the same node.
class TieNodes {
public:
    TieNodes(std::size_t n_views, double merge_px) : merge_px_(merge_px), of_view_(n_views) {}

    int node(int view, double x_px, double y_px)
    {
        for (const int i : of_view_[static_cast<std::size_t>(view)]) {
            const Pixel &p = pixels_[static_cast<std::size_t>(i)];
            if (std::hypot(p.x_px - x_px, p.y_px - y_px) < merge_px_) return i;
        }
        pixels_.push_back({view, x_px, y_px});
        const int index = static_cast<int>(pixels_.size()) - 1;
        of_view_[static_cast<std::size_t>(view)].push_back(index);
        return index;
    }
    const std::vector<Pixel> &pixels() const { return pixels_; }

private:
    double merge_px_;
    std::vector<Pixel> pixels_;
    std::vector<std::vector<int>> of_view_;
};

std::vector<Point> points_of_ties(const std::vector<View> &views, double merge_px)
{
    std::map<int, int> index;
    for (std::size_t i = 0; i < views.size(); ++i) index[views[i].id] = static_cast<int>(i);
    TieNodes nodes(views.size(), merge_px);
    std::vector<std::pair<int, int>> edges;
    for (std::size_t i = 0; i < views.size(); ++i) {
        for (const oc_tie_t &tie : views[i].ties) {
            const auto ref = index.find(tie.ref_view);
            if (ref == index.end() || ref->second == static_cast<int>(i)) continue;
            const int own =
                nodes.node(static_cast<int>(i), static_cast<double>(tie.x_px), static_cast<double>(tie.y_px));
            const int other =
                nodes.node(ref->second, static_cast<double>(tie.ref_x_px), static_cast<double>(tie.ref_y_px));
            edges.emplace_back(own, other);
        }
    }
    std::vector<int> view_of;
    for (const Pixel &p : nodes.pixels()) view_of.push_back(p.view);
    ViewComponents components(view_of);
    for (const auto &[a, b] : edges) components.join(a, b);
    std::map<int, Point> by_root;
    for (std::size_t i = 0; i < nodes.pixels().size(); ++i)
        by_root[components.root(static_cast<int>(i))].pixels.push_back(nodes.pixels()[i]);
    std::vector<Point> points;
    for (auto &[root, point] : by_root) {
        point.is_ground = true;
        if (point.pixels.size() >= 2) points.push_back(std::move(point));
    }
    return points;
}

std::vector<Point> points_of_tracks(const std::vector<View> &views, const std::vector<Track> &tracks)
{
    std::vector<Point> points;
    for (const Track &track : tracks) {
        Point point;
        point.is_ground = track.kind == MatchKind::kGround;
        for (const TrackPixel &p : track.pixels) {
            const oc_junction_t &j =
                views[static_cast<std::size_t>(p.view)].junctions[static_cast<std::size_t>(p.junction)];
            point.pixels.push_back({p.view, static_cast<double>(j.x_px), static_cast<double>(j.y_px)});
        }
        if (point.pixels.size() >= 2) points.push_back(std::move(point));
    }
    return points;
}

// ---- the adjustment ----

class Adjustment {
public:
    Adjustment(const std::vector<View> &views, const RefineOptions &options) : views_(views), options_(options)
    {
        for (const View &view : views) {
            PoseState state;
            state.is_held = true;
            for (const double half_width : view.margin.v)
                if (!(half_width < options.exact_sigma)) state.is_held = false;
            state.prior = pose_covariance(view.camera, view.margin, options.exact_sigma);
            states_.push_back(state);
            centres_.push_back(camera_centre(view.camera));
            cameras_.push_back(view.camera);
        }
    }

    void add(std::vector<Point> points)
    {
        std::vector<Point> placed;
        for (Point &point : points)
            if (place(&point)) placed.push_back(std::move(point));
        std::stable_sort(placed.begin(), placed.end(),
                         [](const Point &a, const Point &b) { return a.pixels.size() > b.pixels.size(); });
        for (Point &point : placed)
            if (is_wanted(point)) points_.push_back(std::move(point));
    }

    bool solve();
    int reject(RefineResult *result);
    void fill(RefineResult *result) const;

private:
    bool is_wanted(const Point &point);
    bool place(Point *point) const;
    void count_sightings();
    void add_point(Point *point, ceres::Problem *problem, ceres::LossFunction *loss);
    void add_priors(ceres::Problem *problem);
    double residual_sigmas(const Pixel &pixel, const Vector3d &position, const std::vector<oc_camera_t> &cameras) const;
    std::vector<double> costs(const std::vector<oc_camera_t> &cameras, bool replace_points, double *rms) const;
    Vector3d replaced(const Point &point, const std::vector<oc_camera_t> &cameras) const;
    std::vector<int> free_views() const;
    Eigen::MatrixXd information(const std::vector<int> &free) const;
    Eigen::MatrixXd without_gauge(const std::vector<int> &free, const Eigen::MatrixXd &covariance) const;
    void fill_view(std::size_t i, double cost_before, double cost_after, RefineResult *result) const;

    const std::vector<View> &views_;
    const RefineOptions &options_;
    std::vector<PoseState> states_;
    std::vector<Vector3d> centres_;
    std::vector<oc_camera_t> cameras_; // as refined so far
    std::vector<Point> points_;
    std::map<std::pair<bool, int>, int> n_taken_; // sightings by kind (ground) and view
    bool is_solved_ = false;
};

// Nearest point of the rays, or the mean of where they meet the ground. False when it is not in front of all.
Vector3d Adjustment::replaced(const Point &point, const std::vector<oc_camera_t> &cameras) const
{
    const Vector3d nowhere = Vector3d::Constant(std::nan(""));
    if (!point.is_ground) {
        std::vector<Sighting> sightings;
        for (const Pixel &p : point.pixels)
            sightings.push_back({&cameras[static_cast<std::size_t>(p.view)], p.x_px, p.y_px, nullptr});
        TriangulateOptions options;
        options.min_parallax_rad = 0.005;
        const std::optional<Triangulated> result = triangulate(sightings, options);
        return result ? result->point : nowhere;
    }
    Vector3d sum = Vector3d::Zero();
    double weights = 0;
    for (const Pixel &p : point.pixels) {
        const oc_camera_t &camera = cameras[static_cast<std::size_t>(p.view)];
        Vector3d ray;
        oc_camera_ray(&camera, p.x_px, p.y_px, ray.data());
        const Vector3d centre = camera_centre(camera);
        const double reach = -centre.z() / ray.z();
        if (!(reach > 0) || !std::isfinite(reach)) return nowhere;
        const double weight = ray.z() * ray.z() / (reach * reach); // flat and far rays say little
        sum += weight * (centre + reach * ray);
        weights += weight;
    }
    sum /= weights;
    sum.z() = 0;
    return sum;
}

// Has a view of the point too few sightings of its kind? Counts it if so.
bool Adjustment::is_wanted(const Point &point)
{
    bool is_wanted = options_.sightings_per_view == 0;
    for (const Pixel &p : point.pixels)
        is_wanted = is_wanted || n_taken_[{point.is_ground, p.view}] < options_.sightings_per_view;
    if (!is_wanted) return false;
    for (const Pixel &p : point.pixels) ++n_taken_[{point.is_ground, p.view}];
    return true;
}

bool Adjustment::place(Point *point) const
{
    point->position = replaced(*point, cameras_);
    if (!point->position.allFinite()) return false;
    for (const Pixel &p : point->pixels)
        if (!project_with_derivatives(cameras_[static_cast<std::size_t>(p.view)], point->position, nullptr, nullptr,
                                      nullptr))
            return false;
    return true;
}

void Adjustment::count_sightings()
{
    for (PoseState &state : states_) state.n_sightings = 0;
    for (const Point &point : points_)
        for (const Pixel &p : point.pixels) ++states_[static_cast<std::size_t>(p.view)].n_sightings;
    for (PoseState &state : states_) state.is_fixed = state.is_held || state.n_sightings < options_.min_sightings;
}

void Adjustment::add_point(Point *point, ceres::Problem *problem, ceres::LossFunction *loss)
{
    double *position = point->position.data();
    const bool is_flat = point->is_ground && !(options_.ground_sigma_m > 0);
    for (const Pixel &p : point->pixels) {
        const std::size_t view = static_cast<std::size_t>(p.view);
        const CameraTerm term{&views_[view].camera, centres_[view], p.x_px, p.y_px, options_.sigma_px};
        PoseState &state = states_[view];
        ceres::CostFunction *cost =
            is_flat ? static_cast<ceres::CostFunction *>(
                          new ceres::AutoDiffCostFunction<GroundTerm, 2, 3, 3, 2>(new GroundTerm{term}))
                    : new ceres::AutoDiffCostFunction<CameraTerm, 2, 3, 3, 3>(new CameraTerm(term));
        problem->AddResidualBlock(cost, loss, state.move.data(), state.turn.data(), position);
    }
    if (point->is_ground && !is_flat)
        problem->AddResidualBlock(
            new ceres::AutoDiffCostFunction<FlatTerm, 1, 3>(new FlatTerm{options_.ground_sigma_m}), nullptr, position);
}

void Adjustment::add_priors(ceres::Problem *problem)
{
    for (PoseState &state : states_) {
        if (state.n_sightings == 0) continue;
        if (state.is_fixed) {
            problem->SetParameterBlockConstant(state.move.data());
            problem->SetParameterBlockConstant(state.turn.data());
            continue;
        }
        const Matrix6d lower = state.prior.llt().matrixL();
        PriorTerm *term = new PriorTerm{lower.triangularView<Eigen::Lower>().solve(Matrix6d::Identity())};
        problem->AddResidualBlock(new ceres::AutoDiffCostFunction<PriorTerm, 6, 3, 3>(term), nullptr, state.move.data(),
                                  state.turn.data());
    }
}

bool Adjustment::solve()
{
    count_sightings();
    if (points_.empty()) return false;
    ceres::Problem::Options problem_options;
    problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::CauchyLoss loss(options_.loss_sigmas);
    ceres::Problem problem(problem_options);
    auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    for (Point &point : points_) {
        add_point(&point, &problem, &loss);
        ordering->AddElementToGroup(point.position.data(), 0);
    }
    add_priors(&problem);
    bool has_free = false;
    for (PoseState &state : states_) {
        if (state.n_sightings == 0) continue;
        has_free = has_free || !state.is_fixed;
        ordering->AddElementToGroup(state.move.data(), 1);
        ordering->AddElementToGroup(state.turn.data(), 1);
    }
    if (!has_free) return false;
    ceres::Solver::Options solver;
    solver.linear_solver_type = views_.size() <= 120 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    solver.linear_solver_ordering = ordering;
    solver.num_threads = 1;
    solver.max_num_iterations = options_.max_iterations;
    solver.function_tolerance = 1e-8;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    is_solved_ = summary.IsSolutionUsable();
    if (!is_solved_) return false;
    for (std::size_t i = 0; i < views_.size(); ++i)
        cameras_[i] = states_[i].is_fixed ? views_[i].camera : moved(views_[i].camera, states_[i]);
    return true;
}

double Adjustment::residual_sigmas(const Pixel &pixel, const Vector3d &position,
                                   const std::vector<oc_camera_t> &cameras) const
{
    Vector2d projected;
    if (!project_with_derivatives(cameras[static_cast<std::size_t>(pixel.view)], position, &projected, nullptr,
                                  nullptr))
        return 1e9;
    return (Vector2d(pixel.x_px, pixel.y_px) - projected).norm() / options_.sigma_px;
}

int Adjustment::reject(RefineResult *result)
{
    int n_rejected = 0;
    std::vector<Point> kept;
    for (Point &point : points_) {
        std::vector<Pixel> good;
        for (const Pixel &p : point.pixels)
            if (residual_sigmas(p, point.position, cameras_) <= options_.reject_sigmas) good.push_back(p);
        const std::size_t before = point.pixels.size();
        point.pixels = good.size() >= 2 ? good : std::vector<Pixel>();
        n_rejected += static_cast<int>(before - point.pixels.size());
        if (point.is_ground) {
            result->n_ground_sightings += static_cast<int>(before);
            result->n_ground_rejected += static_cast<int>(before - point.pixels.size());
        }
        if (!point.pixels.empty()) kept.push_back(std::move(point));
    }
    points_ = std::move(kept);
    return n_rejected;
}

// Robust cost per view, and the RMS pixel error of all sightings.
std::vector<double> Adjustment::costs(const std::vector<oc_camera_t> &cameras, bool replace_points, double *rms) const
{
    std::vector<double> cost(views_.size(), 0);
    double sum = 0;
    int n = 0;
    const double scale = options_.loss_sigmas * options_.loss_sigmas;
    for (const Point &point : points_) {
        const Vector3d position = replace_points ? replaced(point, cameras) : point.position;
        if (!position.allFinite()) continue;
        for (const Pixel &p : point.pixels) {
            const double r = residual_sigmas(p, position, cameras);
            cost[static_cast<std::size_t>(p.view)] += scale * std::log1p(r * r / scale);
            sum += r * r * options_.sigma_px * options_.sigma_px;
            ++n;
        }
    }
    *rms = n > 0 ? std::sqrt(sum / (2.0 * n)) : 0;
    return cost;
}

std::vector<int> Adjustment::free_views() const
{
    std::vector<int> free;
    for (std::size_t i = 0; i < states_.size(); ++i)
        if (!states_[i].is_fixed) free.push_back(static_cast<int>(i));
    return free;
}

// Information of the free poses once the points are marginalised (Schur complement), robust weights included.
Eigen::MatrixXd Adjustment::information(const std::vector<int> &free) const
{
    std::vector<int> slot(views_.size(), -1);
    for (std::size_t i = 0; i < free.size(); ++i) slot[static_cast<std::size_t>(free[i])] = static_cast<int>(i);
    Eigen::MatrixXd total = Eigen::MatrixXd::Zero(6 * static_cast<int>(free.size()), 6 * static_cast<int>(free.size()));
    for (std::size_t i = 0; i < free.size(); ++i)
        total.block<6, 6>(6 * static_cast<int>(i), 6 * static_cast<int>(i)) =
            states_[static_cast<std::size_t>(free[i])].prior.inverse();
    const double scale = options_.loss_sigmas * options_.loss_sigmas;
    for (const Point &point : points_) {
        std::vector<std::pair<int, Eigen::Matrix<double, 6, 3>>> cross;
        Matrix3d own = Matrix3d::Zero();
        if (point.is_ground) {
            const double sigma = options_.ground_sigma_m > 0 ? options_.ground_sigma_m : 1e-7;
            own(2, 2) = 1.0 / (sigma * sigma);
        }
        for (const Pixel &p : point.pixels) {
            Vector2d pixel;
            Eigen::Matrix<double, 2, 3> by_point;
            Matrix26d by_pose;
            if (!project_with_derivatives(cameras_[static_cast<std::size_t>(p.view)], point.position, &pixel, &by_point,
                                          &by_pose))
                continue;
            const double r = residual_sigmas(p, point.position, cameras_);
            const double weight = 1.0 / (1.0 + r * r / scale) / (options_.sigma_px * options_.sigma_px);
            own += weight * by_point.transpose() * by_point;
            const int at = slot[static_cast<std::size_t>(p.view)];
            if (at < 0) continue;
            total.block<6, 6>(6 * at, 6 * at) += weight * by_pose.transpose() * by_pose;
            cross.emplace_back(at, weight * by_pose.transpose() * by_point);
        }
        const Matrix3d inverse = own.inverse();
        if (!inverse.allFinite()) continue;
        for (const auto &[a, left] : cross)
            for (const auto &[b, right] : cross) total.block<6, 6>(6 * a, 6 * b) -= left * inverse * right.transpose();
    }
    return total;
}

// Takes out what moves all cameras alike over the plane (X, Y, yaw): it changes no picture.
Eigen::MatrixXd Adjustment::without_gauge(const std::vector<int> &free, const Eigen::MatrixXd &covariance) const
{
    const int n = static_cast<int>(free.size());
    Vector3d mean = Vector3d::Zero();
    for (const int view : free) mean += camera_centre(cameras_[static_cast<std::size_t>(view)]) / n;
    Eigen::MatrixXd gauge = Eigen::MatrixXd::Zero(6 * n, 3);
    Eigen::VectorXd weight(6 * n);
    for (int i = 0; i < n; ++i) {
        const std::size_t view = static_cast<std::size_t>(free[static_cast<std::size_t>(i)]);
        gauge(6 * i, 0) = 1;
        gauge(6 * i + 1, 1) = 1;
        gauge.block<3, 1>(6 * i, 2) = Vector3d::UnitZ().cross(camera_centre(cameras_[view]) - mean);
        gauge.block<3, 1>(6 * i + 3, 2) = -camera_rotation(cameras_[view]) * Vector3d::UnitZ();
        weight.segment<6>(6 * i) = states_[view].prior.diagonal().cwiseInverse();
    }
    const Eigen::MatrixXd weighted = weight.asDiagonal() * gauge;
    const Eigen::MatrixXd project = Eigen::MatrixXd::Identity(6 * n, 6 * n) -
                                    gauge * (gauge.transpose() * weighted).inverse() * weighted.transpose();
    return project * covariance * project.transpose();
}

// Above so many views the joint covariance is not worth its cubic cost; each view is then taken alone.
constexpr std::size_t kMaxJointViews = 200;

void Adjustment::fill_view(std::size_t i, double cost_before, double cost_after, RefineResult *result) const
{
    const Matrix6d &posterior = result->pose_covariances[i];
    const Matrix6d &relative = result->relative_covariances[i];
    RefinedView view;
    view.id = views_[i].id;
    view.camera = cameras_[i];
    const Matrix3d to_opk = rotation_by_opk(cameras_[i]).inverse();
    const Matrix3d angles = to_opk * posterior.bottomRightCorner<3, 3>() * to_opk.transpose();
    oc_margin_t matching;
    bool is_smaller = false;
    for (int k = 0; k < 6; ++k) {
        const double prior = views_[i].margin.v[k] / std::sqrt(3.0);
        const double variance = k < 3 ? posterior(k, k) : angles(k - 3, k - 3);
        // Near phi = +-90 degrees omega and kappa cannot be told apart; they are never worse than the sensor's.
        view.posterior.v[k] = variance >= 0 ? std::min(prior, std::sqrt(variance)) : prior;
        matching.v[k] = states_[i].is_held ? 0 : std::sqrt(3.0 * std::max(0.0, relative(k, k)));
        if (view.posterior.v[k] < 0.95 * prior) is_smaller = true;
    }
    view.is_improved = is_solved_ && !states_[i].is_fixed && is_smaller && cost_after < cost_before;
    result->views.push_back(view);
    result->matching_margins.push_back(matching);
}

void Adjustment::fill(RefineResult *result) const
{
    result->pose_covariances.clear();
    for (const PoseState &state : states_)
        result->pose_covariances.push_back(state.is_held ? Matrix6d(Matrix6d::Zero()) : state.prior);
    result->relative_covariances = result->pose_covariances;
    const std::vector<int> free = free_views();
    if (is_solved_ && !free.empty()) {
        const Eigen::MatrixXd total = information(free);
        const bool is_joint = free.size() <= kMaxJointViews;
        Eigen::MatrixXd joint, relative;
        if (is_joint) {
            joint = total.ldlt().solve(Eigen::MatrixXd::Identity(total.rows(), total.cols()));
            relative = free.size() == states_.size() ? without_gauge(free, joint) : joint;
        }
        for (std::size_t i = 0; i < free.size(); ++i) {
            const int at = 6 * static_cast<int>(i);
            const std::size_t view = static_cast<std::size_t>(free[i]);
            const Matrix6d alone =
                is_joint ? Matrix6d(joint.block<6, 6>(at, at)) : Matrix6d(total.block<6, 6>(at, at).inverse());
            if (!alone.allFinite()) continue;
            result->pose_covariances[view] = alone;
            result->relative_covariances[view] = is_joint ? Matrix6d(relative.block<6, 6>(at, at)) : alone;
        }
    }
    std::vector<oc_camera_t> sensor;
    for (const View &view : views_) sensor.push_back(view.camera);
    const std::vector<double> before = costs(sensor, true, &result->rms_before_px);
    const std::vector<double> after = costs(cameras_, false, &result->rms_after_px);
    for (std::size_t i = 0; i < views_.size(); ++i) fill_view(i, before[i], after[i], result);
    for (const Point &point : points_) ++(point.is_ground ? result->n_ground : result->n_points);
}

} // namespace

void RefineOptions::check() const
{
    if (!(sigma_px > 0) || !(loss_sigmas > 0) || !(reject_sigmas > 0) || !(exact_sigma > 0) || !(tie_merge_px > 0))
        throw std::invalid_argument("refine: sigmas and distances must be > 0");
    if (sightings_per_view < 0) throw std::invalid_argument("refine: sightings_per_view must be >= 0");
    if (!(ground_sigma_m >= 0) || max_iterations < 1 || min_sightings < 1)
        throw std::invalid_argument("refine: ground_sigma_m must be >= 0, counts >= 1");
}

RefineResult refine_poses(const std::vector<View> &views, const std::vector<Track> &tracks,
                          const RefineOptions &options)
{
    options.check();
    RefineResult result;
    Adjustment adjustment(views, options);
    if (options.use_ties) adjustment.add(points_of_ties(views, options.tie_merge_px));
    if (options.use_tracks) adjustment.add(points_of_tracks(views, tracks));
    if (adjustment.solve()) {
        result.n_rejected = adjustment.reject(&result);
        if (result.n_rejected > 0) adjustment.solve();
    }
    adjustment.fill(&result);
    return result;
}

} // namespace outcrop
