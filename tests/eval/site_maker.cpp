// SPDX-License-Identifier: BSD-3-Clause
// Writes a small site with exact truth.
#include "site_maker.h"

#include "eval/json_file.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <stdexcept>
#include <zip.h>

namespace outcrop::eval {

namespace fs = std::filesystem;

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kWidth = 160, kHeight = 120;
constexpr double kFocal = 150, kPixelM = 0.002, kHalfAreaM = 0.6;

struct Block {
    Vector3d centre_m, size_m;
    double yaw_deg;
};
const Block kBlocks[] = {{{-0.25, 0.10, 0.10}, {0.20, 0.30, 0.20}, 0}, {{0.22, -0.12, 0.12}, {0.30, 0.16, 0.24}, 30}};

Matrix3d world_from_block(const Block &b)
{
    return Eigen::AngleAxisd(b.yaw_deg * M_PI / 180, Vector3d::UnitZ()).toRotationMatrix();
}

cv::Vec3b ground_colour(double x, double y)
{
    const auto wave = [](double t) { return cv::saturate_cast<std::uint8_t>(128 + 90 * std::sin(t)); };
    return {wave(9 * x), wave(11 * y + 1), wave(7 * x + 8 * y)};
}

struct Pose {
    Matrix3d rotation; // cam_from_world
    Vector3d centre_m;
};

Pose look_at_origin(double azimuth_deg, double distance_m, double height_m)
{
    const double a = azimuth_deg * M_PI / 180;
    Pose pose;
    pose.centre_m = {distance_m * std::cos(a), distance_m * std::sin(a), height_m};
    const Vector3d z = -pose.centre_m.normalized();
    const Vector3d x = z.cross(Vector3d::UnitZ()).normalized();
    pose.rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
    return pose;
}

// Depth along `ray` (z-depth 1) where it enters the block; infinity when it does not.
double enter_block(const Block &b, const Vector3d &from, const Vector3d &ray)
{
    const Matrix3d turn = world_from_block(b).transpose();
    const Vector3d o = turn * (from - b.centre_m), d = turn * ray;
    double in = 0, out = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; i++) {
        const double t0 = (-b.size_m[i] / 2 - o[i]) / d[i], t1 = (b.size_m[i] / 2 - o[i]) / d[i];
        in = std::max(in, std::min(t0, t1));
        out = std::min(out, std::max(t0, t1));
    }
    return in < out ? in : std::numeric_limits<double>::infinity();
}

struct Picture {
    cv::Mat image, depth_mm, mask;
};

Picture render(const Pose &pose)
{
    Picture p{cv::Mat(kHeight, kWidth, CV_8UC3), cv::Mat(kHeight, kWidth, CV_32F), cv::Mat(kHeight, kWidth, CV_8U)};
    for (int v = 0; v < kHeight; v++) {
        for (int u = 0; u < kWidth; u++) {
            const Vector3d n((u - kWidth / 2.0) / kFocal, (v - kHeight / 2.0) / kFocal, 1);
            const Vector3d ray = pose.rotation.transpose() * n;
            double depth = ray.z() < 0 ? -pose.centre_m.z() / ray.z() : 0;
            int code = depth > 0 ? kMaskGround : kMaskNothing;
            const Vector3d p_ground = pose.centre_m + depth * ray;
            cv::Vec3b colour = depth > 0 ? ground_colour(p_ground.x(), p_ground.y()) : cv::Vec3b(230, 200, 180);
            for (int k = 0; k < 2; k++) {
                const double t = enter_block(kBlocks[k], pose.centre_m, ray);
                if (!std::isfinite(t) || (depth > 0 && t >= depth)) continue;
                depth = t;
                code = k + 1;
                colour = k == 0 ? cv::Vec3b(40, 80, 200) : cv::Vec3b(60, 180, 90);
            }
            p.image.at<cv::Vec3b>(v, u) = colour;
            p.depth_mm.at<float>(v, u) = static_cast<float>(depth * 1000);
            p.mask.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(code);
        }
    }
    return p;
}

Json camera_json(const Pose &pose, const std::string &image)
{
    Json r = Json::array(), t = Json::array();
    const Vector3d shift = -pose.rotation * pose.centre_m * 1000;
    for (int i = 0; i < 3; i++) {
        r.push_back({pose.rotation(i, 0), pose.rotation(i, 1), pose.rotation(i, 2)});
        t.push_back(shift[i]);
    }
    return {{"image", image},      {"width", kWidth}, {"height", kHeight},
            {"fx", kFocal},        {"fy", kFocal},    {"cx", kWidth / 2.0},
            {"cy", kHeight / 2.0}, {"R", r},          {"t", t}};
}

void write_block_ply(const fs::path &file, const Block &b, bool is_ascii)
{
    static const int faces[12][3] = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                                     {1, 2, 6}, {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};
    std::ofstream out(file, std::ios::binary);
    out << "ply\nformat " << (is_ascii ? "ascii" : "binary_little_endian")
        << " 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
        << "element face 12\nproperty list uchar int vertex_indices\nend_header\n";
    for (int i = 0; i < 8; i++) {
        const Vector3d corner((i % 4 == 1 || i % 4 == 2) - 0.5, (i % 4 >= 2) - 0.5, (i >= 4) - 0.5);
        const Vector3d p = (b.centre_m + world_from_block(b) * corner.cwiseProduct(b.size_m)) * 1000;
        const Eigen::Vector3f f = p.cast<float>();
        if (is_ascii)
            out << f.x() << ' ' << f.y() << ' ' << f.z() << '\n';
        else
            out.write(reinterpret_cast<const char *>(f.data()), 12);
    }
    for (const auto &face : faces) {
        if (is_ascii)
            out << "3 " << face[0] << ' ' << face[1] << ' ' << face[2] << '\n';
        else
            out.put(3).write(reinterpret_cast<const char *>(face), 12);
    }
}

