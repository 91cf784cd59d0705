// Backend `gl` of collision detection: agreement with backend `cpu`, error margins, capacity limits
// and fallbacks to the CPU. backends_test.cpp and certified_properties_test.cpp test its results.
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "common/collision/detection/cpu/contact_simd.h"
#include "common/collision/detection/gl/gl_contact_camera.h"
#include "common/collision/detection/gl/gl_detection.h"
#include "tests/support/collision/triangles.h"

namespace fivepipe::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

// The suite shares one detection, because it compiles its shaders.
class GlDetectionTest : public GlTest {
 protected:
  static void SetUpTestSuite() {
    GlTest::SetUpTestSuite();
    detection_ = new collision::GlDetection;
  }
  static void TearDownTestSuite() {
    delete detection_;
    GlTest::TearDownTestSuite();
  }

  static std::vector<collision::ObjectCollision> detect(
      collision::GlDetection& detection, const CollisionHull& hull,
      std::span<const collision::DetectionObject> objects,
      const collision::DetectionOptions& options) {
    detection.set_hull(hull.query);
    const std::span<const collision::ObjectCollision> found =
        detection.detect(objects, options, &counts_);
    EXPECT_EQ(counts_.unconfirmed, 0u);
    EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR));
    return {found.begin(), found.end()};
  }
  static collision::ObjectCollision detect(
      const CollisionHull& hull, const collision::Bvh& tree,
      const collision::DetectionOptions& options = kVerdictOnly,
      const Isometry3d& world_from_object = Isometry3d::Identity()) {
    const collision::DetectionObject object{&tree, world_from_object, kOrigin};
    return detect(*detection_, hull, {&object, 1}, options)[0];
  }

  // Both backends return the same verdicts, except for triangles that one of them leaves undecided:
  // at most one, and one in a hundred.
  static void expect_as_cpu(const CollisionHull& hull,
                            std::span<const collision::DetectionObject> objects,
                            const collision::DetectionOptions& options) {
    const auto gl = detect(*detection_, hull, objects, options),
               cpu = collision::detect(hull.query, objects, options);
    for (std::size_t i = 0; i < objects.size(); ++i) {
      const std::size_t triangles = objects[i].tree->mesh().triangles.size();
      if (triangles > 0) {
        EXPECT_LE(gl[i].undecided.size() * 100, 100 + triangles);
      }
      for (std::size_t t = 0; t < triangles; ++t) {
        if (test::holds(gl[i].undecided, t) || test::holds(cpu[i].undecided, t)) continue;
        EXPECT_EQ(test::holds(gl[i].triangles, t), test::holds(cpu[i].triangles, t))
            << i << ' ' << t;
      }
      if (gl[i].verdict == cpu[i].verdict) {
        EXPECT_EQ(gl[i].hull_in_box, cpu[i].hull_in_box);
      }
      for (const collision::CollisionPoint& p : gl[i].points) {
        EXPECT_TRUE(hull::in_hull(hull.silhouettes, p.p_world_m));
        EXPECT_TRUE(test::holds(gl[i].triangles, p.triangle));
      }
    }
  }

  static inline collision::GlDetection* detection_ = nullptr;
  static inline collision::GlDetectionCounts counts_;  // of the last detect()
};

TEST_F(GlDetectionTest, AgreesWithBackendCpuFromOneToSixteenCameras) {
  Random random(1);
  for (const int cameras : {1, 2, 3, 5, 16}) {
    const CollisionHull hull(
        silhouettes_of({random_cameras(random, cameras), random_object(random, 3)}));
    const collision::Bvh tree(mesh_of(random_triangles(random, 400)));
    const collision::DetectionObject object{&tree};
    for (const double eps_m : {3e-3, 0.5e-3, 0.1e-3})
      expect_as_cpu(hull, {&object, 1}, {.eps_m = eps_m, .spacing_m = 0});
    expect_as_cpu(hull, {&object, 1}, kAllPoints);
  }
}

