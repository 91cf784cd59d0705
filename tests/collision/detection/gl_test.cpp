// Backend `gl` of the collision detection: against the exact reference, against backend `cpu`, and
// on the hard cases of triangles and meshes.
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "common/collision/detection/cpu/contact_simd.h"
#include "common/collision/detection/gl/gl_contact_camera.h"
#include "common/collision/detection/gl/gl_detection.h"
#include "common/collision/oracle/triangle_reference.h"
#include "tests/support/collision_triangles.h"

namespace fivepipe::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr collision::DetectionOptions kVerdictAlone{.eps_m = 0.5e-3, .spacing_m = 0};
constexpr collision::DetectionOptions kAllPoints{
    .eps_m = 0.5e-3, .spacing_m = 3e-3, .max_points = 1u << 20};

struct Hull {
  std::vector<hull::Silhouette> silhouettes;
  base::WorkerPool pool;
  hull::CpuHull hull;
  hull::HullQuery query;
  explicit Hull(std::vector<hull::Silhouette> s, int threads = 1)
      : silhouettes(std::move(s)), pool(threads), hull(pool, silhouettes), query(hull) {}
};

// Programs are made once: compiling them takes longer than most of the cases.
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

  static std::vector<collision::ObjectCollision> ask(
      collision::GlDetection& detection, const Hull& hull,
      std::span<const collision::DetectionObject> objects,
      const collision::DetectionOptions& options) {
    detection.set_hull(hull.query);
    const std::span<const collision::ObjectCollision> found =
        detection.detect(objects, options, &counts_);
    EXPECT_EQ(counts_.unconfirmed, 0u);
    EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR));
    return {found.begin(), found.end()};
  }
  static collision::ObjectCollision ask(const Hull& hull, const collision::Bvh& tree,
                                        const collision::DetectionOptions& options = kVerdictAlone,
                                        const Isometry3d& pose = Isometry3d::Identity(),
                                        const Vector3d& rp = kOrigin) {
    const collision::DetectionObject object{&tree, pose, rp};
    return ask(*detection_, hull, {&object, 1}, options)[0];
  }
  static collision::CollisionVerdict ask(
      const Hull& hull, const collision::Triangle& t,
      const collision::DetectionOptions& options = kVerdictAlone) {
    return ask(hull, collision::Bvh(mesh_of({t})), options).verdict;
  }

  // Free and colliding alike, but for what one of them calls undecided: a hundredth of the
  // triangles at most, and one.
  static void expect_as_cpu(const Hull& hull, std::span<const collision::DetectionObject> objects,
                            const collision::DetectionOptions& options) {
    const std::vector<collision::ObjectCollision> gl = ask(*detection_, hull, objects, options),
                                                  cpu = collision::detect(hull.query, objects,
                                                                          options);
    for (std::size_t i = 0; i < objects.size(); ++i) {
      for (std::size_t t = 0; t < objects[i].tree->mesh().triangles.size(); ++t) {
        if (t == 0)
          EXPECT_LE(gl[i].undecided.size() * 100, 100 + objects[i].tree->mesh().triangles.size());
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
  static inline collision::GlDetectionCounts counts_;
};

// What is free has no part in the hull that is more than rounding; what collides has one.
TEST_F(GlDetectionTest, AgreesWithTheExactReference) {
  Random random(11);
  int crossing = 0, undecided = 0, on_cpu = 0;
  for (int scene = 0; scene < 5; ++scene) {
    const Hull hull(
        scene == 0 ? hand_like()
                   : silhouettes_of(random_object(random, 3), random_cameras(random, 2 + scene)));
    const collision::HullDistance distance(hull.silhouettes);
    const std::vector<collision::Triangle> triangles = random_triangles(random, 90);
    const collision::Bvh tree(mesh_of(triangles));
    const collision::ObjectCollision alone = ask(hull, tree),
                                     with_points = ask(hull, tree, kAllPoints);
    on_cpu += int(counts_.triangles_on_cpu);
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      const collision::TriangleTruth truth = collision::triangle_truth(distance, triangles[i]);
      crossing += truth.crosses;
      for (const collision::ObjectCollision* found : {&alone, &with_points}) {
        undecided += test::holds(found->undecided, i);
        if (truth.deepest_m > 1e-9) {
          EXPECT_TRUE(test::holds(found->triangles, i) || test::holds(found->undecided, i))
              << scene << ' ' << i << ' ' << truth.deepest_m;
        }
        if (truth.deepest_m > kVerdictAlone.eps_m) {
          EXPECT_TRUE(test::holds(found->triangles, i));
        }
        if (!truth.crosses) {
          EXPECT_FALSE(test::holds(found->triangles, i)) << scene << ' ' << i;
        }
      }
    }
  }
  EXPECT_GT(crossing, 100);
  EXPECT_LE(undecided, 0.02 * crossing);  // of two answers each
  EXPECT_LT(on_cpu, 0.1 * crossing);      // the GPU does the work
}

TEST_F(GlDetectionTest, AgreesWithBackendCpuFromOneToSixteenCameras) {
  Random random(1);
  for (const int cameras : {1, 2, 3, 5, 16}) {
    const Hull hull(silhouettes_of(random_object(random, 3), random_cameras(random, cameras)));
    const collision::Bvh tree(mesh_of(random_triangles(random, 400)));
    const collision::DetectionObject object{&tree};
    for (const double eps_m : {3e-3, 0.5e-3, 0.1e-3})
      expect_as_cpu(hull, {&object, 1}, {.eps_m = eps_m, .spacing_m = 0});
    expect_as_cpu(hull, {&object, 1}, kAllPoints);
  }
}

TEST_F(GlDetectionTest, BatchEqualsSingleObjectQueries) {
  Random random(3);
  std::vector<collision::Bvh> trees;
  std::vector<collision::DetectionObject> objects;
  const Hull hull(hand_like());
  for (const int triangles : {90, 1, 700, 0, 20, 16, 257})
    trees.emplace_back(mesh_of(random_triangles(random, triangles)));
  for (const collision::Bvh& tree : trees)
    objects.push_back({&tree, at(random_in_ball(random, 0.05))});
  objects.push_back({&trees[2], at({0, 0.03, 0})});  // a tree twice
  const std::vector<collision::ObjectCollision> together =
      ask(*detection_, hull, objects, kAllPoints);
  int colliding = 0;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const collision::ObjectCollision alone =
        ask(*detection_, hull, {&objects[i], 1}, kAllPoints)[0];
    EXPECT_EQ(together[i].verdict, alone.verdict);
    EXPECT_EQ(together[i].triangles, alone.triangles);
    EXPECT_EQ(together[i].points, alone.points);
    colliding += alone.colliding();
  }
  EXPECT_GT(colliding, 3);
  expect_as_cpu(hull, objects, kVerdictAlone);
}

