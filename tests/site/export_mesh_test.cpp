// SPDX-License-Identifier: BSD-3-Clause
// PLY and glTF of carved obstacles: byte by byte, and opened by readers that are not ours.
#include "site/export_mesh.h"

#include <unistd.h>

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "site/gltf.h"

namespace outcrop {
namespace {

namespace fs = std::filesystem;
using json = nlohmann::json;
using testing::HasSubstr;

Voxels some_voxels()
{
    Voxels v;
    v.grid = {{0.5, -1, 0}, 0.1, 6, 5, 4};
    v.states.assign(v.grid.size(), VoxelState::kFree);
    v.colours.assign(v.grid.size(), {0, 0, 0});
    for (int k = 0; k < 3; ++k)
        for (int j = 1; j < 4; ++j)
            for (int i = 1; i < 5; ++i) {
                v.states[v.grid.at(i, j, k)] = VoxelState::kOccupied;
                v.colours[v.grid.at(i, j, k)] = cv::Vec3b(static_cast<uchar>(40 * i), static_cast<uchar>(50 * j), 200);
            }
    v.states[v.grid.at(0, 0, 3)] = VoxelState::kUnknown;
    return v;
}

Obstacle some_box(int index)
{
    Obstacle box;
    box.index = index;
    box.obb_centre = {0.8, -0.75, 0.15};
    box.obb_size = {0.4, 0.3, 0.3};
    box.yaw_rad = 0.3;
    return box;
}

GltfSite some_site()
{
    GltfSite site;
    site.ground.rgb = cv::Mat3b(30, 40, cv::Vec3b(120, 100, 80));
    site.ground.seen = cv::Mat1b(30, 40, static_cast<uchar>(255));
    site.ground.metres_per_pixel = 0.1;
    site.ground.x_min = -1;
    site.ground.y_max = 1.5;
    site.obstacles = {some_box(1)};
    site.suspected = {some_box(2)};
    site.surfaces = {{1, mesh_of(some_voxels())}, {2, {}}};
    return site;
}

// What a command prints on both streams, and whether it succeeded.
struct Said {
    bool is_good = false;
    std::string text;
};

Said run(const std::string &command)
{
    Said said;
    std::FILE *pipe = popen(("timeout 60 " + command + " 2>&1").c_str(), "r");
    if (!pipe) return said;
    char line[512];
    while (std::fgets(line, sizeof line, pipe)) said.text += line;
    said.is_good = pclose(pipe) == 0;
    return said;
}

class Exported : public testing::Test {
protected:
    void SetUp() override
    {
        dir_ = testing::TempDir() + "outcrop_mesh_" + std::to_string(getpid());
        fs::remove_all(dir_);
        fs::create_directories(dir_);
    }
    void TearDown() override { fs::remove_all(dir_); }

