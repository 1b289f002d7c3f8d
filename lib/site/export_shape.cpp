// SPDX-License-Identifier: BSD-3-Clause
// Little endian throughout, as both forms want it and every machine that this runs on has it.
#include "site/export_shape.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "site/atomic_file.h"

namespace outcrop {
namespace {

using Eigen::Vector3f;
using json = nlohmann::json;

template <typename T>
void append(std::string *out, T value)
{
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    out->append(bytes, sizeof value);
}

std::string ply_head(const std::string &comment, std::size_t n_vertices, std::size_t n_faces)
{
    std::string out = "ply\nformat binary_little_endian 1.0\n";
    if (!comment.empty()) out += "comment " + comment + "\n";
    out += "element vertex " + std::to_string(n_vertices) +
           "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\n"
           "property uchar blue\n";
    if (n_faces > 0) out += "element face " + std::to_string(n_faces) + "\nproperty list uchar int vertex_indices\n";
    return out + "end_header\n";
}

void append_vertex(std::string *out, const Vector3f &at, const cv::Vec3b &colour)
{
    for (int i = 0; i < 3; i++) append(out, at[i]);
    for (int i = 0; i < 3; i++) append(out, colour[i]);
}

// ---- glTF ----

constexpr int kFloat = 5126, kUnsignedInt = 5125, kUnsignedByte = 5121;
constexpr int kArrayBuffer = 34962, kElementBuffer = 34963;

Vector3f to_gltf(const Vector3f &world)
{
    return {world.x(), world.z(), -world.y()};
}

// Collects buffer views and accessors of one binary buffer.
class GltfBuffer {
public:
    int add_view(const std::string &bytes, int target)
    {
        while (bytes_.size() % 4 != 0) bytes_.push_back('\0');
        json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes.size()}};
        if (target != 0) view["target"] = target;
        bytes_ += bytes;
        views_.push_back(view);
        return static_cast<int>(views_.size()) - 1;
    }

    int add_positions(const std::vector<Vector3f> &points)
    {
        std::string bytes;
        Vector3f low = Vector3f::Constant(std::numeric_limits<float>::max()), high = -low;
        for (const Vector3f &p : points) {
            low = low.cwiseMin(p), high = high.cwiseMax(p);
            for (int i = 0; i < 3; i++) append(&bytes, p[i]);
        }
        accessors_.push_back({{"bufferView", add_view(bytes, kArrayBuffer)},
                              {"componentType", kFloat},
                              {"count", points.size()},
                              {"type", "VEC3"},
                              {"min", {low.x(), low.y(), low.z()}},
                              {"max", {high.x(), high.y(), high.z()}}});
        return static_cast<int>(accessors_.size()) - 1;
    }

    int add_vectors(const std::vector<Vector3f> &vectors)
    {
        std::string bytes;
        for (const Vector3f &v : vectors)
            for (int i = 0; i < 3; i++) append(&bytes, v[i]);
        return add_accessor(bytes, kFloat, vectors.size(), "VEC3", false);
    }

    int add_uvs(const std::vector<std::array<float, 2>> &uvs)
    {
        std::string bytes;
        for (const auto &uv : uvs) append(&bytes, uv[0]), append(&bytes, uv[1]);
        return add_accessor(bytes, kFloat, uvs.size(), "VEC2", false);
    }

    // glTF's colours are linear; ours are those of a screen.
    int add_colours(const std::vector<cv::Vec3b> &colours)
    {
        std::string bytes;
        for (const cv::Vec3b &c : colours) {
            for (int i = 0; i < 3; i++) {
                const double v = c[i] / 255.0;
                const double linear = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
                append(&bytes, static_cast<std::uint8_t>(std::lround(255 * linear)));
            }
            append(&bytes, std::uint8_t{255});
        }
        return add_accessor(bytes, kUnsignedByte, colours.size(), "VEC4", true);
    }

    int add_triangles(const std::vector<std::array<std::uint32_t, 3>> &triangles)
    {
        std::string bytes;
        for (const auto &t : triangles)
            for (const std::uint32_t i : t) append(&bytes, i);
        accessors_.push_back({{"bufferView", add_view(bytes, kElementBuffer)},
                              {"componentType", kUnsignedInt},
                              {"count", 3 * triangles.size()},
                              {"type", "SCALAR"}});
        return static_cast<int>(accessors_.size()) - 1;
    }

    const std::string &bytes() const { return bytes_; }
    const json &views() const { return views_; }
    const json &accessors() const { return accessors_; }

private:
    int add_accessor(const std::string &bytes, int component, std::size_t count, const char *type, bool is_normalized)
    {
        json accessor = {{"bufferView", add_view(bytes, kArrayBuffer)},
                         {"componentType", component},
                         {"count", count},
                         {"type", type}};
        if (is_normalized) accessor["normalized"] = true;
        accessors_.push_back(accessor);
        return static_cast<int>(accessors_.size()) - 1;
    }

