// SPDX-License-Identifier: BSD-3-Clause
// The measures of outcrop-eval against closed forms and brute force; its readers against bad files.
#include "site_maker.h"

#include "eval/camera.h"
#include "eval/geometry.h"
#include "eval/image_quality.h"
#include "eval/json_file.h"
#include "eval/mesh.h"
#include "eval/metrics_box.h"
#include "eval/npz.h"
#include "eval/ply.h"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

namespace outcrop::eval {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::HasSubstr;

// A folder of the test's own, gone after it.
class Scratch {
public:
    Scratch()
    {
        const auto *test = testing::UnitTest::GetInstance()->current_test_info();
        dir_ = fs::path(testing::TempDir()) /
               ("outcrop_eval_" + std::string(test->test_suite_name()) + "_" + test->name());
        fs::remove_all(dir_);
        fs::create_directories(dir_);
    }
    ~Scratch() { fs::remove_all(dir_); }
    Scratch(const Scratch &) = delete;
    Scratch &operator=(const Scratch &) = delete;
    fs::path operator/(const std::string &name) const { return dir_ / name; }

private:
    fs::path dir_;
};

// The one line of the error that `read` ends with; empty when it does not.
template <typename Read>
std::string error_of(Read read)
{
    try {
        read();
    } catch (const EvalError &e) {
        return e.what();
    }
    return {};
}

// ---- boxes

TEST(BoxIou, IsTheRatioOfVolumes)
{
    const Box a{{0, 0, 0}, {2, 2, 2}}, b{{1, 1, 1}, {3, 3, 3}};
    EXPECT_DOUBLE_EQ(iou(a, b), 1.0 / 15);
    EXPECT_DOUBLE_EQ(iou(a, a), 1);
    EXPECT_DOUBLE_EQ(iou(a, Box{{2, 0, 0}, {3, 2, 2}}), 0); // they touch
    EXPECT_DOUBLE_EQ(iou(a, Box{{5, 5, 5}, {6, 6, 6}}), 0);
    EXPECT_DOUBLE_EQ(contained_share(Box{{1, 1, 1}, {3, 2, 2}}, a), 0.5);
    EXPECT_DOUBLE_EQ(iou(Box{}, Box{}), 0);
}

TEST(YawBoxIou, OfASquareTurnedByAnEighthIsTheOctagon)
{
    const YawBox a{{0, 0, 0.5}, {1, 1, 1}, 0}, b{{0, 0, 0.5}, {1, 1, 1}, M_PI / 4};
    const double octagon = 2 * (std::sqrt(2.0) - 1); // inscribed in the unit square
    EXPECT_NEAR(iou(a, b), octagon / (2 - octagon), 1e-12);
    EXPECT_NEAR(iou(b, b), 1, 1e-12);
}

TEST(YawBoxIou, IsTheAxisAlignedOneWithoutYawAndSeesHeight)
{
    const YawBox a{{1, 1, 1}, {2, 2, 2}, 0}, b{{2, 2, 2}, {2, 2, 2}, 0};
    EXPECT_NEAR(iou(a, b), 1.0 / 15, 1e-12);
    EXPECT_NEAR(iou(a, YawBox{{1, 1, 4}, {2, 2, 2}, 0.3}), 0, 1e-12);
    // The same box named by its other side.
    EXPECT_NEAR(iou(YawBox{{1, 2, 3}, {4, 2, 1}, 0.4}, YawBox{{1, 2, 3}, {2, 4, 1}, 0.4 - M_PI / 2}), 1, 1e-12);
}

TEST(YawBoxIou, AgreesWithCountedCells)
{
    const YawBox a{{0.1, 0.2, 0}, {1.4, 0.7, 1}, 0.3}, b{{0.3, 0.1, 0}, {0.9, 1.1, 1}, -0.9};
    const auto holds = [](const YawBox &box, const Vector2d &p) {
        const Vector2d d = p - box.centre_m.head<2>();
        const double c = std::cos(box.yaw_rad), s = std::sin(box.yaw_rad);
        return std::abs(c * d.x() + s * d.y()) <= box.size_m.x() / 2 &&
               std::abs(c * d.y() - s * d.x()) <= box.size_m.y() / 2;
    };
    int common = 0, whole = 0;
    for (int i = 0; i < 1000; i++)
        for (int j = 0; j < 1000; j++) {
            const Vector2d p(-1 + 0.0025 * i, -1 + 0.0025 * j);
            common += holds(a, p) && holds(b, p);
            whole += holds(a, p) || holds(b, p);
        }
    EXPECT_NEAR(iou(a, b), static_cast<double>(common) / whole, 2e-3);
}

TEST(MinAreaBox, FindsBackATurnedBox)
{
    const YawBox box{{0.5, -2, 1}, {3, 1, 2}, 0.7};
    std::vector<Vector3d> points;
    for (const Vector2d &p : footprint(box)) {
        points.emplace_back(p.x(), p.y(), 0);
        points.emplace_back(p.x(), p.y(), 2);
    }
    points.emplace_back(0.5, -2, 1); // inside
    const YawBox found = min_area_box(points);
    EXPECT_NEAR(iou(found, box), 1, 1e-9);
    EXPECT_NEAR(found.size_m.prod(), 6, 1e-9);
    EXPECT_GT(found.yaw_rad, -M_PI / 2);
    EXPECT_LE(found.yaw_rad, M_PI / 2);
}

TEST(ConvexHull, DropsInnerAndCollinearPoints)
{
    const Polygon hull = convex_hull({{0, 0}, {1, 0}, {2, 0}, {2, 2}, {1, 1}, {0, 2}, {0, 0}});
    EXPECT_EQ(hull.size(), 4u);
    EXPECT_DOUBLE_EQ(area(hull), 4);
}

// ---- meshes

Mesh box_mesh(const Box &box)
{
    // Every cell of a one-cell lattice has outward faces; stretch it onto the box.
    Lattice one;
    one.cell_m = 1;
    one.first_centre_m = Vector3d::Constant(0.5);
    one.nx = one.ny = one.nz = 1;
    Mesh mesh = cell_surface({1}, one);
    for (Vector3d &v : mesh.vertices) v = box.min_m + v.cwiseProduct(box.max_m - box.min_m);
    return mesh;
}

Mesh join(Mesh a, const Mesh &b)
{
    const auto shift = static_cast<std::uint32_t>(a.vertices.size());
    a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
    for (const auto &t : b.triangles) a.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
    return a;
}

Lattice unit_cells(int n)
{
    Lattice g;
    g.cell_m = 1;
    g.first_centre_m = Vector3d::Constant(0.5);
    g.nx = g.ny = g.nz = n;
    return g;
}

TEST(Occupancy, CountsOverlappingShellsOnce)
{
    const Mesh mesh = join(box_mesh({{1, 1, 1}, {5, 5, 5}}), box_mesh({{3, 3, 3}, {8, 8, 8}}));
    const auto inside = occupancy(mesh, unit_cells(9));
    EXPECT_EQ(std::count(inside.begin(), inside.end(), 1), 4 * 4 * 4 + 5 * 5 * 5 - 2 * 2 * 2);
    const auto seen = coverage(mesh, unit_cells(9));
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), 16 + 25 - 4);
}

