// Hard cases of triangles and meshes for every backend of collision detection.
#include <algorithm>
#include <array>
#include <numbers>
#include <stdexcept>

#include "tests/support/collision/backends.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

using collision::CollisionVerdict;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr collision::DetectionOptions kWithPoints{};

CollisionHull ball_hull(double radius_m) {
  return CollisionHull(silhouettes_of({ball(kOrigin, radius_m)}, ring(4, 1.2, 0.6, 300, 0.5)));
}

// Cases of all backends. The backend `paper` samples viewports of 10 px squared, so these triangles
// are small or far from the hull.
class EveryBackend : public BackendTest {};
INSTANTIATE_TEST_SUITE_P(Detection, EveryBackend,
                         testing::Values(Backend::cpu, Backend::gl, Backend::paper), backend_name);

// Cases of the certified backends, which find any part of a triangle in the hull that is at least
// eps_m thick.
class CertifiedBackend : public BackendTest {};
INSTANTIATE_TEST_SUITE_P(Detection, CertifiedBackend, testing::Values(Backend::cpu, Backend::gl),
                         backend_name);

TEST_P(EveryBackend, DegenerateTrianglesCollideWhereTheirPointsAreInTheHull) {
  const CollisionHull hull = ball_hull(0.05);
  const Vector3d in(0.01, 0, 0), also_in(-0.02, 0.01, 0), out(0.3, 0, 0), farther(0.5, 0, 0);
  for (const collision::DetectionOptions& options : {kVerdictOnly, kWithPoints}) {
    // A point, a zero edge, and collinear vertices on both sides of the hull.
    EXPECT_EQ(verdict(hull, {in, in, in}, options), CollisionVerdict::colliding);
    EXPECT_EQ(verdict(hull, {in, in, also_in}, options), CollisionVerdict::colliding);
    EXPECT_EQ(verdict(hull, {out, farther, -out}, options), CollisionVerdict::colliding);
    EXPECT_EQ(verdict(hull, {out, out, out}, options), CollisionVerdict::free);
    EXPECT_EQ(verdict(hull, {out, farther, 0.5 * (out + farther)}, options),
              CollisionVerdict::free);
  }
}

TEST_P(EveryBackend, DuplicateAndNonManifoldFacesAreEachReported) {
  const CollisionHull hull(hand_like());
  geometry::Mesh mesh = geometry::sphere_mesh(0.04, 2);
  const std::size_t once = mesh.triangles.size();
  const std::size_t colliding = detect(hull, collision::Bvh(mesh)).triangles.size();
  EXPECT_GT(colliding, 10u);
  for (std::size_t i = 0; i < once; ++i) mesh.triangles.push_back(mesh.triangles[i]);
  EXPECT_EQ(detect(hull, collision::Bvh(mesh)).triangles.size(), 2 * colliding);
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}, {0, 1, 5}};  // four faces at one edge
  for (const std::uint32_t t : detect(hull, collision::Bvh(mesh)).triangles) EXPECT_LT(t, 4u);
}

// A colliding triangle has points, and one point for the verdict alone. Each is a point of its
// triangle, also if the triangle is cut or is wholly in the hull.
TEST_P(CertifiedBackend, EveryPointIsWithinItsTriangle) {
  Random random(16);
  const CollisionHull hull = ball_hull(0.08);
  std::vector<collision::Triangle> triangles = random_triangles(random, 150);
  for (int i = 0; i < 5; ++i) {  // through the hull and the planes of the cameras
    const Vector3d a = 2 * random_direction(random), b = 2 * random_direction(random);
    triangles.push_back({a, b, -a - b + random_in_ball(random, 0.05)});
  }
  const collision::Bvh tree(mesh_of(triangles));
  for (const collision::DetectionOptions& options :
       {kVerdictOnly, collision::DetectionOptions{.spacing_m = 0.02}}) {
    const collision::ObjectCollision found = detect(hull, tree, options);
    EXPECT_GT(found.triangles.size(), 60u);
    if (options.spacing_m == 0) {
      EXPECT_EQ(found.points.size(), found.triangles.size());
    }
    for (const collision::CollisionPoint& p : found.points) {
      const collision::Triangle& t = triangles[p.triangle];
      const Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector3d &from = t[k], &to = t[(k + 1) % 3];
        EXPECT_GE((to - from).cross(p.p_world_m - from).dot(normal.normalized()),
                  -1e-9 * (to - from).norm())
            << p.triangle;
      }
      EXPECT_LT(std::abs(normal.normalized().dot(p.p_world_m - t[0])), 1e-9);
    }
  }
}