    std::string bytes_;
    json views_ = json::array(), accessors_ = json::array();
};

class GltfScene {
public:
    GltfScene()
    {
        add_material({0.72, 0.74, 0.78, 1.0}, false);  // boxes
        add_material({0.95, 0.65, 0.10, 0.45}, false); // suspected
        add_material({1.0, 1.0, 1.0, 1.0}, false);     // vertex colours
    }

    void add_ground(const OverheadMap &map)
    {
        if (map.rgb.empty()) return;
        cv::Mat4b bgra(map.rgb.size());
        for (int y = 0; y < bgra.rows; y++)
            for (int x = 0; x < bgra.cols; x++) {
                const cv::Vec3b &rgb = map.rgb(y, x);
                bgra(y, x) = cv::Vec4b(rgb[2], rgb[1], rgb[0], map.seen(y, x));
            }
        std::vector<std::uint8_t> png;
        if (!cv::imencode(".png", bgra, png)) return;
        const int view = buffer_.add_view(std::string(png.begin(), png.end()), 0);
        images_.push_back({{"bufferView", view}, {"mimeType", "image/png"}});
        materials_.push_back(
            {{"name", "ground"},
             {"doubleSided", true},
             {"alphaMode", "MASK"},
             {"pbrMetallicRoughness",
              {{"baseColorTexture", {{"index", 0}}}, {"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}}});
        const auto x0 = static_cast<float>(map.x_min), y1 = static_cast<float>(map.y_max);
        const auto x1 = static_cast<float>(map.x_min + map.rgb.cols * map.metres_per_pixel);
        const auto y0 = static_cast<float>(map.y_max - map.rgb.rows * map.metres_per_pixel);
        std::vector<Vector3f> corners;
        for (const auto &[x, y] : {std::pair{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}})
            corners.push_back(to_gltf({x, y, 0}));
        const json attributes = {{"POSITION", buffer_.add_positions(corners)},
                                 {"NORMAL", buffer_.add_vectors(std::vector<Vector3f>(4, Vector3f(0, 1, 0)))},
                                 {"TEXCOORD_0", buffer_.add_uvs({{0, 1}, {1, 1}, {1, 0}, {0, 0}})}};
        add_node("ground", attributes, buffer_.add_triangles({{0, 1, 2}, {0, 2, 3}}),
                 static_cast<int>(materials_.size()) - 1);
    }

    void add_box(const std::string &name, const Obstacle &box, bool is_suspected)
    {
        const double c = std::cos(box.yaw_rad), s = std::sin(box.yaw_rad);
        std::vector<Vector3f> points, normals;
        std::vector<std::array<std::uint32_t, 3>> triangles;
        for (int axis = 0; axis < 3; axis++) {
            for (const double sign : {-1.0, 1.0}) {
                const auto first = static_cast<std::uint32_t>(points.size());
                Eigen::Vector3d normal = Eigen::Vector3d::Zero();
                normal[axis] = sign;
                const int a = (axis + 1) % 3, b = (axis + 2) % 3;
                for (const auto &[p, q] : {std::pair{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}}) {
                    Eigen::Vector3d corner = normal;
                    corner[a] = p, corner[b] = q * sign; // keeps the turn outward on both sides
                    const Eigen::Vector3d half = corner.cwiseProduct(box.obb_size) / 2;
                    const Eigen::Vector3d at(c * half.x() - s * half.y(), s * half.x() + c * half.y(), half.z());
                    points.push_back(to_gltf((box.obb_centre + at).cast<float>()));
                    const Eigen::Vector3d n(c * normal.x() - s * normal.y(), s * normal.x() + c * normal.y(),
                                            normal.z());
                    normals.push_back(to_gltf(n.cast<float>()));
                }
                triangles.push_back({first, first + 1, first + 2});
                triangles.push_back({first, first + 2, first + 3});
            }
        }
        const json attributes = {{"POSITION", buffer_.add_positions(points)}, {"NORMAL", buffer_.add_vectors(normals)}};
        add_node(name, attributes, buffer_.add_triangles(triangles), is_suspected ? 1 : 0);
    }

    void add_mesh(const std::string &name, const Mesh &mesh)
    {
        if (mesh.triangles.empty()) return;
        std::vector<Vector3f> points;
        for (const Vector3f &p : mesh.vertices) points.push_back(to_gltf(p));
        const json attributes = {{"POSITION", buffer_.add_positions(points)},
                                 {"COLOR_0", buffer_.add_colours(mesh.colours)}};
        add_node(name, attributes, buffer_.add_triangles(mesh.triangles), 2);
    }

    std::string glb() const
    {
        std::string binary = buffer_.bytes();
        while (binary.size() % 4 != 0) binary.push_back('\0');
        json nodes = json::array();
        for (std::size_t i = 0; i < nodes_.size(); i++) nodes.push_back(i);
        json root = {{"asset", {{"version", "2.0"}, {"generator", "outcrop"}}},
                     {"scene", 0},
                     {"scenes", {{{"nodes", nodes}}}},
                     {"nodes", nodes_},
                     {"meshes", meshes_},
                     {"materials", materials_},
                     {"accessors", buffer_.accessors()},
                     {"bufferViews", buffer_.views()},
                     {"buffers", {{{"byteLength", binary.size()}}}}};
        if (!images_.empty()) {
            root["images"] = images_;
            root["samplers"] = {{{"magFilter", 9729}, {"minFilter", 9987}, {"wrapS", 33071}, {"wrapT", 33071}}};
            root["textures"] = {{{"source", 0}, {"sampler", 0}}};
        }
        if (nodes_.empty()) root = {{"asset", {{"version", "2.0"}, {"generator", "outcrop"}}}};
        std::string text = root.dump();
        while (text.size() % 4 != 0) text.push_back(' ');
        std::string out = "glTF";
        append(&out, std::uint32_t{2});
        const std::size_t n_binary = nodes_.empty() ? 0 : 8 + binary.size();
        append(&out, static_cast<std::uint32_t>(12 + 8 + text.size() + n_binary));
        append(&out, static_cast<std::uint32_t>(text.size()));
        out += "JSON" + text;
        if (n_binary == 0) return out;
        append(&out, static_cast<std::uint32_t>(binary.size()));
        out.append("BIN\0", 4);
        return out + binary;
    }

private:
    void add_material(std::array<double, 4> colour, bool is_double_sided)
    {
        json material = {
            {"doubleSided", is_double_sided},
            {"pbrMetallicRoughness", {{"baseColorFactor", colour}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.9}}}};
        if (colour[3] < 1) material["alphaMode"] = "BLEND";
        materials_.push_back(material);
    }

    void add_node(const std::string &name, const json &attributes, int indices, int material)
    {
        const json primitive = {{"attributes", attributes}, {"indices", indices}, {"material", material}, {"mode", 4}};
        meshes_.push_back({{"name", name}, {"primitives", {primitive}}});
        nodes_.push_back({{"name", name}, {"mesh", meshes_.size() - 1}});
    }

    GltfBuffer buffer_;
    json materials_ = json::array(), meshes_ = json::array(), nodes_ = json::array(), images_ = json::array();
};

} // namespace

void write_voxels_ply(const std::string &path, const VoxelGrid &grid)
{
    std::string body;
    std::size_t n = 0;
    for (int k = 0; k < grid.nz; k++) {
        for (int j = 0; j < grid.ny; j++) {
            for (int i = 0; i < grid.nx; i++) {
                if (!grid.is_occupied(i, j, k)) continue;
                const cv::Vec3b colour =
                    grid.colour.empty() ? cv::Vec3b(150, 150, 150) : grid.colour[grid.index(i, j, k)];
                append_vertex(&body, grid.centre(i, j, k).cast<float>(), colour);
                n++;
            }
        }
    }
    write_whole(path, ply_head("voxel_size " + json(grid.size_m).dump(), n, 0) + body);
}

void write_mesh_ply(const std::string &path, const Mesh &mesh)
{
    std::string out = ply_head("", mesh.vertices.size(), mesh.triangles.size());
    for (std::size_t v = 0; v < mesh.vertices.size(); v++) append_vertex(&out, mesh.vertices[v], mesh.colours[v]);
    for (const auto &t : mesh.triangles) {
        append(&out, std::uint8_t{3});
        for (const std::uint32_t i : t) append(&out, static_cast<std::int32_t>(i));
    }
    write_whole(path, out);
}

void write_gltf(const std::string &path, const SiteModel &model, const std::vector<Shape> &shapes,
                const OverheadMap &overhead)
{
    GltfScene scene;
    scene.add_ground(overhead);
    const auto is_carved = [&](const Obstacle &box) {
        for (const Shape &shape : shapes)
            if (shape.index == box.index && !shape.mesh.triangles.empty()) return true;
        return false;
    };
    for (const Obstacle &box : model.obstacles)
        if (!is_carved(box)) scene.add_box("obstacle " + std::to_string(box.index), box, false);
    for (const Obstacle &box : model.suspected) scene.add_box("suspected " + std::to_string(box.index), box, true);
    for (const Shape &shape : shapes) scene.add_mesh("obstacle " + std::to_string(shape.index), shape.mesh);
    write_whole(path, scene.glb());
}

} // namespace outcrop