TEST_F(GlDetectionTest, AgreesWithBackendCpuForABatchOfObjects) {
  Random random(3);
  std::vector<collision::Bvh> trees;
  std::vector<collision::DetectionObject> objects;
  const CollisionHull hull(hand_like());
  for (const int triangles : {90, 1, 700, 0, 20, 16, 257})
    trees.emplace_back(mesh_of(random_triangles(random, triangles)));
  for (const collision::Bvh& tree : trees)
    objects.push_back({&tree, at(random_in_ball(random, 0.05))});
  expect_as_cpu(hull, objects, kVerdictOnly);
}

TEST_F(GlDetectionTest, AgreesWithBackendCpuInNoise) {
  Random random(10);
  std::vector<hull::Silhouette> silhouettes;
  for (const geometry::Camera& camera : random_cameras(random, 3))
    silhouettes.push_back(
        {camera, random_pixels(random, camera.pinhole.width_px, camera.pinhole.height_px, 0.3)});
  const CollisionHull hull(silhouettes);
  const collision::Bvh tree(mesh_of(random_triangles(random, 60)));
  const collision::DetectionObject object{&tree};
  expect_as_cpu(hull, {&object, 1}, kVerdictOnly);
  expect_as_cpu(hull, {&object, 1}, kAllPoints);
}

TEST_F(GlDetectionTest, AgreesWithBackendCpuForAMillionTriangles) {
  const CollisionHull hull(hand_like());
  const collision::Bvh tree(geometry::curtain_mesh(2, 2, 1000, 500, 0, 1));
  const collision::DetectionObject object{&tree, sheet_through_the_hand()};
  const collision::ObjectCollision gl = detect(hull, tree, kVerdictOnly, sheet_through_the_hand()),
                                   cpu =
                                       collision::detect(hull.query, {&object, 1}, kVerdictOnly)[0];
  EXPECT_NEAR(double(gl.triangles.size()), double(cpu.triangles.size()), 20);
  EXPECT_GT(counts_.descent_ms, 0);
  EXPECT_GT(counts_.refine_ms, 0);
}

// Triangles that cross a camera's plane are walked on the CPU; the GPU decides the others.
TEST_F(GlDetectionTest, WalksTrianglesAtACamerasPlaneOnTheCpu) {
  const CollisionHull hull(silhouettes_of({ball(kOrigin, 0.05)}, ring(4, 1.2, 0.6, 300, 0.5)));
  Random random(13);
  std::vector<collision::Triangle> triangles;
  for (int i = 0; i < 300; ++i) triangles.push_back(random_triangle(random, 1.5, 2));
  const collision::Bvh tree(mesh_of(triangles));
  const collision::DetectionObject object{&tree};
  expect_as_cpu(hull, {&object, 1}, kVerdictOnly);
  EXPECT_GT(counts_.triangles_on_cpu, 0u);
  EXPECT_LT(counts_.triangles_on_cpu, counts_.triangles_open);
}

TEST_F(GlDetectionTest, DecidesNineOfTenTrianglesOnTheGpu) {
  Random random(11);
  std::size_t open = 0, on_cpu = 0;
  for (int scene = 0; scene < 5; ++scene) {
    const CollisionHull hull(
        scene == 0 ? hand_like()
                   : silhouettes_of({random_cameras(random, 2 + scene), random_object(random, 3)}));
    detect(hull, collision::Bvh(mesh_of(random_triangles(random, 90))), kAllPoints);
    open += counts_.triangles_open, on_cpu += counts_.triangles_on_cpu;
  }
  EXPECT_GT(open, 100u);
  EXPECT_LT(on_cpu, 0.1 * double(open));
}

TEST_F(GlDetectionTest, IsBitIdenticalOnRepeat) {
  Random random(5);
  const CollisionHull hull(hand_like(), 2), other(hand_like());
  const collision::Bvh tree(mesh_of(random_triangles(random, 600)));
  const collision::ObjectCollision first = detect(hull, tree, kAllPoints);
  for (int i = 0; i < 5; ++i) {
    const collision::ObjectCollision again = detect(i % 2 ? hull : other, tree, kAllPoints);
    EXPECT_EQ(again.points, first.points);
    EXPECT_EQ(again.triangles, first.triangles);
    EXPECT_EQ(again.undecided, first.undecided);
  }
}