Json obstacle_json(int k)
{
    const Block &b = kBlocks[k];
    const Matrix3d r = world_from_block(b);
    const Vector3d half = (r.cwiseAbs() * b.size_m / 2) * 1000, c = b.centre_m * 1000;
    const Vector3d low = c - half, high = c + half;
    return {{"index", k + 1},
            {"name", k == 0 ? "straight" : "turned"},
            {"aabb_min", {low.x(), low.y(), low.z()}},
            {"aabb_max", {high.x(), high.y(), high.z()}},
            {"mesh", "obstacles/" + std::to_string(k + 1) + ".ply"}};
}

void write_overhead(const fs::path &site)
{
    const int side = static_cast<int>(std::lround(2 * kHalfAreaM / kPixelM));
    cv::Mat image(side, side, CV_8UC3);
    for (int r = 0; r < side; r++)
        for (int c = 0; c < side; c++)
            image.at<cv::Vec3b>(r, c) =
                ground_colour(-kHalfAreaM + (c + 0.5) * kPixelM, kHalfAreaM - (r + 0.5) * kPixelM);
    cv::imwrite((site / "overhead_shadows.png").string(), image);
    const Json json = {
        {"units", "mm"}, {"mm_per_pixel", kPixelM * 1000}, {"x_min", -kHalfAreaM * 1000}, {"y_max", kHalfAreaM * 1000}};
    write_text(site / "overhead.json", json.dump());
}

std::string npy(const cv::Mat &array, const std::string &type, int version)
{
    std::string header = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (" + std::to_string(array.rows) +
                         ", " + std::to_string(array.cols) + "), }";
    const std::size_t prefix = version == 1 ? 10 : 12;
    while ((prefix + header.size() + 1) % 64 != 0) header += ' ';
    header += '\n';
    std::string out("\x93NUMPY", 6);
    out += static_cast<char>(version);
    out += '\0';
    for (int i = 0; i < (version == 1 ? 2 : 4); i++) out += static_cast<char>(header.size() >> (8 * i) & 255);
    out += header;
    return out.append(reinterpret_cast<const char *>(array.data), array.total() * array.elemSize());
}

} // namespace

void write_text(const fs::path &file, const std::string &text)
{
    fs::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
}

std::string read_text(const fs::path &file)
{
    std::ostringstream out;
    out << std::ifstream(file, std::ios::binary).rdbuf();
    return out.str();
}

void write_npz(const fs::path &file, const cv::Mat &depth, const cv::Mat &mask, const std::string &depth_type,
               int version)
{
    fs::create_directories(file.parent_path());
    cv::Mat stored = depth;
    if (depth_type == "<f2") depth.convertTo(stored, CV_16F);
    const std::string members[] = {npy(stored, depth_type, version), npy(mask, "|u1", version)};
    int code = 0;
    zip_t *archive = zip_open(file.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code);
    if (!archive) throw std::runtime_error("cannot write " + file.string());
    const char *const names[] = {"depth.npy", "mask.npy"};
    for (int i = 0; i < 2; i++) {
        zip_source_t *source = zip_source_buffer(archive, members[i].data(), members[i].size(), 0);
        zip_file_add(archive, names[i], source, ZIP_FL_OVERWRITE);
    }
    if (zip_close(archive) != 0) throw std::runtime_error("cannot write " + file.string());
}

void write_small_site(const fs::path &site)
{
    for (const char *folder : {"images", "depth", "obstacles", "path"}) fs::create_directories(site / folder);
    Json cameras = {{"units", "mm"}, {"area", {{"x", {-600, 600}}, {"y", {-600, 600}}, {"z_max", 400}}}};
    for (int i = 0; i < 4; i++) {
        const Pose pose = look_at_origin(20 + 35 * i, 1.1, 0.9);
        const std::string name = "view_0" + std::to_string(i);
        const Picture p = render(pose);
        cameras["views"].push_back(camera_json(pose, "images/" + name + ".png"));
        cv::imwrite((site / "images" / (name + ".png")).string(), p.image);
        write_npz(site / "depth" / (name + ".npz"), p.depth_mm, p.mask);
    }
    write_text(site / "cameras.json", cameras.dump());
    Json path = {{"units", "mm"}};
    for (int i = 0; i < 3; i++) {
        const Pose pose = look_at_origin(40 + 10 * i, 1.0, 0.6);
        const Picture p = render(pose);
        const std::string number = "0" + std::to_string(i) + ".png";
        path["frames"].push_back(camera_json(pose, "path/frame_" + number));
        cv::imwrite((site / "path" / ("frame_" + number)).string(), p.image);
        cv::imwrite((site / "path" / ("mask_" + number)).string(), p.mask);
    }
    write_text(site / "path.json", path.dump());
    Json obstacles = {{"units", "mm"}};
    for (int k = 0; k < 2; k++) {
        obstacles["obstacles"].push_back(obstacle_json(k));
        write_block_ply(site / "obstacles" / (std::to_string(k + 1) + ".ply"), kBlocks[k], k == 0);
    }
    write_text(site / "obstacles.json", obstacles.dump());
    write_overhead(site);
}

} // namespace outcrop::eval