TEST(Occupancy, LeavesTheGapUnderABridgeEmpty)
{
    const Mesh mesh = join(box_mesh({{0, 0, 0}, {2, 2, 1}}), box_mesh({{0, 0, 3}, {2, 2, 4}}));
    const auto inside = occupancy(mesh, unit_cells(4));
    EXPECT_EQ(std::count(inside.begin(), inside.end(), 1), 8);
    EXPECT_EQ(inside[unit_cells(4).index(0, 0, 2)], 0);
}

TEST(MeanDistance, OfAShiftedSheetIsTheShift)
{
    const Mesh box = box_mesh({{0, 0, 0}, {10, 10, 1}});
    EXPECT_NEAR(mean_distance_m({{5, 5, 1.25}, {2, 3, -0.25}, {10.25, 5, 0.5}}, box), 0.25, 1e-12);
    EXPECT_NEAR(mean_distance_m({{13, 14, 1}}, box), 5, 1e-12);   // from an edge
    EXPECT_NEAR(mean_distance_m({{5, 5, 0.8}}, box), 0.2, 1e-12); // from inside
}

TEST(SampleSurface, LiesOnTheSurfaceAndSkipsWhatIsSwallowed)
{
    const Mesh box = box_mesh({{0, 0, 0}, {2, 2, 2}});
    const Mesh both = join(box, box_mesh({{0.5, 0.5, 0.5}, {1, 1, 1}}));
    const auto points = sample_surface(both, 1000);
    EXPECT_NEAR(static_cast<double>(points.size()), 1000 * 24 / 25.5, 10);
    EXPECT_NEAR(mean_distance_m(points, box), 0, 1e-12);
}

