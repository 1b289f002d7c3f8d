// SPDX-License-Identifier: BSD-3-Clause
// cameras.json in, cameras.json out.
#include "reported_site.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "core/camera.h"

namespace outcrop {
namespace {

namespace fs = std::filesystem;
using json = nlohmann::json;

constexpr double kPi = 3.14159265358979323846;

// Uniform in [-1, 1), the same on every standard library.
class Uniform {
public:
    explicit Uniform(unsigned seed) : engine_(seed) {}
    double next() { return static_cast<double>(engine_() >> 11) * 0x1p-52 - 1; }

private:
    std::mt19937_64 engine_;
};

json read_json(const fs::path &file)
{
    std::ifstream in(file);
    if (!in) throw std::runtime_error(file.string() + ": cannot be read");
    try {
        return json::parse(in);
    } catch (const json::exception &fault) {
        throw std::runtime_error(file.string() + ": " + fault.what());
    }
}

fs::path image_path(const fs::path &folder, const std::string &name, const std::string &images)
{
    if (images.empty()) return fs::absolute(folder / name);
    const fs::path stem = fs::path(name).stem();
    for (const char *extension : {".png", ".jpg", ".jpeg"}) {
        const fs::path candidate = folder / images / (stem.string() + extension);
        if (fs::exists(candidate)) return fs::absolute(candidate);
    }
    throw std::runtime_error((folder / images / stem).string() + ": no such picture (.png, .jpg or .jpeg)");
}

oc_pose_t pose_of(const json &view, double metres_per_unit)
{
    oc_pose_t pose;
    for (std::size_t i = 0; i < 9; i++) pose.R[i] = view.at("R").at(i / 3).at(i % 3).get<double>();
    for (std::size_t i = 0; i < 3; i++) pose.t[i] = view.at("t").at(i).get<double>() * metres_per_unit;
    if (!oc_pose_is_valid(&pose)) throw std::runtime_error("\"R\" is not a rotation");
    return pose;
}

void put_pose(json *view, const oc_pose_t &pose, double metres_per_unit)
{
    double centre[3];
    oc_pose_centre(&pose, centre);
    for (std::size_t i = 0; i < 9; i++) (*view)["R"][i / 3][i % 3] = pose.R[i];
    for (std::size_t i = 0; i < 3; i++) {
        (*view)["t"][i] = pose.t[i] / metres_per_unit;
        (*view)["C"][i] = centre[i] / metres_per_unit;
    }
}

// Moves poses inside the margins; the same seed moves them alike.
class PoseMover {
public:
    PoseMover(const Perturbation &perturbation, double position_m, double angle_rad)
        : kind_(perturbation.kind), uniform_(perturbation.seed)
    {
        for (int i = 0; i < 6; i++) {
            margin_[i] = i < 3 ? position_m : angle_rad;
            common_[i] = uniform_.next() * margin_[i];
        }
    }

    // A wrong mount turns about the camera's axes, which some views see as more than its share of a world axis: shrinks
    // it until it is inside the margins of all of them.
    void fit_mount(const std::vector<oc_pose_t> &poses)
    {
        for (double excess = greatest_excess(poses); kind_ == "mount" && excess > 1; excess = greatest_excess(poses)) {
            for (double &value : common_) value /= excess * (1 + 1e-6);
        }
    }

    oc_pose_t move(const oc_pose_t &pose)
    {
        oc_pose_t moved;
        if (kind_ == "mount") {
            const oc_pose_t mount = wrong_mount();
            oc_pose_compose(&mount, &pose, &moved);
            return moved;
        }
        oc_pose6_t six;
        oc_pose_to_6(&pose, &six);
        for (int i = 0; i < 6; i++) six.v[i] += error(i);
        oc_pose_from_6(&six, &moved);
        return moved;
    }

private:
    // The largest error in any view, as a multiple of its margin.
    double greatest_excess(const std::vector<oc_pose_t> &poses) const
    {
        const oc_pose_t mount = wrong_mount();
        double excess = 0;
        for (const oc_pose_t &pose : poses) {
            oc_pose_t moved;
            oc_pose_compose(&mount, &pose, &moved);
            oc_pose6_t before, after;
            oc_pose_to_6(&pose, &before);
            oc_pose_to_6(&moved, &after);
            for (int i = 0; i < 6; i++) {
                double error = std::abs(after.v[i] - before.v[i]);
                if (i >= 3) error = std::min(error, 2 * kPi - error);
                if (margin_[i] > 0) excess = std::max(excess, error / margin_[i]);
            }
        }
        return excess;
    }

    // The same small turn and shift in every camera's own frame.
    oc_pose_t wrong_mount() const
    {
        oc_pose_t mount;
        double q[4] = {1, common_[3] / 2, common_[4] / 2, common_[5] / 2};
        const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        for (double &component : q) component /= norm;
        if (oc_rotation_from_quat(q, mount.R) != OC_OK) throw std::logic_error("a unit quaternion was refused");
        std::copy_n(common_, 3, mount.t);
        return mount;
    }

    double error(int i)
    {
        if (kind_ == "height") return i == 2 ? common_[2] : 0;
        if (kind_ == "independent") return uniform_.next() * margin_[i];
        // Drift: a walk that is reflected at the margin.
        walk_[i] += 0.25 * uniform_.next() * margin_[i];
        if (std::abs(walk_[i]) > margin_[i]) walk_[i] = std::copysign(2 * margin_[i] - std::abs(walk_[i]), walk_[i]);
        return walk_[i];
    }