// A detector keeps its memory but no result of an earlier call.
TEST_P(EveryBackend, AReusedDetectorEqualsAFreshOne) {
  const CollisionHull hull(hand_like()), small = ball_hull(0.02);
  const collision::Bvh sphere(geometry::sphere_mesh(0.04, 2)),
      box(geometry::box_mesh({0.2, 0.2, 0.2}));
  const std::vector<std::vector<collision::DetectionObject>> requests{
      {{&box}, {&sphere}},
      {{&sphere}, {&box, at({1, 0, 0})}},
      {{&sphere, at({1, 0, 0})}},
      {{&box}}};
  const collision::DetectionOptions options{.spacing_m = 1e-3, .max_points = 300};
  const auto reused = make_detector(options);
  std::size_t truncated = 0, in_box = 0;
  for (const CollisionHull* h : {&hull, &small, &hull})
    for (const auto& objects : requests) {
      const auto fresh = make_detector(options);
      reused->set_hull(h->query, h->silhouettes);
      fresh->set_hull(h->query, h->silhouettes);
      const auto found = reused->detect(objects), expected = fresh->detect(objects);
      ASSERT_EQ(found.size(), expected.size());
      for (std::size_t i = 0; i < found.size(); ++i) {
        EXPECT_EQ(found[i].verdict, expected[i].verdict);
        EXPECT_EQ(found[i].triangles, expected[i].triangles);
        EXPECT_EQ(found[i].undecided, expected[i].undecided);
        EXPECT_EQ(found[i].points, expected[i].points);
        EXPECT_EQ(found[i].truncated, expected[i].truncated);
        EXPECT_EQ(found[i].hull_in_box, expected[i].hull_in_box);
        truncated += expected[i].truncated, in_box += expected[i].hull_in_box;
      }
    }
  EXPECT_GT(in_box, 0u);
  EXPECT_EQ(truncated > 0, GetParam() != Backend::paper);
}

// No point of the box's surface is in the hull, so it does not collide; hull_in_box reports the
// enclosed hull.
TEST_P(EveryBackend, AHullInsideABoxIsReportedWithoutACollision) {
  const CollisionHull hull = ball_hull(0.02);
  const collision::Bvh box(geometry::box_mesh({0.2, 0.2, 0.2}));
  const collision::ObjectCollision around = detect(hull, box),
                                   beside = detect(hull, box, kVerdictOnly, at({0.3, 0.2, 0}));
  EXPECT_EQ(around.verdict,
            GetParam() == Backend::paper ? CollisionVerdict::undecided : CollisionVerdict::free);
  EXPECT_TRUE(around.hull_in_box);
  EXPECT_TRUE(around.points.empty());
  EXPECT_EQ(beside.verdict, CollisionVerdict::free);
  EXPECT_FALSE(beside.hull_in_box);
}

TEST_P(EveryBackend, EveryTriangleOfAnObjectInsideTheHullCollides) {
  const CollisionHull hull = ball_hull(0.08);
  const collision::ObjectCollision found =
      detect(hull, collision::Bvh(geometry::sphere_mesh(0.03, 2)), {.spacing_m = 2e-3});
  EXPECT_EQ(found.triangles.size(), 320u);
  EXPECT_FALSE(found.hull_in_box);
}