// ---- image quality

TEST(Psnr, FollowsItsFormula)
{
    const cv::Mat a(20, 30, CV_8UC3, cv::Scalar(100, 100, 100)), b(20, 30, CV_8UC3, cv::Scalar(110, 100, 100));
    SquaredError whole, part, none, same;
    whole.add(a, b);
    EXPECT_NEAR(*whole.psnr_db(), 10 * std::log10(255.0 * 255.0 * 3 / 100), 1e-9);
    cv::Mat mask(20, 30, CV_8U, cv::Scalar(0));
    none.add(a, b, mask);
    EXPECT_FALSE(none.psnr_db());
    mask.at<std::uint8_t>(3, 4) = 255;
    cv::Mat c = a.clone();
    c.at<cv::Vec3b>(3, 4) = {255, 100, 100}; // 155 off in one of three channels
    part.add(a, c, mask);
    EXPECT_NEAR(*part.psnr_db(), 10 * std::log10(255.0 * 255.0 * 3 / (155.0 * 155.0)), 1e-9);
    same.add(a, a);
    EXPECT_DOUBLE_EQ(*same.psnr_db(), kIdenticalDb);
}

TEST(Ssim, OfFlatImagesIsTheLuminanceTerm)
{
    const cv::Mat a(30, 30, CV_8UC1, cv::Scalar(100)), b(30, 30, CV_8UC1, cv::Scalar(130));
    const double c1 = 6.5025;
    EXPECT_NEAR(ssim(a, b), (2 * 100 * 130 + c1) / (100 * 100 + 130 * 130 + c1), 1e-9);
    EXPECT_NEAR(ssim(a, a), 1, 1e-12);
}

TEST(Ssim, OfOneWindowAgreesWithItsDefinition)
{
    const unsigned seed = 7;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    cv::Mat a(11, 11, CV_8UC1), b(11, 11, CV_8UC1);
    double w_sum = 0, mx = 0, my = 0, xx = 0, yy = 0, xy = 0;
    for (int v = 0; v < 11; v++)
        for (int u = 0; u < 11; u++) {
            const double x = random() % 256, y = std::min(255.0, x / 2 + random() % 90);
            a.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(x);
            b.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(y);
            const double y8 = b.at<std::uint8_t>(v, u);
            const double w = std::exp(-((u - 5) * (u - 5) + (v - 5) * (v - 5)) / (2 * 1.5 * 1.5));
            w_sum += w, mx += w * x, my += w * y8, xx += w * x * x, yy += w * y8 * y8, xy += w * x * y8;
        }
    mx /= w_sum, my /= w_sum;
    const double vx = xx / w_sum - mx * mx, vy = yy / w_sum - my * my, vxy = xy / w_sum - mx * my;
    const double c1 = 6.5025, c2 = 58.5225;
    EXPECT_NEAR(ssim(a, b), (2 * mx * my + c1) * (2 * vxy + c2) / ((mx * mx + my * my + c1) * (vx + vy + c2)), 1e-9);
}

// ---- camera

