// SPDX-License-Identifier: BSD-3-Clause
// glTF 2.0: one JSON chunk, one binary chunk.
#include "site/gltf.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "site/atomic_file.h"

namespace outcrop {
namespace {

using json = nlohmann::json;

constexpr int kFloat = 5126, kUnsignedInt = 5125, kUnsignedShort = 5123;
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;
enum Material : int { kGround = 0, kSurface, kBox, kSuspected };

template <class T>
void put(const T &value, std::string *out)
{
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    out->append(bytes, sizeof bytes);
}

Eigen::Vector3f y_up(const Eigen::Vector3d &p)
{
    return Eigen::Vector3d(p.x(), p.z(), -p.y()).cast<float>();
}

// sRGB, 0..255, to linear, 0..65535.
std::uint16_t linear(unsigned char level)
{
    const double c = level / 255.0;
    const double l = c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
    return static_cast<std::uint16_t>(std::lround(l * 65535));
}

class Writer {
public:
    int add_positions(const std::vector<Eigen::Vector3f> &points)
    {
        Eigen::Vector3f low = points.front(), high = low;
        std::string bytes;
        for (const Eigen::Vector3f &p : points) {
            if (!p.allFinite()) throw std::invalid_argument("glTF: a coordinate is not finite");
            low = low.cwiseMin(p), high = high.cwiseMax(p);
            for (int axis = 0; axis < 3; ++axis) put(p[axis], &bytes);
        }
        json accessor = {{"componentType", kFloat}, {"count", points.size()}, {"type", "VEC3"}};
        accessor["min"] = {low.x(), low.y(), low.z()};
        accessor["max"] = {high.x(), high.y(), high.z()};
        return add_accessor(accessor, add_view(bytes, kArrayBuffer));
    }

    int add_colours(const std::vector<cv::Vec3b> &colours)
    {
        std::string bytes;
        for (const cv::Vec3b &c : colours) {
            for (int n = 0; n < 3; ++n) put(linear(c[n]), &bytes);
            put(static_cast<std::uint16_t>(65535), &bytes);
        }
        return add_accessor(
            {{"componentType", kUnsignedShort}, {"count", colours.size()}, {"type", "VEC4"}, {"normalized", true}},
            add_view(bytes, kArrayBuffer));
    }

    int add_texture_corners(const std::vector<Eigen::Vector2f> &corners)
    {
        std::string bytes;
        for (const Eigen::Vector2f &c : corners) put(c.x(), &bytes), put(c.y(), &bytes);
        return add_accessor({{"componentType", kFloat}, {"count", corners.size()}, {"type", "VEC2"}},
                            add_view(bytes, kArrayBuffer));
    }

    int add_triangles(const std::vector<std::array<std::uint32_t, 3>> &triangles)
    {
        std::string bytes;
        for (const auto &t : triangles)
            for (const std::uint32_t v : t) put(v, &bytes);
        return add_accessor({{"componentType", kUnsignedInt}, {"count", 3 * triangles.size()}, {"type", "SCALAR"}},
                            add_view(bytes, kElementArrayBuffer));
    }

    void add_image(const std::vector<unsigned char> &png)
    {
        const int view = add_view(std::string(png.begin(), png.end()), 0);
        root_["images"] = {{{"bufferView", view}, {"mimeType", "image/png"}, {"name", "ground"}}};
        root_["samplers"] = {{{"magFilter", 9729}, {"minFilter", 9987}, {"wrapS", 33071}, {"wrapT", 33071}}};
        root_["textures"] = {{{"sampler", 0}, {"source", 0}}};
    }

    void add_mesh(const std::string &name, const json &attributes, int indices, Material material)
    {
        const std::size_t number = root_["meshes"].size();
        root_["meshes"].push_back(
            {{"name", name},
             {"primitives",
              {{{"attributes", attributes}, {"indices", indices}, {"material", material_number(material)}}}}});
        root_["nodes"].push_back({{"name", name}, {"mesh", number}});
    }

    std::string glb()
    {
        root_["asset"] = {{"version", "2.0"}, {"generator", "Outcrop"}};
        root_["scene"] = 0;
        json scene = {{"name", "site"}};
        for (std::size_t n = 0; n < root_["nodes"].size(); ++n) scene["nodes"].push_back(n);
        root_["scenes"] = json::array({scene});
        if (is_unlit_used_) root_["extensionsUsed"] = {"KHR_materials_unlit"};
        if (!bytes_.empty()) root_["buffers"] = {{{"byteLength", bytes_.size()}}};
        // glTF has no empty arrays.
        for (const char *key : {"meshes", "nodes"})
            if (root_[key].empty()) root_.erase(key);
        std::string text = root_.dump();
        text.resize((text.size() + 3) / 4 * 4, ' ');
        const std::size_t binary = bytes_.empty() ? 0 : 8 + bytes_.size();
        std::string out = "glTF";
        put(std::uint32_t{2}, &out);
        put(static_cast<std::uint32_t>(12 + 8 + text.size() + binary), &out);
        put(static_cast<std::uint32_t>(text.size()), &out);
        out += "JSON" + text;
        if (binary > 0) {
            put(static_cast<std::uint32_t>(bytes_.size()), &out);
            out.append("BIN\0", 4);
            out += bytes_;
        }
        return out;
    }

private:
    // Starts on a multiple of four bytes, as every component here may.
    int add_view(const std::string &bytes, int target)
    {
        json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes.size()}};
        if (target != 0) view["target"] = target;
        root_["bufferViews"].push_back(view);
        bytes_ += bytes;
        bytes_.resize((bytes_.size() + 3) / 4 * 4, '\0');
        return static_cast<int>(root_["bufferViews"].size()) - 1;
    }