// Both backends sample the same grid, so they find the same samples.
TEST_F(GlDetectionTest, FindsTheSamePointCountAsBackendCpu) {
  const CollisionHull hull(hand_like());
  for (const int subdivisions : {1, 3}) {
    const collision::Bvh tree(geometry::sphere_mesh(0.04, subdivisions));
    const collision::DetectionObject object{&tree, at({-0.05, 0, 0}), {1, 0.3, 0.2}};
    for (const double spacing_m : {10e-3, 3e-3, 0.5e-3}) {
      const collision::DetectionOptions options{.spacing_m = spacing_m, .max_points = 1u << 20};
      const auto gl = detect(*detection_, hull, {&object, 1}, options)[0],
                 cpu = collision::detect(hull.query, {&object, 1}, options)[0];
      EXPECT_EQ(gl.triangles, cpu.triangles);
      // The corner of a solid part, at most one per triangle, depends on the order of the parts.
      EXPECT_NEAR(double(gl.points.size()), double(cpu.points.size()), double(gl.triangles.size()));
      EXPECT_GT(gl.points.size(), gl.triangles.size());
    }
  }
}

// A refinement that exceeds the capacity runs again with twice as much; at the maximum, the CPU
// walks the triangles. No result is lost.
TEST_F(GlDetectionTest, FallsBackToTheCpuWithoutBufferSpace) {
  Random random(9);
  const CollisionHull hull(hand_like());
  const collision::Bvh tree(mesh_of(random_triangles(random, 300)));
  const collision::DetectionObject object{&tree};
  for (const collision::DetectionOptions& options : {kVerdictOnly, kAllPoints}) {
    const collision::ObjectCollision expected = detect(hull, tree, options);
    EXPECT_EQ(counts_.overflows, 0u);
    collision::GlDetection growing({.first = 64, .max = 1 << 18}),
        limited({.first = 64, .max = 128});
    const auto grown = detect(growing, hull, {&object, 1}, options)[0];
    EXPECT_GT(counts_.overflows, 1u);
    EXPECT_LT(counts_.triangles_on_cpu, 20u);
    EXPECT_EQ(grown.points, expected.points);
    EXPECT_EQ(grown.triangles, expected.triangles);
    const auto walked = detect(limited, hull, {&object, 1}, options)[0];
    EXPECT_GT(counts_.triangles_on_cpu, 50u);
    EXPECT_EQ(walked.triangles, expected.triangles);
    EXPECT_EQ(walked.undecided, expected.undecided);
  }
}

// The uniform block of the shaders holds 64 cameras. With more, backend `cpu` tests the objects.
TEST_F(GlDetectionTest, LeavesMoreThanSixtyFourCamerasToBackendCpu) {
  Random random(15);
  const collision::Bvh tree(mesh_of(random_triangles(random, 100)));
  const collision::DetectionObject object{&tree};
  for (const int cameras : {64, 65}) {
    const CollisionHull hull(
        silhouettes_of({ball(kOrigin, 0.06)}, ring(cameras, 1.2, 0.6, 60, 0.5)));
    expect_as_cpu(hull, {&object, 1}, kAllPoints);
    EXPECT_EQ(counts_.objects_on_cpu, cameras > 64 ? 1u : 0u);
  }
}

TEST_F(GlDetectionTest, LeavesAnObjectTooLargeForFloatToBackendCpu) {
  const CollisionHull hull(hand_like());
  const collision::Bvh tree(
      mesh_of({{Vector3d(-1e37, -1e37, 0), Vector3d(1e37, -1e37, 0), Vector3d(0, 1e37, 0)}}));
  EXPECT_NE(detect(hull, tree).verdict, collision::CollisionVerdict::free);
  EXPECT_EQ(counts_.objects_on_cpu, 1u);
}

// The GPU identifies a BVH by content(), so a change must give a new number.
TEST_F(GlDetectionTest, ARefittedCopyOfABvhHasNewContent) {
  const geometry::Mesh mesh = geometry::curtain_mesh(0.3, 0.3, 20, 18, 0.02, 3);
  const collision::Bvh tree(mesh);
  collision::Bvh copy = tree;
  EXPECT_EQ(copy.content(), tree.content());
  copy.refit(mesh.vertices_m);
  EXPECT_NE(copy.content(), tree.content());
}