TEST(Camera, ProjectsWhatItsRayMeetsDistortionIncluded)
{
    Camera c;
    c.width = 640, c.height = 480, c.fx = 500, c.fy = 510, c.cx = 322, c.cy = 238;
    c.dist = {-0.12, 0.03, 0.001, -0.002, 0.004};
    c.rotation_cam_from_world = Eigen::AngleAxisd(2.5, Vector3d(1, 0.2, 0.1).normalized()).toRotationMatrix();
    c.translation_m = -c.rotation_cam_from_world * Vector3d(0.3, -0.2, 2);
    for (const Vector2d &pixel : {Vector2d(10, 20), Vector2d(600, 100), Vector2d(322, 238)}) {
        const auto at = c.project(c.centre_m() + 1.7 * c.ray(pixel));
        ASSERT_TRUE(at);
        EXPECT_NEAR((at->pixel - pixel).norm(), 0, 1e-7);
        EXPECT_NEAR(at->depth_m, 1.7, 1e-12);
        const auto ground = c.on_ground(pixel);
        ASSERT_TRUE(ground);
        EXPECT_NEAR(ground->z(), 0, 1e-12);
        EXPECT_NEAR((c.project(*ground)->pixel - pixel).norm(), 0, 1e-7);
    }
    EXPECT_FALSE(c.project(c.centre_m() - c.ray({322, 238})));
}

TEST(Camera, RefusesWhatIsNoCamera)
{
    const Scratch scratch;
    const fs::path file = scratch / "cameras.json";
    const std::string good = R"({"units":"mm","views":[{"image":"a.png","width":64,"height":48,"fx":50,"fy":50,"cx":32,
        "cy":24,"R":[[1,0,0],[0,1,0],[0,0,1]],"t":[0,0,1000]}]})";
    const auto fault = [&](const std::string &what, const std::string &with) {
        std::string text = good;
        text.replace(text.find(what), what.size(), with);
        write_text(file, text);
        return error_of([&] { read_cameras(file, "views"); });
    };
    write_text(file, good);
    EXPECT_DOUBLE_EQ(read_cameras(file, "views").cameras[0].translation_m.z(), 1);
    EXPECT_THAT(fault("[1,0,0]", "[2,0,0]"), HasSubstr("cameras.json: views[0].R: not a rotation"));
    EXPECT_THAT(fault("[1,0,0]", "[-1,0,0]"), HasSubstr("not a rotation")); // a mirror
    EXPECT_THAT(fault("\"fx\":50", "\"fx\":-1"), HasSubstr("focal length not positive"));
    EXPECT_THAT(fault("\"fx\":50", "\"fx\":\"a\""), HasSubstr("views[0].fx: not a number"));
    EXPECT_THAT(fault("\"cx\":32,", ""), HasSubstr("has no \"cx\""));
    EXPECT_THAT(fault("\"mm\"", "\"inch\""), HasSubstr("units: neither"));
    EXPECT_THAT(fault("]}]}", "]}"), HasSubstr("not valid JSON at line 2, column "));
}

// ---- files

TEST(Npz, ReadsEveryTypeAndVersionItNames)
{
    const Scratch scratch;
    const fs::path file = scratch / "a.npz";
    cv::Mat depth(3, 5, CV_32F), mask(3, 5, CV_8U, cv::Scalar(7));
    for (int i = 0; i < 15; i++) depth.at<float>(i / 5, i % 5) = 0.5F + static_cast<float>(i);
    for (const char *type : {"<f4", "<f2"}) {
        for (const int version : {1, 2}) {
            write_npz(file, depth, mask, type, version);
            EXPECT_EQ(cv::norm(read_npz(file, "depth"), depth, cv::NORM_INF), 0) << type << version;
            EXPECT_EQ(cv::norm(read_npz(file, "mask"), mask, cv::NORM_INF), 0);
        }
    }
}

TEST(Npz, NamesFileAndFault)
{
    const Scratch scratch;
    const fs::path file = scratch / "a.npz";
    const cv::Mat depth(3, 5, CV_32F, cv::Scalar(1)), mask(3, 5, CV_8U, cv::Scalar(0));
    const auto fault = [&](const std::string &name) { return error_of([&] { read_npz(file, name); }); };
    EXPECT_THAT(fault("depth"), HasSubstr("a.npz: cannot be opened"));
    write_text(file, "PK not a zip");
    EXPECT_THAT(fault("depth"), HasSubstr("cannot be opened as an .npz"));
    write_npz(file, depth, mask, "<f8");
    EXPECT_THAT(fault("depth"), HasSubstr("dtype <f8"));
    EXPECT_THAT(fault("normal"), HasSubstr("holds no array \"normal.npy\""));
    write_npz(file, depth, mask, "<f4", 3);
    EXPECT_THAT(fault("depth"), HasSubstr("version 1 or 2"));
    write_npz(file, mask, mask, "<f4"); // a quarter of the bytes its shape needs
    EXPECT_THAT(fault("depth"), HasSubstr("15 bytes of data where the shape needs 60"));
}