TEST_F(GlDetectionTest, IsBitIdenticalOnRepeat) {
  Random random(5);
  const Hull hull(hand_like(), 2), other(hand_like());
  const collision::Bvh tree(mesh_of(random_triangles(random, 600)));
  const collision::ObjectCollision first = ask(hull, tree, kAllPoints);
  for (int i = 0; i < 5; ++i) {
    const collision::ObjectCollision again = ask(i % 2 ? hull : other, tree, kAllPoints);
    EXPECT_EQ(again.points, first.points);
    EXPECT_EQ(again.triangles, first.triangles);
    EXPECT_EQ(again.undecided, first.undecided);
  }
}

TEST_F(GlDetectionTest, IsIndependentOfVertexOrder) {
  Random random(2);
  const Hull hull(hand_like());
  for (int i = 0; i < 20; ++i) {
    const collision::Triangle t = random_triangle(random, 0.1, 0.05);
    std::array<std::size_t, 3> order = {0, 1, 2};
    const collision::ObjectCollision first = ask(hull, collision::Bvh(mesh_of({t})), kAllPoints);
    while (std::next_permutation(order.begin(), order.end())) {
      const collision::ObjectCollision again =
          ask(hull, collision::Bvh(mesh_of({{t[order[0]], t[order[1]], t[order[2]]}})), kAllPoints);
      EXPECT_EQ(again.verdict, first.verdict);
      EXPECT_EQ(again.points, first.points);
    }
  }
}