    std::string dir_;
};

// The two chunks of a .glb, with all lengths checked.
struct Glb {
    json root;
    std::string binary;
};

template <class T>
T get(const std::string &bytes, std::size_t at)
{
    T value;
    EXPECT_LE(at + sizeof value, bytes.size());
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
}

Glb parse(const std::string &bytes)
{
    Glb glb;
    EXPECT_EQ(bytes.substr(0, 4), "glTF");
    EXPECT_EQ(get<std::uint32_t>(bytes, 4), 2U);
    EXPECT_EQ(get<std::uint32_t>(bytes, 8), bytes.size());
    const std::size_t n = get<std::uint32_t>(bytes, 12);
    EXPECT_EQ(n % 4, 0U);
    EXPECT_EQ(bytes.substr(16, 4), "JSON");
    glb.root = json::parse(bytes.substr(20, n));
    if (20 + n < bytes.size()) {
        EXPECT_EQ(get<std::uint32_t>(bytes, 20 + n), bytes.size() - 28 - n);
        EXPECT_EQ(bytes.substr(24 + n, 4), std::string("BIN\0", 4));
        glb.binary = bytes.substr(28 + n);
        EXPECT_EQ(glb.binary.size() % 4, 0U);
        EXPECT_EQ(glb.root["buffers"][0]["byteLength"], glb.binary.size());
    }
    return glb;
}

TEST_F(Exported, VoxelPlyHoldsTheCentresOfOccupiedVoxels)
{
    const Voxels v = some_voxels();
    const std::string ply = voxels_ply(v);
    EXPECT_THAT(ply, HasSubstr("element vertex 36\n"));
    const std::size_t start = ply.find("end_header\n") + 11;
    ASSERT_EQ(ply.size() - start, 36U * 15);
    EXPECT_FLOAT_EQ(get<float>(ply, start), 0.65F);
    EXPECT_FLOAT_EQ(get<float>(ply, start + 4), -0.85F);
    EXPECT_FLOAT_EQ(get<float>(ply, start + 8), 0.05F);
    EXPECT_EQ(get<unsigned char>(ply, start + 12), 40);
    EXPECT_EQ(get<unsigned char>(ply, start + 13), 50);
    EXPECT_EQ(get<unsigned char>(ply, start + 14), 200);
}

TEST_F(Exported, FilesAreWrittenWholeOrNamed)
{
    write_voxels(dir_, 3, some_voxels());
    write_mesh(dir_, 3, mesh_of(some_voxels()));
    write_glb(dir_ + "/site.glb", some_site());
    std::vector<std::string> names;
    for (const auto &entry : fs::directory_iterator(dir_)) names.push_back(entry.path().filename());
    EXPECT_THAT(names, testing::UnorderedElementsAre("3.voxels.ply", "3.ply", "site.glb"));
    try {
        write_mesh(dir_ + "/no/such", 1, {});
        FAIL();
    } catch (const std::runtime_error &e) {
        EXPECT_THAT(e.what(), HasSubstr("no/such/1.ply"));
    }
}

TEST_F(Exported, GlbHasItsPartsInPlaceAndYUp)
{
    const Glb glb = parse(glb_of(some_site()));
    std::vector<std::string> names;
    for (const json &node : glb.root["nodes"]) names.push_back(node["name"]);
    EXPECT_THAT(names, testing::ElementsAre("ground", "obstacle 1", "box 1", "suspected 2"));
    for (const json &view : glb.root["bufferViews"]) {
        EXPECT_EQ(view["byteOffset"].get<std::size_t>() % 4, 0U);
        EXPECT_LE(view["byteOffset"].get<std::size_t>() + view["byteLength"].get<std::size_t>(), glb.binary.size());
    }
    // Positions against their stated bounds, and the world's Z as height.
    for (const json &mesh : glb.root["meshes"]) {
        const json &accessor =
            glb.root["accessors"][mesh["primitives"][0]["attributes"]["POSITION"].get<std::size_t>()];
        const std::size_t at = glb.root["bufferViews"][accessor["bufferView"].get<std::size_t>()]["byteOffset"];
        float low[3] = {1e9F, 1e9F, 1e9F}, high[3] = {-1e9F, -1e9F, -1e9F};
        for (std::size_t n = 0; n < accessor["count"]; ++n)
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const float c = get<float>(glb.binary, at + 12 * n + 4 * axis);
                low[axis] = std::min(low[axis], c), high[axis] = std::max(high[axis], c);
            }
        for (std::size_t axis = 0; axis < 3; ++axis) {
            EXPECT_EQ(accessor["min"][axis].get<float>(), low[axis]);
            EXPECT_EQ(accessor["max"][axis].get<float>(), high[axis]);
        }
        if (mesh["name"] == "obstacle 1") {
            EXPECT_NEAR(low[1], 0, 1e-6);
            EXPECT_NEAR(high[1], 0.3, 0.05);
            EXPECT_NEAR(low[2], 0.6, 0.05); // world y ends at -0.6
            EXPECT_NEAR(high[2], 0.9, 0.05);
        }
        if (mesh["name"] == "ground") {
            EXPECT_FLOAT_EQ(low[0], -1);
            EXPECT_FLOAT_EQ(high[0], 3);
            EXPECT_FLOAT_EQ(low[2], -1.5);
            EXPECT_FLOAT_EQ(high[2], 1.5);
        }
    }
    // The picture inside.
    const json &view = glb.root["bufferViews"][glb.root["images"][0]["bufferView"].get<std::size_t>()];
    const auto begin = glb.binary.begin() + view["byteOffset"].get<std::ptrdiff_t>();
    const std::vector<uchar> png(begin, begin + view["byteLength"].get<std::ptrdiff_t>());
    EXPECT_EQ(cv::imdecode(png, cv::IMREAD_COLOR).at<cv::Vec3b>(3, 3), cv::Vec3b(80, 100, 120));
}

TEST_F(Exported, GlbOfNothingIsAValidEmptyScene)
{
    const Glb glb = parse(glb_of({}));
    EXPECT_TRUE(glb.binary.empty());
    for (const char *key : {"buffers", "meshes", "nodes", "accessors"}) EXPECT_FALSE(glb.root.contains(key)) << key;
    EXPECT_EQ(glb.root["asset"]["version"], "2.0");
}

TEST_F(Exported, GlbRefusesNumbersThatAreNone)
{
    GltfSite site = some_site();
    site.ground.metres_per_pixel = 0;
    EXPECT_THROW(glb_of(site), std::invalid_argument);
    site = some_site();
    site.obstacles[0].obb_centre.x() = NAN;
    EXPECT_THROW(glb_of(site), std::invalid_argument);
    site = some_site();
    site.ground.seen = cv::Mat1b(2, 2);
    EXPECT_THROW(glb_of(site), std::invalid_argument);
}

TEST_F(Exported, AssimpOpensThem)
{
    if (!run("assimp version").is_good) GTEST_SKIP() << "assimp (Debian: assimp-utils) is not installed: NOT CHECKED";
    const SurfaceMesh mesh = mesh_of(some_voxels());
    write_mesh(dir_, 1, mesh);
    write_glb(dir_ + "/site.glb", some_site());
    const Said ply = run("assimp info " + dir_ + "/1.ply");
    EXPECT_TRUE(ply.is_good) << ply.text;
    EXPECT_THAT(ply.text, testing::ContainsRegex("Faces: +" + std::to_string(mesh.triangles.size()) + "\n"));
    const Said glb = run("assimp info " + dir_ + "/site.glb");
    EXPECT_TRUE(glb.is_good) << glb.text;
    EXPECT_THAT(glb.text, testing::ContainsRegex("Meshes: +4\n"));
    EXPECT_THAT(glb.text,
                testing::ContainsRegex("Faces: +" + std::to_string(mesh.triangles.size() + 2 + 12 + 12) + "\n"));
    EXPECT_THAT(glb.text, testing::ContainsRegex("Textures \\(embed\\.\\): +1"));
    std::ofstream(dir_ + "/cut.ply") << mesh_ply(mesh).substr(0, 300);
    EXPECT_FALSE(run("assimp info " + dir_ + "/cut.ply").text.find("Meshes:") != std::string::npos &&
                 run("assimp info " + dir_ + "/cut.ply").is_good);
}

TEST_F(Exported, TrimeshFindsThemWatertight)
{
    if (!run("python3 -c 'import trimesh'").is_good) GTEST_SKIP() << "python3 has no trimesh: NOT CHECKED";
    write_mesh(dir_, 1, mesh_of(some_voxels()));
    write_glb(dir_ + "/site.glb", some_site());
    const Said said = run("python3 -c 'import trimesh\n"
                          "m = trimesh.load(\"" +
                          dir_ +
                          "/1.ply\", process=False)\n"
                          "assert m.is_watertight and m.is_winding_consistent and m.volume > 0\n"
                          "s = trimesh.load(\"" +
                          dir_ +
                          "/site.glb\")\n"
                          "assert len(s.geometry) == 4\n"
                          "print(\"good\")'");
    EXPECT_EQ(said.text, "good\n");
}

} // namespace
} // namespace outcrop