// The certified margin bounds the error of an image that float computes, and is not far larger.
TEST_F(GlDetectionTest, ErrorMarginBoundsFloatRounding) {
  Random random(6);
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    const double radius_m = std::exp(uniform(random, std::log(0.01), std::log(10)));
    Isometry3d pose = at(random_in_ball(random, 2));
    pose.linear() = random_rotation(random, 0, 3).toRotationMatrix();
    hull::CpuHull::MapCamera camera;
    camera.camera = random_camera(random, 720, 486);
    hull::ObjectPixels pixels(720, 486);
    for (int k = 0; k < 2; ++k) {
      const int u = int(uniform(random, 0, 720)), v = int(uniform(random, 0, 486));
      pixels.set(u, v);
    }
    camera.skip_map.assign(pixels);
    const collision::gl_contact::GlCamera c = collision::gl_camera(camera, pose, radius_m);
    const Eigen::Vector2d pixel_px{uniform(random, 0, 720), uniform(random, 0, 486)};
    const Vector3d p =
        pose.inverse() *
        (geometry::camera_center_world_m(camera.camera) +
         uniform(random, 0.1, 3) * geometry::ray_through(camera.camera, pixel_px).direction_world);
    if (!(p.norm() < radius_m)) continue;
    const Eigen::Vector3f q = p.cast<float>();
    const auto form = [&](int row) {
      return c.at[row] + q.x() * c.of_x[row] + q.y() * c.of_y[row] + q.z() * c.of_z[row];
    };
    const float w = form(2),
                margin_px = (c.of_x[3] + float(radius_m) * c.at[3]) / w + c.farthest_px * c.of_z[3];
    if (!(w > 0 && margin_px < collision::kMaxContactEps_px)) continue;
    const auto uv_px = geometry::project(camera.camera, pose * p);
    ASSERT_TRUE(uv_px);
    const collision::BasePixel base = collision::base_pixel(camera);
    const double off_u = form(0) / w + base.u - 0.5 - uv_px->x(),
                 off_v = form(1) / w + base.v - 0.5 - uv_px->y();
    if (std::abs(form(0) / w) > c.farthest_px || std::abs(form(1) / w) > c.farthest_px) continue;
    worst = std::max({worst, std::abs(off_u) / margin_px, std::abs(off_v) / margin_px});
  }
  EXPECT_LT(worst, 1);
  EXPECT_GT(worst, 0.005);
}

void expect_equal(const collision::GlDetectionCounts& a, const collision::GlDetectionCounts& b) {
  EXPECT_EQ(a.triangles_open, b.triangles_open);
  EXPECT_EQ(a.parts, b.parts);
  EXPECT_EQ(a.found, b.found);
  EXPECT_EQ(a.triangles_on_cpu, b.triangles_on_cpu);
  EXPECT_EQ(a.objects_on_cpu, b.objects_on_cpu);
  EXPECT_EQ(a.over_budget, b.over_budget);
}