// Every sample in the hull, and no other: the grid is the same.
TEST_F(GlDetectionTest, FindsTheSamePointCountAsBackendCpu) {
  Random random(8);
  const Hull hull(hand_like());
  for (const int subdivisions : {1, 3}) {
    const collision::Bvh tree(geometry::sphere_mesh(0.04, subdivisions));
    const collision::DetectionObject object{&tree, at({-0.05, 0, 0}), {1, 0.3, 0.2}};
    for (const double spacing_m : {10e-3, 3e-3, 0.5e-3}) {
      const collision::DetectionOptions options{.spacing_m = spacing_m, .max_points = 1u << 20};
      const collision::ObjectCollision gl = ask(*detection_, hull, {&object, 1}, options)[0],
                                       cpu =
                                           collision::detect(hull.query, {&object, 1}, options)[0];
      EXPECT_EQ(gl.triangles, cpu.triangles);
      // Corners of solid parts, one a triangle, depend on how parts come.
      EXPECT_NEAR(double(gl.points.size()), double(cpu.points.size()), double(gl.triangles.size()));
      EXPECT_GT(gl.points.size(), gl.triangles.size());
    }
  }
}

TEST_F(GlDetectionTest, PointsRespectTheSpacingAndIncludeTheFarthest) {
  const Hull hull(silhouettes_of({ball(kOrigin, 0.08)}, ring(4, 1.2, 0.6, 300, 0.5)));
  const collision::Triangle t = {Vector3d(-0.02, -0.02, 0), Vector3d(0.03, -0.01, 0.01),
                                 Vector3d(0, 0.03, 0)};
  const Vector3d rp(0.2, 0.1, 0.3);
  for (const double spacing_m : {0.02, 5e-3, 1.1e-3}) {
    const collision::ObjectCollision found =
        ask(hull, collision::Bvh(mesh_of({t})), {.spacing_m = spacing_m, .max_points = 1u << 20},
            Isometry3d::Identity(), rp);
    for (int i = 0; i <= 40; ++i)
      for (int j = 0; i + j <= 40; ++j) {
        const Vector3d p = t[0] + i / 40.0 * (t[1] - t[0]) + j / 40.0 * (t[2] - t[0]);
        EXPECT_TRUE(std::any_of(found.points.begin(), found.points.end(),
                                [&](const collision::CollisionPoint& q) {
                                  return (q.p_world_m - p).norm() <= spacing_m;
                                }));
      }
    double corner_m = 0;
    for (const Vector3d& v : t) corner_m = std::max(corner_m, (v - rp).norm());
    ASSERT_FALSE(found.points.empty());
    EXPECT_DOUBLE_EQ((found.points.back().p_world_m - rp).norm(),
                     corner_m);  // of a triangle in the hull; last
    EXPECT_FALSE(found.truncated);
  }
}

TEST_F(GlDetectionTest, PointsRespectTheSpacingAcrossTheBorder) {
  const Hull hull(silhouettes_of({ball(kOrigin, 0.05)}, ring(4, 1.2, 0.6, 300, 0.5)));
  const collision::Triangle t = {Vector3d(0, 0, 0), Vector3d(0.15, 0.02, 0.01),
                                 Vector3d(0.02, 0.12, -0.02)};
  for (const double spacing_m : {7e-3, 2e-3}) {
    const collision::ObjectCollision found =
        ask(hull, collision::Bvh(mesh_of({t})), {.spacing_m = spacing_m, .max_points = 1u << 20});
    // The part around any point that is in the hull with its surroundings has its middle in the
    // hull.
    for (int i = 0; i <= 60; ++i)
      for (int j = 0; i + j <= 60; ++j) {
        const Vector3d p = t[0] + i / 60.0 * (t[1] - t[0]) + j / 60.0 * (t[2] - t[0]);
        if (!(hull.query.solid_radius_m(p) > spacing_m)) continue;
        EXPECT_TRUE(std::any_of(found.points.begin(), found.points.end(),
                                [&](const collision::CollisionPoint& q) {
                                  return (q.p_world_m - p).norm() <= spacing_m;
                                }));
      }
  }
}

TEST_F(GlDetectionTest, KeepsAtMostMaxPointsForAnySpacing) {
  const Hull hull(silhouettes_of({ball(kOrigin, 0.08)}, ring(4, 1.2, 0.6, 300, 0.5)));
  const collision::Bvh tree(geometry::sphere_mesh(0.05, 4));
  for (const std::size_t max_points : {std::size_t{1}, std::size_t{50}, std::size_t{4096}}) {
    const collision::ObjectCollision found =
        ask(hull, tree, {.spacing_m = 2e-5, .max_points = max_points});
    EXPECT_EQ(found.triangles.size(), 5120u);
    EXPECT_EQ(found.points.size(), max_points);
    EXPECT_TRUE(found.truncated);
  }
}