    std::string kind_;
    Uniform uniform_;
    double margin_[6], common_[6], walk_[6] = {0, 0, 0, 0, 0, 0};
};

std::vector<int> chosen_views(const std::vector<int> &asked, int n_views)
{
    std::vector<int> out = asked;
    if (out.empty()) {
        for (int i = 0; i < n_views; i++) out.push_back(i);
    }
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
    if (out.front() < 0 || out.back() >= n_views)
        throw std::runtime_error("--views: the site has views 0 to " + std::to_string(n_views - 1));
    return out;
}

// Half a per cent of the median distance from camera to ground, 1 degree: what outcropd assumes as well.
void fill_margins(const json &root, double metres_per_unit, ReportedSiteOptions *options)
{
    if (options->margin_position_m < 0 && root.contains("margins"))
        options->margin_position_m = root["margins"].at("position").get<double>() * metres_per_unit;
    if (options->margin_angle_rad < 0 && root.contains("margins"))
        options->margin_angle_rad = root["margins"].at("angle_deg").get<double>() * kPi / 180;
    if (options->margin_angle_rad < 0) options->margin_angle_rad = kPi / 180;
    if (options->margin_position_m >= 0) return;
    std::vector<double> distance;
    for (const json &view : root.at("views")) {
        const oc_pose_t pose = pose_of(view, metres_per_unit);
        double centre[3];
        oc_pose_centre(&pose, centre);
        const double down = -pose.R[8];
        distance.push_back(down > 0.05 ? std::abs(centre[2]) / down : std::abs(centre[2]));
    }
    std::sort(distance.begin(), distance.end());
    options->margin_position_m = 0.005 * distance.at(distance.size() / 2);
}

json reported(const json &root, const fs::path &folder, ReportedSiteOptions options, ReportedSite *site)
{
    const std::string units = root.at("units").get<std::string>();
    if (units != "m" && units != "mm") throw std::runtime_error("\"units\" must be \"mm\" or \"m\"");
    if (root.at("views").size() < 2)
        throw std::runtime_error("\"views\": needs at least two, has " + std::to_string(root.at("views").size()));
    const double metres_per_unit = units == "mm" ? 1e-3 : 1.0;
    fill_margins(root, metres_per_unit, &options);
    PoseMover mover(options.perturbation, options.margin_position_m, options.margin_angle_rad);
    std::vector<oc_pose_t> poses;
    for (const json &view : root.at("views")) poses.push_back(pose_of(view, metres_per_unit));
    if (options.perturbation.is_on) mover.fit_mount(poses);
    json out = root;
    out["margins"] = {{"position", options.margin_position_m / metres_per_unit},
                      {"angle_deg", options.margin_angle_rad * 180 / kPi}};
    out["views"] = json::array();
    const auto &views = root.at("views");
    for (const int index : chosen_views(options.views, static_cast<int>(views.size()))) {
        json view = views.at(static_cast<std::size_t>(index));
        const std::string name = view.at("image").get<std::string>();
        site->image_names[index] = name;
        view["image"] = image_path(folder, name, options.images).string();
        view["index"] = index;
        if (options.perturbation.is_on) put_pose(&view, mover.move(pose_of(view, metres_per_unit)), metres_per_unit);
        out["views"].push_back(view);
    }
    return out;
}

} // namespace

Perturbation parse_perturbation(const std::string &text)
{
    Perturbation out;
    const std::size_t colon = text.find(':');
    const std::string seed = text.substr(0, colon);
    if (colon != std::string::npos) out.kind = text.substr(colon + 1);
    const bool is_number =
        !seed.empty() && seed.size() <= 9 && seed.find_first_not_of("0123456789") == std::string::npos;
    const bool is_kind =
        out.kind == "independent" || out.kind == "drift" || out.kind == "mount" || out.kind == "height";
    if (!is_number || !is_kind)
        throw std::runtime_error("--perturb: must be SEED or SEED:independent|drift|mount|height, not " + text);
    out.seed = static_cast<unsigned>(std::stoul(seed));
    out.is_on = true;
    return out;
}

ReportedSite write_reported_site(const ReportedSiteOptions &options, const std::string &out_file)
{
    const fs::path given = options.site;
    const fs::path file = fs::is_directory(given) ? given / "cameras.json" : given;
    const json root = read_json(file);
    ReportedSite site;
    try {
        const json out = reported(root, file.parent_path().empty() ? "." : file.parent_path(), options, &site);
        std::ofstream stream(out_file);
        stream << out.dump(1) << '\n';
        if (!stream.flush()) throw std::runtime_error(out_file + ": cannot be written");
    } catch (const json::exception &fault) {
        throw std::runtime_error(file.string() + ": " + fault.what());
    } catch (const std::runtime_error &fault) {
        const std::string what = fault.what();
        if (what.find(": ") != std::string::npos && what.rfind("--", 0) != 0 && what[0] != '"') throw; // names a file
        throw std::runtime_error(file.string() + ": " + what);
    }
    const fs::path path = file.parent_path() / "path.json";
    if (fs::exists(path)) site.path_file = fs::absolute(path).string();
    return site;
}

} // namespace outcrop