TEST(Ply, NamesFileAndFault)
{
    const Scratch scratch;
    const fs::path file = scratch / "a.ply";
    const std::string head =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
        "z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
    const auto fault = [&](const std::string &text) {
        write_text(file, text);
        return error_of([&] { read_ply(file, 1); });
    };
    EXPECT_EQ(fault(head + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), "");
    EXPECT_DOUBLE_EQ(read_ply(file, 1e-3).vertices[1].x(), 1e-3);
    EXPECT_THAT(fault(head + "0 0 0\n1 0 0\n"), HasSubstr("a.ply: ends early"));
    EXPECT_THAT(fault(head + "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"), HasSubstr("index out of range"));
    EXPECT_THAT(fault("ply\nformat binary_big_endian 1.0\nend_header\n"), HasSubstr("cannot read \"format"));
    EXPECT_THAT(fault("plx\n"), HasSubstr("not a PLY file"));
    EXPECT_THAT(fault("ply\nformat ascii 1.0\n"), HasSubstr("header ends early"));
}

// An upright prism over a regular polygon; four corners and a stretch make a rectangle.
TrueObstacle prism(int corners, double stretch, double yaw_rad)
{
    TrueObstacle t;
    t.index = 1;
    for (int n = 0; n < corners; ++n) {
        const double a = 2 * M_PI * n / corners + M_PI / 4;
        const Vector2d p(stretch * std::cos(a), std::sin(a));
        for (const double z : {0.0, 1.0})
            t.mesh.vertices.emplace_back(std::cos(yaw_rad) * p.x() - std::sin(yaw_rad) * p.y(),
                                         std::sin(yaw_rad) * p.x() + std::cos(yaw_rad) * p.y(), z);
    }
    t.obb = min_area_box(t.mesh.vertices);
    t.aabb.min_m = t.aabb.max_m = t.mesh.vertices.front();
    for (const Vector3d &v : t.mesh.vertices)
        t.aabb.min_m = t.aabb.min_m.cwiseMin(v), t.aabb.max_m = t.aabb.max_m.cwiseMax(v);
    return t;
}

TEST(YawError, OnlyRectanglesHaveOneAndQuarterTurnsAreNone)
{
    EXPECT_TRUE(has_yaw(prism(4, 2, 0.3)));
    EXPECT_FALSE(has_yaw(prism(3, 1, 0.3)));
    EXPECT_FALSE(has_yaw(prism(40, 1, 0.3)));
    for (const double yaw : {-1.3, -0.4, 0.0, 0.9, 1.5})
        for (const double off_deg : {-44.0, -3.0, 0.0, 7.0, 40.0})
            for (const int quarter : {-1, 0, 1}) {
                Truth truth;
                truth.obstacles = {prism(4, 1.5, yaw)};
                eval::Run run;
                FoundObstacle found;
                found.index = 5;
                found.aabb = truth.obstacles->front().aabb;
                found.obb = truth.obstacles->front().obb;
                found.obb.yaw_rad += off_deg * M_PI / 180 + quarter * M_PI / 2;
                run.obstacles = {found};
                const auto metrics = evaluate_boxes(truth, run);
                ASSERT_TRUE(metrics && metrics->boxes[0].yaw_error_deg);
                EXPECT_NEAR(*metrics->boxes[0].yaw_error_deg, std::abs(off_deg), 1e-6) << yaw << ' ' << off_deg;
            }
    Truth round;
    round.obstacles = {prism(40, 1, 0)};
    eval::Run run;
    run.obstacles = {FoundObstacle{1, round.obstacles->front().aabb, round.obstacles->front().obb, std::nullopt}};
    EXPECT_FALSE(evaluate_boxes(round, run)->boxes[0].yaw_error_deg);
}

} // namespace
} // namespace outcrop::eval