// Each call counts from 0. A detection that has grown its buffers keeps them, and one that may not
// grow refines nothing.
TEST_F(GlDetectionTest, CountsEachCallAndKeepsItsBuffers) {
  Random random(16);
  const CollisionHull hull(hand_like());
  const collision::Bvh tree(mesh_of(random_triangles(random, 300))),
      huge(mesh_of({{Vector3d(-1e37, -1e37, 0), Vector3d(1e37, -1e37, 0), Vector3d(0, 1e37, 0)}}));
  const std::vector<collision::DetectionObject> objects{{&tree}, {&huge}};
  for (const collision::DetectionOptions& options : {kVerdictOnly, kAllPoints}) {
    detect(*detection_, hull, objects, options);
    const collision::GlDetectionCounts first = counts_;
    EXPECT_EQ(first.objects_on_cpu, 1u);
    EXPECT_GT(first.parts, first.triangles_open);
    EXPECT_GT(first.found, 0u);
    EXPECT_LT(first.found, first.parts);
    detect(*detection_, hull, objects, options);
    expect_equal(counts_, first);
    EXPECT_EQ(counts_.overflows, 0u);
    collision::GlDetection growing({.first = 64, .max = 1 << 18});
    detect(growing, hull, objects, options);
    const std::size_t overflows = counts_.overflows;
    EXPECT_GT(overflows, 1u);
    expect_equal(counts_, first);
    detect(growing, hull, objects, options);
    EXPECT_EQ(counts_.overflows, 0u);
    expect_equal(counts_, first);
    // The same room at once suffices; half of it does not.
    collision::GlDetection enough({.first = std::size_t{64} << overflows, .max = 1 << 18}),
        half({.first = std::size_t{32} << overflows, .max = std::size_t{32} << overflows});
    detect(enough, hull, objects, options);
    EXPECT_EQ(counts_.overflows, 0u);
    for (int call = 0; call < 2; ++call) {
      detect(half, hull, objects, options);
      EXPECT_EQ(counts_.overflows, 1u);
      EXPECT_EQ(counts_.parts, 0u);
      EXPECT_EQ(counts_.found, 0u);
      // All except those that are wholly in the hull.
      EXPECT_GT(double(counts_.triangles_on_cpu), 0.9 * double(counts_.triangles_open));
      EXPECT_LE(counts_.triangles_on_cpu, counts_.triangles_open);
    }
    // A free object, and no object.
    const std::vector<collision::DetectionObject> far{{&tree, at({3, 3, 0})}};
    detect(*detection_, hull, far, options);
    EXPECT_EQ(counts_.triangles_open + counts_.parts + counts_.found + counts_.objects_on_cpu, 0u);
  }
}

// Both backends have about the same margins, so they leave about the same triangles open.
TEST_F(GlDetectionTest, OpensAsManyTrianglesAsBackendCpu) {
  Random random(17);
  for (int scene = 0; scene < 4; ++scene) {
    const CollisionHull hull(
        scene == 0 ? hand_like()
                   : silhouettes_of({random_cameras(random, 1 + scene), random_object(random, 3)}));
    const collision::Bvh tree(mesh_of(random_triangles(random, 1500)));
    const collision::DetectionObject object{&tree};
    collision::CpuDetectionCounts cpu;
    collision::detect(hull.query, {&object, 1}, kVerdictOnly, &cpu);
    detect(hull, tree);
    EXPECT_NEAR(double(counts_.triangles_open), double(cpu.triangles_walked),
                2 + 0.005 * double(cpu.triangles_walked))
        << scene;
  }
}

// The origin minimises the squared distances to the cameras' lines of sight through their base
// pixels, with a thousandth of the squared distances to the cameras.
TEST_F(GlDetectionTest, TheOriginIsNearTheHull) {
  Random random(18);
  for (int scene = 0; scene < 5; ++scene) {
    const Vector3d center = random_in_ball(random, 0.05);
    const CollisionHull hull(
        silhouettes_of({ball(center, 0.04)}, random_cameras(random, 2 + scene, 400, 301)));
    const Vector3d origin = collision::world_origin_near_hull_m(hull.hull);
    EXPECT_LT((origin - center).norm(), 0.02) << scene;
    Vector3d slope = Vector3d::Zero();
    for (const hull::Silhouette& s : hull.silhouettes) {
      const hull::PixelRect bounds = s.pixels.bounds();
      const geometry::Ray ray = geometry::ray_through(
          s.camera,
          Eigen::Vector2d((bounds.u0_px + bounds.u1_px) / 2, (bounds.v0_px + bounds.v1_px) / 2));
      const Vector3d off = origin - ray.origin_world_m, d = ray.direction_world.normalized();
      slope += off - off.dot(d) * d + 1e-3 * off;
    }
    EXPECT_LT(slope.norm(), 1e-12) << scene;
  }
}