TEST_P(EveryBackend, DecidesTrianglesThatEveryCameraSeesEdgeOn) {
  // The cameras and the triangles are in the plane z = 0.
  const CollisionHull hull(silhouettes_of({ball(kOrigin, 0.05)}, ring(4, 1.2, 0, 300, 0.5)));
  EXPECT_EQ(verdict(hull, {Vector3d(-0.2, -0.1, 0), Vector3d(0.2, -0.1, 0), Vector3d(0, 0.3, 0)}),
            CollisionVerdict::colliding);
  EXPECT_EQ(verdict(hull, {Vector3d(0.2, -0.1, 0), Vector3d(0.4, -0.1, 0), Vector3d(0.3, 0.3, 0)}),
            CollisionVerdict::free);
}

TEST_P(EveryBackend, PointsAreInTheHullAndOnTheirTriangle) {
  const CollisionHull hull(hand_like());
  const std::vector<collision::Bvh> trees{collision::Bvh(geometry::sphere_mesh(0.05, 2)),
                                          collision::Bvh(geometry::box_mesh({0.1, 0.1, 0.1}))};
  const std::vector<collision::DetectionObject> objects{{&trees[0], at({-0.1, 0, 0})},
                                                        {&trees[0], at({0.3, 0.2, 0})},
                                                        {&trees[1], at({-0.05, 0, 0})}};
  const auto found = detect(hull, objects, kWithPoints);
  EXPECT_TRUE(found[0].colliding());
  EXPECT_EQ(found[1].verdict, CollisionVerdict::free);
  EXPECT_TRUE(found[2].colliding());
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const auto triangles =
        collision::world_triangles(objects[i].tree->mesh(), objects[i].world_from_object);
    EXPECT_TRUE(std::is_sorted(found[i].triangles.begin(), found[i].triangles.end()));
    for (const collision::CollisionPoint& p : found[i].points) {
      EXPECT_TRUE(test::holds(found[i].triangles, p.triangle));
      EXPECT_TRUE(hull::in_hull(hull.silhouettes, p.p_world_m));
      // 1e-9 m is far above the rounding of the distance to the triangle's plane.
      const collision::Triangle& t = triangles.at(p.triangle);
      EXPECT_NEAR((t[1] - t[0]).cross(t[2] - t[0]).normalized().dot(p.p_world_m - t[0]), 0, 1e-9);
    }
  }
}

TEST_P(EveryBackend, NoPointOfAFreeObjectIsInTheHull) {
  Random random(12);
  std::size_t free = 0, points = 0;
  for (int scene = 0; scene < 20; ++scene) {
    const CollisionHull hull(silhouettes_of({random_cameras(random, 3), random_object(random, 2)}));
    std::vector<collision::Bvh> trees;
    std::vector<collision::DetectionObject> objects;
    for (int i = 0; i < 6; ++i)
      trees.emplace_back(geometry::sphere_mesh(uniform(random, 0.01, 0.08), 1));
    for (const collision::Bvh& tree : trees)
      objects.push_back({&tree, at(random_in_ball(random, 0.3))});
    const auto found = detect(hull, objects, kWithPoints);
    for (std::size_t i = 0; i < objects.size(); ++i) {
      points += found[i].points.size();
      if (found[i].verdict != CollisionVerdict::free) continue;
      ++free;
      for (const collision::Triangle& t :
           collision::world_triangles(objects[i].tree->mesh(), objects[i].world_from_object))
        for (int sample = 0; sample < 10; ++sample) {
          const double x = uniform(random, 0, 1), y = uniform(random, 0, 1);
          EXPECT_FALSE(
              hull::in_hull(hull.silhouettes, collision::point_at(collision::view_of(t), x, y)));
        }
    }
  }
  EXPECT_GT(free, 20u);
  EXPECT_GT(points, 300u);
}