// Too little room for parts: run again with more, and then left to the CPU, but never lost.
TEST_F(GlDetectionTest, FallsBackToCpuWithoutBufferSpace) {
  Random random(9);
  const Hull hull(hand_like());
  const collision::Bvh tree(mesh_of(random_triangles(random, 300)));
  const collision::DetectionObject object{&tree};
  for (const collision::DetectionOptions& options : {kVerdictAlone, kAllPoints}) {
    const collision::ObjectCollision usual = ask(hull, tree, options);
    EXPECT_EQ(counts_.overflows, 0u);
    collision::GlDetection grows({.first = 64, .max = 1 << 18}), stays({.first = 64, .max = 128});
    const collision::ObjectCollision grown = ask(grows, hull, {&object, 1}, options)[0];
    EXPECT_GT(counts_.overflows, 1u);
    EXPECT_LT(counts_.triangles_on_cpu, 20u);
    EXPECT_EQ(grown.points, usual.points);
    EXPECT_EQ(grown.triangles, usual.triangles);
    const collision::ObjectCollision settled = ask(stays, hull, {&object, 1}, options)[0];
    EXPECT_GT(counts_.triangles_on_cpu, 50u);
    EXPECT_EQ(settled.triangles, usual.triangles);
    EXPECT_EQ(settled.undecided, usual.undecided);
  }
}

TEST_F(GlDetectionTest, UploadsADeformedMesh) {
  const Hull hull(hand_like());
  geometry::Mesh mesh = geometry::curtain_mesh(0.3, 0.3, 20, 18, 0.02, 3);
  collision::Bvh tree(mesh);
  EXPECT_TRUE(ask(hull, tree, kVerdictAlone, at({0, 0, 1})).triangles.empty());
  Random random(7);
  for (Vector3d& v : mesh.vertices_m) v += Vector3d(0, 0, 0.15) + random_in_ball(random, 0.01);
  tree.refit(mesh.vertices_m);
  const collision::ObjectCollision refitted = ask(hull, tree),
                                   anew = ask(hull, collision::Bvh(mesh));
  EXPECT_FALSE(anew.triangles.empty());
  EXPECT_EQ(refitted.triangles, anew.triangles);
  collision::Bvh copy = tree;
  EXPECT_EQ(copy.content(), tree.content());
  copy.refit(mesh.vertices_m);
  EXPECT_NE(copy.content(), tree.content());
}