TEST_F(GlDetectionTest, CamerasHaveTheLimitsOfTheirMaps) {
  Random random(19);
  for (int i = 0; i < 50; ++i) {
    hull::CpuHull::MapCamera camera;
    camera.camera = random_camera(random, 320, 240);
    hull::ObjectPixels pixels(320, 240);
    for (int k = 0; k < 3; ++k) {
      const int u = int(uniform(random, 0, 320)), v = int(uniform(random, 0, 240));
      pixels.set(u, v);
    }
    camera.skip_map.assign(pixels);
    const hull::PixelRect bounds = pixels.bounds(), &stored = camera.skip_map.stored();
    const int u = (bounds.u0_px + bounds.u1_px) / 2, v = (bounds.v0_px + bounds.v1_px) / 2;
    const collision::BasePixel base = collision::base_pixel(camera);
    EXPECT_EQ(base.u, u);
    EXPECT_EQ(base.v, v);
    const Isometry3d pose = at(random_in_ball(random, 1));
    const double radius_m = uniform(random, 0.1, 1);
    const auto c = collision::gl_camera(camera, pose, radius_m);
    const int limits[2][4] = {
        {stored.u0_px - u, stored.u1_px - 1 - u, stored.v0_px - v, stored.v1_px - 1 - v},
        {bounds.u0_px - u, bounds.u1_px - u, bounds.v0_px - v, bounds.v1_px - v}};
    for (int k = 0; k < 4; ++k) {
      EXPECT_EQ(c.stored[k], float(limits[0][k]));
      EXPECT_EQ(c.bounds[k], float(limits[1][k]));
    }
    const double farthest_px = std::max(bounds.width_px(), bounds.height_px()) / 2.0 + 1;
    EXPECT_EQ(c.farthest_px, float(farthest_px));
    EXPECT_FLOAT_EQ(c.behind, float(-2 / farthest_px));
    // (U, V, W) of a point is its image, from the base pixel's border, times its depth.
    const Vector3d p = random_in_ball(random, radius_m);
    const Vector3d in_camera = camera.camera.camera_from_world * (pose * p);
    const geometry::Pinhole& k = camera.camera.pinhole;
    const double image[3] = {k.fx_px * in_camera.x() + (k.cx_px + 0.5 - u) * in_camera.z(),
                             k.fy_px * in_camera.y() + (k.cy_px + 0.5 - v) * in_camera.z(),
                             in_camera.z()};
    for (int row = 0; row < 3; ++row)
      EXPECT_NEAR(c.at[row] + p.x() * c.of_x[row] + p.y() * c.of_y[row] + p.z() * c.of_z[row],
                  image[row], 1e-3);
    // The margins are a small multiple of float's rounding of the terms.
    double terms = 0, at_terms = 0;
    for (int row = 0; row < 3; ++row) {
      const double weight = row < 2 ? 1 : farthest_px;
      at_terms = std::max(at_terms, weight * std::abs(c.at[row]));
      terms = std::max(
          terms, weight * (std::abs(c.of_x[row]) + std::abs(c.of_y[row]) + std::abs(c.of_z[row])));
    }
    constexpr double kRounding = 32 * 0x1p-23;
    EXPECT_GE(c.of_x[3], kRounding * at_terms);
    EXPECT_LE(c.of_x[3], 2.1 * kRounding * at_terms);
    EXPECT_GE(c.at[3], kRounding * terms);
    EXPECT_LE(c.at[3], 2.1 * kRounding * terms);
    const double depth_terms =
        std::abs(c.at[2]) +
        radius_m * (std::abs(c.of_x[2]) + std::abs(c.of_y[2]) + std::abs(c.of_z[2]));
    EXPECT_NEAR(c.of_y[3], kRounding * depth_terms, 0.04 * kRounding * depth_terms);
    EXPECT_NEAR(c.of_z[3] * farthest_px, 0x1p-20 * (farthest_px + 1), 1e-7);
  }
}

TEST_F(GlDetectionTest, RejectsAnInvalidCapacity) {
  EXPECT_THROW(collision::GlDetection({.first = 0, .max = 64}), std::invalid_argument);
  EXPECT_THROW(collision::GlDetection({.first = 128, .max = 64}), std::invalid_argument);
  EXPECT_THROW(collision::GlDetection({.first = 64, .max = 100}), std::invalid_argument);
  EXPECT_THROW(collision::GlDetection({.first = 100, .max = 128}), std::invalid_argument);
  EXPECT_NO_THROW(collision::GlDetection({.first = 64, .max = 64}));
}

}  // namespace
}  // namespace fivepipe::test