TEST_P(EveryBackend, AnEmptyHullOrAnEmptyMeshIsFree) {
  const CollisionHull hull(hand_like()), none({});
  EXPECT_EQ(detect(hull, collision::Bvh()).verdict, CollisionVerdict::free);
  EXPECT_EQ(detect(hull, collision::Bvh(geometry::Mesh{})).verdict, CollisionVerdict::free);
  EXPECT_FALSE(detect(hull, collision::Bvh(geometry::Mesh{})).hull_in_box);
  const collision::Bvh box(geometry::box_mesh({1, 1, 1}));
  EXPECT_EQ(detect(none, box).verdict, CollisionVerdict::free);
  auto empty = hand_like();
  empty[2].pixels = hull::ObjectPixels(300, 300);
  EXPECT_EQ(detect(CollisionHull(empty), box).verdict, CollisionVerdict::free);
  EXPECT_TRUE(detect(hull, std::span<const collision::DetectionObject>()).empty());
}

TEST_P(EveryBackend, CountsTheObjectsOfAllCallsByVerdict) {
  const CollisionHull hull(hand_like());
  const collision::Bvh sphere(geometry::sphere_mesh(0.04, 2)), none(geometry::Mesh{});
  const std::vector<collision::DetectionObject> objects{
      {&sphere, at({-0.05, 0, 0})}, {&sphere, at({1, 0, 0})}, {&sphere, at({0, 0.01, 0})}, {&none}};
  const auto detector = make_detector(kVerdictOnly);
  EXPECT_EQ(detector->counts().objects, 0u);
  detector->set_hull(hull.query, hull.silhouettes);
  std::size_t undecided = 0;
  for (std::size_t call = 1; call <= 3; ++call) {
    for (const collision::ObjectCollision& found : detector->detect(objects))
      undecided += found.verdict == CollisionVerdict::undecided;
    EXPECT_EQ(detector->counts().objects, 4 * call);
    EXPECT_EQ(detector->counts().colliding, 2 * call);
    EXPECT_EQ(detector->counts().undecided, undecided);
  }
  // The backend `paper` leaves a box around the hull undecided.
  const CollisionHull small = ball_hull(0.02);
  const collision::Bvh box(geometry::box_mesh({0.2, 0.2, 0.2}));
  const collision::DetectionObject around{&box};
  detector->set_hull(small.query, small.silhouettes);
  detector->detect({&around, 1});
  EXPECT_EQ(detector->counts().objects, 13u);
  EXPECT_EQ(detector->counts().undecided, undecided + (GetParam() == Backend::paper));
}

TEST_P(EveryBackend, RejectsAPoseThatIsNotFinite) {
  const CollisionHull hull(hand_like());
  const collision::Bvh tree(geometry::box_mesh({0.1, 0.1, 0.1}));
  EXPECT_THROW(detect(hull, tree, kVerdictOnly, at({kNaN, 0, 0})), std::invalid_argument);
}

TEST_P(CertifiedBackend, RejectsInvalidOptions) {
  const CollisionHull hull(hand_like());
  const collision::Bvh tree(geometry::box_mesh({0.1, 0.1, 0.1}));
  const collision::DetectionObject object{&tree};
  for (const collision::DetectionOptions& options :
       {collision::DetectionOptions{.eps_m = 0}, collision::DetectionOptions{.eps_m = kNaN},
        collision::DetectionOptions{.eps_m = 0.99e-6},
        collision::DetectionOptions{.eps_m = kInfinity},
        collision::DetectionOptions{.spacing_m = -1},
        collision::DetectionOptions{.spacing_m = kNaN},
        collision::DetectionOptions{.spacing_m = kInfinity},
        collision::DetectionOptions{.max_points = 0}}) {
    const auto detector = make_detector(options);
    detector->set_hull(hull.query, hull.silhouettes);
    EXPECT_THROW(detector->detect({&object, 1}), std::invalid_argument);
  }
  EXPECT_THROW(detect(hull, tree, kVerdictOnly, Isometry3d::Identity(), {0, kNaN, 0}),
               std::invalid_argument);
}