    int add_accessor(json accessor, int view)
    {
        accessor["bufferView"] = view;
        root_["accessors"].push_back(std::move(accessor));
        return static_cast<int>(root_["accessors"].size()) - 1;
    }

    // Materials come into the file when they are first used.
    int material_number(Material material)
    {
        int &number = materials_[static_cast<std::size_t>(material)];
        if (number >= 0) return number;
        const bool is_box = material == kBox || material == kSuspected;
        json m;
        json &pbr = m["pbrMetallicRoughness"];
        pbr = {{"metallicFactor", 0}, {"roughnessFactor", 1}};
        if (material == kGround) {
            m["name"] = "ground";
            pbr["baseColorTexture"] = {{"index", 0}};
            m["alphaMode"] = "MASK";
        } else if (material == kSurface) {
            m["name"] = "surface";
        } else {
            m["name"] = material == kBox ? "box" : "suspected";
            pbr["baseColorFactor"] = material == kBox ? json{0.1, 0.3, 0.9, 0.25} : json{0.9, 0.5, 0.05, 0.35};
            m["alphaMode"] = "BLEND";
        }
        m["doubleSided"] = material != kSurface;
        if (!is_box) {
            m["extensions"] = {{"KHR_materials_unlit", json::object()}};
            is_unlit_used_ = true;
        }
        number = static_cast<int>(root_["materials"].size());
        root_["materials"].push_back(m);
        return number;
    }

    json root_;
    std::string bytes_;
    std::array<int, 4> materials_{-1, -1, -1, -1};
    bool is_unlit_used_ = false;
};

void add_ground(const GltfGround &ground, Writer *writer)
{
    if (ground.rgb.empty()) return;
    if (!(ground.metres_per_pixel > 0) || !std::isfinite(ground.metres_per_pixel))
        throw std::invalid_argument("glTF: the ground's scale is not positive");
    cv::Mat image;
    cv::cvtColor(ground.rgb, image, cv::COLOR_RGB2BGRA);
    if (!ground.seen.empty()) {
        if (ground.seen.size() != ground.rgb.size())
            throw std::invalid_argument("glTF: the ground's mask has another size");
        cv::insertChannel(ground.seen, image, 3);
    }
    std::vector<unsigned char> png;
    if (!cv::imencode(".png", image, png)) throw std::invalid_argument("glTF: the ground cannot be encoded");
    writer->add_image(png);
    const double x1 = ground.x_min + ground.metres_per_pixel * ground.rgb.cols;
    const double y0 = ground.y_max - ground.metres_per_pixel * ground.rgb.rows;
    const int position = writer->add_positions({y_up({ground.x_min, y0, 0}), y_up({x1, y0, 0}),
                                                y_up({x1, ground.y_max, 0}), y_up({ground.x_min, ground.y_max, 0})});
    const int corners = writer->add_texture_corners({{0, 1}, {1, 1}, {1, 0}, {0, 0}});
    const int triangles = writer->add_triangles({{0, 1, 2}, {0, 2, 3}});
    writer->add_mesh("ground", {{"POSITION", position}, {"TEXCOORD_0", corners}}, triangles, kGround);
}

void add_box(const Obstacle &box, Material material, Writer *writer)
{
    const double c = std::cos(box.yaw_rad), s = std::sin(box.yaw_rad);
    std::vector<Eigen::Vector3f> corners;
    for (int n = 0; n < 8; ++n) {
        const Eigen::Vector3d d((n & 1 ? 0.5 : -0.5) * box.obb_size.x(), (n & 2 ? 0.5 : -0.5) * box.obb_size.y(),
                                (n & 4 ? 0.5 : -0.5) * box.obb_size.z());
        corners.push_back(y_up(box.obb_centre + Eigen::Vector3d(c * d.x() - s * d.y(), s * d.x() + c * d.y(), d.z())));
    }
    const int position = writer->add_positions(corners);
    const int triangles = writer->add_triangles({{0, 4, 6},
                                                 {0, 6, 2},
                                                 {1, 3, 7},
                                                 {1, 7, 5},
                                                 {0, 1, 5},
                                                 {0, 5, 4},
                                                 {2, 6, 7},
                                                 {2, 7, 3},
                                                 {0, 2, 3},
                                                 {0, 3, 1},
                                                 {4, 5, 7},
                                                 {4, 7, 6}});
    const char *kind = material == kBox ? "box " : "suspected ";
    writer->add_mesh(kind + std::to_string(box.index), {{"POSITION", position}}, triangles, material);
}

void add_surface(const GltfSurface &surface, Writer *writer)
{
    if (surface.mesh.triangles.empty()) return;
    std::vector<Eigen::Vector3f> points;
    for (const Eigen::Vector3f &p : surface.mesh.vertices) points.push_back(y_up(p.cast<double>()));
    const int position = writer->add_positions(points);
    const int colours = writer->add_colours(surface.mesh.colours);
    const int triangles = writer->add_triangles(surface.mesh.triangles);
    writer->add_mesh("obstacle " + std::to_string(surface.obstacle), {{"POSITION", position}, {"COLOR_0", colours}},
                     triangles, kSurface);
}

} // namespace

std::string glb_of(const GltfSite &site)
{
    Writer writer;
    add_ground(site.ground, &writer);
    for (const GltfSurface &surface : site.surfaces) add_surface(surface, &writer);
    for (const Obstacle &box : site.obstacles) add_box(box, kBox, &writer);
    for (const Obstacle &box : site.suspected) add_box(box, kSuspected, &writer);
    return writer.glb();
}

void write_glb(const std::string &path, const GltfSite &site)
{
    write_whole(path, glb_of(site));
}

} // namespace outcrop