// What the margins rest on: the image of a point by float is no farther off than they say.
TEST_F(GlDetectionTest, ErrorMarginBoundsFloatRounding) {
  Random random(6);
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    const double radius_m = std::exp(uniform(random, std::log(0.01), std::log(10)));
    Isometry3d pose = at(random_in_ball(random, 2));
    pose.linear() =
        Eigen::AngleAxisd(uniform(random, 0, 3), random_direction(random)).toRotationMatrix();
    hull::CpuHull::MapCamera camera;
    camera.camera = random_camera(random, 720, 486);
    hull::ObjectPixels pixels(720, 486);
    for (int k = 0; k < 2; ++k)
      pixels.set(int(uniform(random, 0, 720)), int(uniform(random, 0, 486)));
    camera.skip_map.assign(pixels);
    const collision::gl_contact::GlCamera c = collision::gl_camera(camera, pose, radius_m);
    const Eigen::Vector2d pixel_px(uniform(random, 0, 720), uniform(random, 0, 486));
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

TEST_F(GlDetectionTest, EmptyHullOrEmptyMeshIsFree) {
  const Hull hull(hand_like()), none({});
  EXPECT_EQ(ask(hull, collision::Bvh()).verdict, collision::CollisionVerdict::free);
  EXPECT_EQ(ask(hull, collision::Bvh(geometry::Mesh{})).verdict, collision::CollisionVerdict::free);
  const collision::Bvh box(geometry::box_mesh({1, 1, 1}));
  EXPECT_EQ(ask(none, box).verdict, collision::CollisionVerdict::free);
  auto empty = hand_like();
  empty[2].pixels = hull::ObjectPixels(300, 300);
  EXPECT_EQ(ask(Hull(empty), box).verdict, collision::CollisionVerdict::free);
  EXPECT_TRUE(ask(*detection_, hull, {}, kVerdictAlone).empty());
}

TEST_F(GlDetectionTest, RejectsInvalidArguments) {
  const Hull hull(hand_like());
  const collision::Bvh tree(geometry::box_mesh({0.1, 0.1, 0.1}));
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(ask(hull, tree, {.eps_m = 0}), std::invalid_argument);
  EXPECT_THROW(ask(hull, tree, {.eps_m = kNaN}), std::invalid_argument);
  EXPECT_THROW(ask(hull, tree, {.spacing_m = -1}), std::invalid_argument);
  EXPECT_THROW(ask(hull, tree, {.max_points = 0}), std::invalid_argument);
  EXPECT_THROW(ask(hull, tree, {}, at({kNaN, 0, 0})), std::invalid_argument);
  EXPECT_THROW(collision::GlDetection({.first = 0, .max = 64}), std::invalid_argument);
  EXPECT_THROW(collision::GlDetection({.first = 128, .max = 64}), std::invalid_argument);
  base::WorkerPool pool(1);
  const auto silhouettes = hand_like();
  hull::CpuHull seen(pool, silhouettes, {hull::Limits::seen, 2});
  const hull::HullQuery query(seen);
  const collision::DetectionObject object{&tree};
  detection_->set_hull(query);
  EXPECT_THROW(detection_->detect({&object, 1}), std::invalid_argument);
}

// --- hard cases: triangles and meshes
// --------------------------------------------------------------------------------

TEST_F(GlDetectionTest, DegenerateTriangles) {
  const Hull hull(silhouettes_of({ball(kOrigin, 0.05)}, ring(4, 1.2, 0.6, 300, 0.5)));
  const Vector3d in(0.01, 0, 0), also_in(-0.02, 0.01, 0), out(0.3, 0, 0), farther(0.5, 0, 0);
  for (const collision::DetectionOptions& options :
       {kVerdictAlone, collision::DetectionOptions{}}) {
    EXPECT_EQ(ask(hull, collision::Triangle{in, in, in}, options),
              collision::CollisionVerdict::colliding);
    EXPECT_EQ(ask(hull, collision::Triangle{in, in, also_in}, options),
              collision::CollisionVerdict::colliding);
    EXPECT_EQ(ask(hull, collision::Triangle{out, farther, -out}, options),
              collision::CollisionVerdict::colliding);
    EXPECT_EQ(ask(hull, collision::Triangle{out, out, out}, options),
              collision::CollisionVerdict::free);
    EXPECT_EQ(ask(hull, collision::Triangle{out, farther, 0.5 * (out + farther)}, options),
              collision::CollisionVerdict::free);
  }
}

TEST_F(GlDetectionTest, SliverOfAMetreByAMicrometreAndTenMetresAroundACentimetre) {
  const Hull hull(silhouettes_of({ball(kOrigin, 0.005)}, ring(4, 1.2, 0.6, 300, 0.5)));
  for (const double z : {0.0, 0.2}) {
    const collision::CollisionVerdict expected =
        z == 0 ? collision::CollisionVerdict::colliding : collision::CollisionVerdict::free;
    EXPECT_EQ(ask(hull, collision::Triangle{Vector3d(-0.5, 0.001, z), Vector3d(0.5, 0.001, z),
                                            Vector3d(0.1, 0.001001, z)}),
              expected);
    for (const collision::DetectionOptions& options :
         {kVerdictAlone, collision::DetectionOptions{.spacing_m = 1e-3, .max_points = 10000}})
      EXPECT_EQ(ask(hull,
                    collision::Triangle{Vector3d(-5, -3, z + 0.001), Vector3d(5, -2, z + 0.001),
                                        Vector3d(0.3, 6, z + 0.001)},
                    options),
                expected);
  }
}

TEST_F(GlDetectionTest, TheHullWhollyInsideABoxAndTheBoxInTheHull) {
  const Hull hull(silhouettes_of({ball(kOrigin, 0.04)}, ring(4, 1.2, 0.6, 300, 0.5)));
  const collision::Bvh around(geometry::box_mesh({0.3, 0.3, 0.3})),
      within(geometry::sphere_mesh(0.01, 2));
  EXPECT_EQ(ask(hull, around).verdict, collision::CollisionVerdict::free);
  EXPECT_TRUE(ask(hull, around).hull_in_box);
  EXPECT_FALSE(ask(hull, around, {}, at({0.4, 0.3, 0})).hull_in_box);
  EXPECT_EQ(ask(hull, within, kAllPoints).triangles.size(), 320u);
}

TEST_F(GlDetectionTest, BehindAndThroughCameras) {
  const Hull hull(silhouettes_of({ball(kOrigin, 0.05)}, ring(4, 1.2, 0.6, 300, 0.5)));
  const Vector3d eye = geometry::camera_center_world_m(hull.silhouettes[0].camera);
  for (const collision::DetectionOptions& options :
       {kVerdictAlone, collision::DetectionOptions{}}) {
    EXPECT_EQ(ask(hull, collision::Triangle{1.1 * eye, 1.3 * eye, 1.2 * eye + Vector3d(0.1, 0, 0)},
                  options),
              collision::CollisionVerdict::free);
    EXPECT_EQ(ask(hull, collision::Triangle{eye, -0.2 * eye, Vector3d(0, 0, 0.3)}, options),
              collision::CollisionVerdict::colliding);
    EXPECT_EQ(ask(hull, collision::Triangle{2 * eye, -2 * eye, Vector3d(0, 0, 0.3)}, options),
              collision::CollisionVerdict::colliding);
    EXPECT_NE(ask(hull, collision::Triangle{eye, 1.1 * eye, eye + Vector3d(0.1, 0, 0)}, options),
              collision::CollisionVerdict::colliding);
  }
  Random random(13);
  std::vector<collision::Triangle> triangles;
  for (int i = 0; i < 300; ++i) triangles.push_back(random_triangle(random, 1.5, 2));
  const collision::Bvh tree(mesh_of(triangles));
  const collision::DetectionObject object{&tree};
  expect_as_cpu(hull, {&object, 1}, kVerdictAlone);
  EXPECT_GT(counts_.triangles_on_cpu, 0u);
  EXPECT_LT(counts_.triangles_on_cpu, counts_.triangles_open);
}

// More cameras than the shaders have room for: all is left to backend `cpu`.
TEST_F(GlDetectionTest, SixtyFourCamerasAndOneMore) {
  Random random(15);
  const collision::Bvh tree(mesh_of(random_triangles(random, 100)));
  const collision::DetectionObject object{&tree};
  for (const int cameras : {64, 65}) {
    const Hull hull(silhouettes_of({ball(kOrigin, 0.06)}, ring(cameras, 1.2, 0.6, 60, 0.5)));
    expect_as_cpu(hull, {&object, 1}, kAllPoints);
    EXPECT_EQ(counts_.objects_on_cpu, cameras > 64 ? 1u : 0u);
  }
}

// Cut on the CPU into very many parts, with hardly a point allowed.
TEST_F(GlDetectionTest, ThroughACamerasPlaneWithHardlyAPointAllowed) {
  std::vector<hull::Silhouette> silhouettes =
      silhouettes_of({ball(kOrigin, 0.05)}, ring(2, 1.2, 0.6, 300, 0.5));
  for (hull::Silhouette& s : silhouettes)  // all of both images: the hull reaches up to the cameras
    for (int v = 0; v < 300; ++v)
      for (int u = 0; u < 300; ++u) s.pixels.set(u, v);
  const Hull hull(silhouettes);
  const Vector3d eye = geometry::camera_center_world_m(silhouettes[0].camera);
  const collision::Bvh tree(
      mesh_of({{1.5 * eye, -1.5 * eye + Vector3d(0, 2, 0), -1.5 * eye - Vector3d(0, 2, 0)}}));
  for (const collision::DetectionOptions& options :
       {collision::DetectionOptions{.eps_m = 1e-6, .spacing_m = 1e-5, .max_points = 1},
        collision::DetectionOptions{.spacing_m = 1e-3, .max_points = 100}}) {
    const collision::ObjectCollision found = ask(hull, tree, options);
    EXPECT_EQ(found.verdict, collision::CollisionVerdict::colliding);
    EXPECT_GE(found.points.size(), 1u);
    EXPECT_LE(found.points.size(), options.max_points);
    EXPECT_TRUE(found.truncated);  // samples are farther apart than asked for
  }
}

// About its own origin; and together with the cameras, a kilometre off; and so large that float has
// no room for it.
TEST_F(GlDetectionTest, FarAway) {
  Random random(14);
  const collision::Bvh tree(mesh_of(random_triangles(random, 200)));
  const Hull near(hand_like());
  std::vector<hull::Silhouette> silhouettes = hand_like();
  const Isometry3d motion = at({1000, -300, 20});
  for (hull::Silhouette& s : silhouettes)
    s.camera.camera_from_world = s.camera.camera_from_world * motion.inverse();
  const Hull far(silhouettes);
  const collision::ObjectCollision here = ask(near, tree),
                                   there = ask(far, tree, kVerdictAlone, motion);
  EXPECT_FALSE(here.triangles.empty());
  EXPECT_EQ(here.triangles, there.triangles);
  EXPECT_EQ(ask(near, tree, kVerdictAlone, motion).verdict, collision::CollisionVerdict::free);
  geometry::Mesh mesh = tree.mesh();
  for (Vector3d& v : mesh.vertices_m) v += Vector3d(-1000, 300, -20);
  EXPECT_EQ(ask(near, collision::Bvh(mesh), kVerdictAlone, motion).triangles, here.triangles);
  const collision::Bvh vast(
      mesh_of({{Vector3d(-1e37, -1e37, 0), Vector3d(1e37, -1e37, 0), Vector3d(0, 1e37, 0)}}));
  EXPECT_NE(ask(near, vast).verdict, collision::CollisionVerdict::free);
  EXPECT_EQ(counts_.objects_on_cpu, 1u);
}

TEST_F(GlDetectionTest, AMillionTriangles) {
  const Hull hull(hand_like());
  Isometry3d flat = at({0, 1, 0.002});
  flat.linear() = Eigen::AngleAxisd(-std::numbers::pi / 2, Vector3d::UnitX()).toRotationMatrix();
  const collision::Bvh tree(geometry::curtain_mesh(2, 2, 1000, 500, 0, 1));
  const collision::DetectionObject object{&tree, flat};
  const collision::ObjectCollision gl = ask(hull, tree, kVerdictAlone, flat),
                                   cpu = collision::detect(hull.query, {&object, 1},
                                                           kVerdictAlone)[0];
  EXPECT_GT(gl.triangles.size(), 500u);
  EXPECT_LE(gl.undecided.size(), 20u);
  EXPECT_NEAR(double(gl.triangles.size()), double(cpu.triangles.size()), 20);
}

// Salt and pepper, where nothing is smooth.
TEST_F(GlDetectionTest, AgainstNoise) {
  Random random(10);
  std::vector<hull::Silhouette> silhouettes;
  for (const geometry::Camera& camera : random_cameras(random, 3))
    silhouettes.push_back(
        {camera, random_pixels(random, camera.pinhole.width_px, camera.pinhole.height_px, 0.3)});
  const Hull hull(silhouettes);
  const collision::Bvh tree(mesh_of(random_triangles(random, 60)));
  const collision::DetectionObject object{&tree};
  expect_as_cpu(hull, {&object, 1}, kVerdictAlone);
  expect_as_cpu(hull, {&object, 1}, kAllPoints);
}

// A triangle that is a point on a pixel's corner: float and in_hull() may round it into different
// pixels, and then it is not free.
TEST_F(GlDetectionTest, PixelCornerPointsAgreeWithInHull) {
  Random random(12);
  int in = 0, wrong = 0;
  for (int scene = 0; scene < 40; ++scene) {
    const geometry::Camera camera = random_camera(random, 160, 121);
    const Hull hull({{camera, random_pixels(random, 160, 121, 0.5)}});
    const Vector3d eye = geometry::camera_center_world_m(camera);
    std::vector<collision::Triangle> points;
    for (int i = 0; i < 60; ++i) {
      const double u = std::floor(uniform(random, 1, 159)) - 0.5,
                   v = std::floor(uniform(random, 1, 120)) - 0.5;
      const Vector3d p =
          eye + uniform(random, 0.5, 2) * geometry::ray_through(camera, {u, v}).direction_world;
      points.push_back({p, p, p});
    }
    const collision::ObjectCollision found = ask(hull, collision::Bvh(mesh_of(points)));
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!hull::in_hull(hull.silhouettes, points[i][0])) continue;
      ++in;
      wrong += !test::holds(found.triangles, i) && !test::holds(found.undecided, i);
    }
  }
  EXPECT_GT(in, 500);
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace fivepipe::test