TEST_P(CertifiedBackend, FindsASliverOfOneMetreByOneMicrometre) {
  const CollisionHull hull = ball_hull(0.005);
  for (const double z : {0.0, 0.2})
    EXPECT_EQ(verdict(hull, {Vector3d(-0.5, 0.001, z), Vector3d(0.5, 0.001, z),
                             Vector3d(0.1, 0.001001, z)}),
              z == 0 ? CollisionVerdict::colliding : CollisionVerdict::free);
}

TEST_P(CertifiedBackend, FindsAHullOfOneCentimetreInATriangleOfTenMetres) {
  const CollisionHull hull = ball_hull(0.005);
  for (const double z : {0.001, 0.1, 0.201})
    for (const collision::DetectionOptions& options :
         {kVerdictOnly, collision::DetectionOptions{.spacing_m = 1e-3, .max_points = 10000}})
      EXPECT_EQ(
          verdict(hull, {Vector3d(-5, -3, z), Vector3d(5, -2, z), Vector3d(0.3, 6, z)}, options),
          z == 0.001 ? CollisionVerdict::colliding : CollisionVerdict::free);
}

// Pixels are closed: the hull's border belongs to it, to rounding. A triangle that only shares an
// edge with the border must not collide, and both vertex orders give the same verdict.
TEST_P(CertifiedBackend, ATriangleBesideTheHullsSurfaceDoesNotCollide) {
  hull::ObjectPixels half(64, 64);
  for (int v = 0; v < 64; ++v)
    for (int u = 0; u < 32; ++u) half.set(u, v);
  // Pixel 32 begins at x = 0.
  const geometry::Camera camera{{64, 64, 64, 64, 31.5, 31.5}, Isometry3d::Identity()};
  const CollisionHull hull({{camera, half}});
  const Vector3d low(0, -0.1, 1), high(0, 0.1, 1);
  const CollisionVerdict beside = verdict(hull, {low, high, Vector3d(0.1, 0, 1)});
  EXPECT_NE(beside, CollisionVerdict::colliding);
  EXPECT_EQ(verdict(hull, {Vector3d(0.1, 0, 1), high, low}), beside);
  EXPECT_EQ(verdict(hull, {low, high, Vector3d(-0.1, 0, 1)}), CollisionVerdict::colliding);
}

TEST_P(CertifiedBackend, FindsAFingerOfTwoMillimetresInTrianglesOfTwoCentimetres) {
  const CollisionHull hull(
      silhouettes_of({{{0, 0, -0.05}, {0.01, 0.02, 0.05}, 0.001}}, ring(4, 1.2, 0.6, 480, 0.4)));
  Random random(8);
  std::vector<collision::Triangle> pierced;
  for (int i = 0; i < 300; ++i) {  // through a random point of the finger's axis
    const Vector3d p = Vector3d(0, 0, -0.045) + uniform(random, 0, 0.9) * Vector3d(0.01, 0.02, 0.1);
    const Vector3d a = random_direction(random), b = random_direction(random), c = -a - b;
    if (a.cross(b).norm() >= 0.2) pierced.push_back({p + 0.01 * a, p + 0.01 * b, p + 0.01 * c});
  }
  EXPECT_GT(pierced.size(), 200u);
  EXPECT_EQ(detect(hull, collision::Bvh(mesh_of(pierced))).triangles.size(), pierced.size());
}

TEST_P(CertifiedBackend, FindsTrianglesThatReachBehindTheCameras) {
  const CollisionHull hull = ball_hull(0.05);
  Random random(9);
  for (int i = 0; i < 40; ++i) {
    const Vector3d a = 20 * random_direction(random), b = 20 * random_direction(random);
    EXPECT_EQ(verdict(hull, {a, b, -a - b}), CollisionVerdict::colliding);  // through the origin
    const Vector3d off = a.cross(b).normalized() * 0.2;
    const collision::Triangle beside = {off + a, off + b, off - a - b};
    if (!sampled(hull.silhouettes, beside, 400)) {
      EXPECT_NE(verdict(hull, beside), CollisionVerdict::colliding);
    }
  }
}

TEST_P(CertifiedBackend, DecidesTrianglesAtACamerasCenter) {
  const CollisionHull hull = ball_hull(0.05);
  const Vector3d eye = geometry::camera_center_world_m(hull.silhouettes[0].camera);
  const Vector3d aside(0.1, 0, 0), above(0, 0, 0.3);
  for (const collision::DetectionOptions& options : {kVerdictOnly, kWithPoints}) {
    EXPECT_EQ(verdict(hull, {1.1 * eye, 1.3 * eye, 1.2 * eye + aside}, options),
              CollisionVerdict::free);  // behind the camera
    EXPECT_EQ(verdict(hull, {eye, -0.2 * eye, above}, options), CollisionVerdict::colliding);
    EXPECT_EQ(verdict(hull, {2 * eye, -2 * eye, above}, options), CollisionVerdict::colliding);
    EXPECT_NE(verdict(hull, {eye, 1.1 * eye, eye + aside}, options), CollisionVerdict::colliding);
  }
}

// Just in front of a camera's plane and far to the side, float bounds the image only loosely, but
// the object is plainly not near the object pixels.
TEST_P(CertifiedBackend, ObjectsFarToTheSideOfACameraAreFree) {
  hull::ObjectPixels block(640, 480), all(640, 480);
  for (int v = 0; v < 480; ++v)
    for (int u = 0; u < 640; ++u) {
      all.set(u, v);
      if (u > 280 && u < 360 && v > 200 && v < 280) block.set(u, v);
    }
  const geometry::Pinhole pinhole{640, 480, 500, 500, 319.5, 239.5};
  const geometry::Camera ahead{pinhole, geometry::look_at(kOrigin, {1, 0, 0})},
      other{pinhole, geometry::look_at({0, 1, 0}, {0, 4, 0})};
  const CollisionHull hull({{ahead, block}, {other, all}});
  for (const double in_front_m : {0.07, 0.05, 0.02, 1e-4})
    for (const collision::DetectionOptions& options : {kVerdictOnly, kWithPoints}) {
      const Vector3d p(in_front_m, 4, 0);
      EXPECT_EQ(verdict(hull, {p, p + Vector3d(0, 0.01, 0), p + Vector3d(0, 0, 0.01)}, options),
                CollisionVerdict::free)
          << in_front_m;
    }
}

// The triangle crosses a camera's plane and is large, so it is cut into many parts. Each part has a
// sample of its own, even if only few points are allowed.
TEST_P(CertifiedBackend, CutsATriangleAtACamerasPlaneWithFewPointsAllowed) {
  std::vector<hull::Silhouette> silhouettes =
      silhouettes_of({ball(kOrigin, 0.05)}, ring(2, 1.2, 0.6, 300, 0.5));
  for (hull::Silhouette& s : silhouettes)  // full images: the hull reaches up to the cameras
    for (int v = 0; v < 300; ++v)
      for (int u = 0; u < 300; ++u) s.pixels.set(u, v);
  const CollisionHull hull(silhouettes);
  const Vector3d eye = geometry::camera_center_world_m(silhouettes[0].camera);
  const collision::Bvh tree(
      mesh_of({{1.5 * eye, -1.5 * eye + Vector3d(0, 2, 0), -1.5 * eye - Vector3d(0, 2, 0)}}));
  for (const collision::DetectionOptions& options :
       {collision::DetectionOptions{.eps_m = 1e-6, .spacing_m = 1e-5, .max_points = 1},
        collision::DetectionOptions{.spacing_m = 1e-3, .max_points = 100}}) {
    const collision::ObjectCollision found = detect(hull, tree, options);
    EXPECT_EQ(found.verdict, CollisionVerdict::colliding);
    EXPECT_GE(found.points.size(), 1u);
    EXPECT_LE(found.points.size(), options.max_points);
    EXPECT_TRUE(found.truncated);
  }
}

TEST_P(CertifiedBackend, GivesTheSameVerdictsOneKilometreFromTheOrigin) {
  Random random(14);
  const collision::Bvh tree(mesh_of(random_triangles(random, 200)));
  const CollisionHull near(hand_like());
  std::vector<hull::Silhouette> silhouettes = hand_like();
  const Isometry3d motion = at({1000, -300, 20});
  for (hull::Silhouette& s : silhouettes)
    s.camera.camera_from_world = s.camera.camera_from_world * motion.inverse();
  const CollisionHull far(silhouettes);
  const collision::ObjectCollision here = detect(near, tree);
  EXPECT_FALSE(here.triangles.empty());
  EXPECT_EQ(detect(far, tree, kVerdictOnly, motion).triangles, here.triangles);
  EXPECT_EQ(detect(near, tree, kVerdictOnly, motion).verdict, CollisionVerdict::free);
  // The mesh itself may be far from the origin of its frame.
  geometry::Mesh mesh = tree.mesh();
  for (Vector3d& v : mesh.vertices_m) v -= motion.translation();
  EXPECT_EQ(detect(near, collision::Bvh(mesh), kVerdictOnly, motion).triangles, here.triangles);
}

TEST_P(CertifiedBackend, FindsSampledTrianglesInNoise) {
  Random random(10);
  std::vector<hull::Silhouette> silhouettes;
  for (const geometry::Camera& camera : random_cameras(random, 3))
    silhouettes.push_back(
        {camera, random_pixels(random, camera.pinhole.width_px, camera.pinhole.height_px, 0.3)});
  const CollisionHull hull(silhouettes);
  const std::vector<collision::Triangle> triangles = random_triangles(random, 60);
  const collision::ObjectCollision found = detect(hull, collision::Bvh(mesh_of(triangles)));
  for (std::size_t i = 0; i < triangles.size(); ++i)
    if (sampled(silhouettes, triangles[i], 30)) {
      EXPECT_TRUE(test::holds(found.triangles, i)) << i;
    }
}

// A triangle that is one point on a pixel's corner: float and in_hull() may round it into different
// pixels, and then it must not be free.
TEST_P(CertifiedBackend, APointOnAPixelsCornerInTheHullIsNotFree) {
  Random random(12);
  int in = 0, wrong = 0;
  for (int scene = 0; scene < 40; ++scene) {
    const geometry::Camera camera = random_camera(random, 160, 121);
    const CollisionHull hull({{camera, random_pixels(random, 160, 121, 0.5)}});
    const Vector3d eye = geometry::camera_center_world_m(camera);
    std::vector<collision::Triangle> points;
    for (int i = 0; i < 60; ++i) {
      const double u = std::floor(uniform(random, 1, 159)) - 0.5,
                   v = std::floor(uniform(random, 1, 120)) - 0.5;
      const Vector3d p =
          eye + uniform(random, 0.5, 2) * geometry::ray_through(camera, {u, v}).direction_world;
      points.push_back({p, p, p});
    }
    const collision::ObjectCollision found = detect(hull, collision::Bvh(mesh_of(points)));
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!hull::in_hull(hull.silhouettes, points[i][0])) continue;
      ++in;
      wrong += !test::holds(found.triangles, i) && !test::holds(found.undecided, i);
    }
  }
  EXPECT_GT(in, 500);
  EXPECT_EQ(wrong, 0);
}

TEST_P(CertifiedBackend, FindsTheHandInASheetOfAMillionTriangles) {
  const CollisionHull hull(hand_like());
  const collision::ObjectCollision found =
      detect(hull, collision::Bvh(geometry::curtain_mesh(2, 2, 1000, 500, 0, 1)), kVerdictOnly,
             sheet_through_the_hand());
  EXPECT_GT(found.triangles.size(), 500u);
  EXPECT_LE(found.undecided.size(), 20u);
}

}  // namespace
}  // namespace fivepipe::test
