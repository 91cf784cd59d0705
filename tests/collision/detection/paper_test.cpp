// The stages of the paper's method: bounding boxes, then triangles (paper, sections 4.2.4 and
// 4.4.1). backends_test.cpp tests its results.
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/collision/detection/box_query.h"
#include "common/collision/detection/paper/paper_detection.h"
#include "common/collision/detection/paper/paper_detector.h"
#include "tests/support/collision/triangles.h"

namespace fivepipe::test {
namespace {

class PaperDetectionTest : public GlTest {
 protected:
  collision::Detection detect_all(const std::vector<hull::Capsule>& real,
                                  const std::vector<std::vector<collision::Triangle>>& objects,
                                  const std::vector<geometry::Camera>& cameras) {
    query_.set_silhouettes(silhouettes_of(real, cameras));
    return collision::detect(query_, objects);
  }
  collision::TriangleVolumeQuery query_{400, 10};
};

std::vector<geometry::Camera> cameras() { return ring(4, 1.2, 0.5, 240, 0.8); }

std::size_t stages_sum(const collision::DetectionCounts& c) {
  return c.free_by_image + c.box_colliding + c.free_by_cells + c.box_may_hold;
}

TEST(BoxQuery, NeverCertifiesABoxThatContainsAHullPoint) {
  Random random(11);
  int with_hull_point = 0;
  for (int scene = 0; scene < 20; ++scene) {
    const auto silhouettes =
        silhouettes_of({random_cameras(random, 3, 97, 65), random_object(random, 3)});
    for (int i = 0; i < 300; ++i) {
      Eigen::AlignedBox3d box(random_in_ball(random, 0.3));
      box.extend(box.min() + random_vector(random, 0.01, 0.3));
      bool has_hull_point = false;
      for (int sample = 0; sample < 30 && !has_hull_point; ++sample)
        has_hull_point = hull::in_hull(silhouettes, box.sample());
      with_hull_point += has_hull_point;
      for (const int depth : {0, 2})
        EXPECT_FALSE(has_hull_point && collision::is_certainly_free(silhouettes, box, depth));
    }
  }
  EXPECT_GT(with_hull_point, 50);
}

TEST(BoxQuery, CertifiesBoxesBesideASilhouette) {
  const auto silhouettes = silhouettes_of({ball(kOrigin, 0.05)}, cameras());
  EXPECT_TRUE(collision::is_certainly_free(
      silhouettes, {Eigen::Vector3d(0.15, 0.15, -0.05), Eigen::Vector3d(0.25, 0.25, 0.05)}));
  EXPECT_TRUE(
      collision::is_certainly_free({}, {Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1)}));
  EXPECT_FALSE(collision::is_certainly_free(
      silhouettes, {Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1)}, 3));
}

// Returns true if an image has no object pixel in the bounding rectangle of the corners, or if this
// is true of each octant of the box, down to `depth` divisions. Tests every pixel.
bool reference_free(std::span<const hull::Silhouette> silhouettes, const Eigen::AlignedBox3d& box,
                    int depth) {
  for (const hull::Silhouette& s : silhouettes) {
    Eigen::AlignedBox2d image;
    bool all_in_front = true, any_in_front = false;
    for (const double x : {box.min().x(), box.max().x()})
      for (const double y : {box.min().y(), box.max().y()})
        for (const double z : {box.min().z(), box.max().z()}) {
          const auto uv_px = geometry::project(s.camera, {x, y, z});
          all_in_front &= uv_px.has_value();
          any_in_front |= uv_px.has_value();
          if (uv_px) image.extend(*uv_px);
        }
    bool any = !all_in_front && any_in_front;
    for (int v = 0; v < s.pixels.height_px() && all_in_front && !any; ++v)
      for (int u = 0; u < s.pixels.width_px(); ++u)
        any |= s.pixels.contains(u, v) && u + 0.5 >= image.min().x() &&
               u - 0.5 <= image.max().x() && v + 0.5 >= image.min().y() &&
               v - 0.5 <= image.max().y();
    if (!any) return true;
  }
  if (depth == 0) return false;
  const Eigen::Vector3d half_m = 0.5 * box.sizes();
  for (int octant = 0; octant < 8; ++octant) {
    const Eigen::Vector3d low =
        box.min() + half_m.cwiseProduct(Eigen::Vector3d(octant & 1, octant >> 1 & 1, octant >> 2));
    if (!reference_free(silhouettes, {low, low + half_m}, depth - 1)) return false;
  }
  return true;
}

TEST(BoxQuery, CertifiesExactlyTheBoxesWithoutAnObjectPixelInTheirImage) {
  Random random(14);
  int free = 0, not_free = 0;
  for (int scene = 0; scene < 12; ++scene) {
    std::vector<hull::Silhouette> silhouettes;
    for (const geometry::Camera& camera : random_cameras(random, 1 + scene % 3, 141, 65)) {
      silhouettes.push_back({camera, hull::ObjectPixels(141, 65)});
      for (int i = 0; i < 12; ++i) {  // also in the image's first and last columns and rows
        const int u = int(uniform(random, -30, 170)), v = int(uniform(random, -20, 85));
        silhouettes.back().pixels.set(std::clamp(u, 0, 140), std::clamp(v, 0, 64));
      }
    }
    for (int i = 0; i < 80; ++i) {
      const double size_m = std::exp(uniform(random, std::log(0.005), std::log(1.5)));
      Eigen::AlignedBox3d box(random_in_ball(random, i % 5 ? 0.4 : 2.0));
      box.extend(box.min() + size_m * random_direction(random));
      for (const int depth : {0, 1, 2}) {
        const bool expected = reference_free(silhouettes, box, depth);
        EXPECT_EQ(collision::is_certainly_free(silhouettes, box, depth), expected)
            << scene << ' ' << i << ' ' << depth;
        ++(expected ? free : not_free);
      }
    }
  }
  EXPECT_GT(free, 200);
  EXPECT_GT(not_free, 200);
}

TEST(BoxQuery, CertifiesABoxBehindACameraButNotABoxAroundIt) {
  const std::vector<geometry::Camera> one = {camera_at({1, 0, 0}, 100, 0.5)};
  const auto silhouettes = silhouettes_of({ball(kOrigin, 0.05)}, one);
  EXPECT_FALSE(collision::is_certainly_free(
      silhouettes, {Eigen::Vector3d(0.9, -0.1, -0.1), Eigen::Vector3d(1.1, 0.1, 0.1)}));
  EXPECT_TRUE(collision::is_certainly_free(
      silhouettes, {Eigen::Vector3d(1.1, -0.1, -0.1), Eigen::Vector3d(1.3, 0.1, 0.1)}));
}

TEST_F(PaperDetectionTest, CountsEachObjectInTheStageThatDecidedIt) {
  const std::vector<std::vector<collision::Triangle>> objects = {
      collision::world_triangles(geometry::sphere_mesh(0.05, 2), at({0.05, 0, 0})),
      collision::world_triangles(geometry::sphere_mesh(0.05, 2), at({0.3, 0.2, 0})),
      collision::world_triangles(geometry::box_mesh({0.1, 0.1, 0.1}), at({-0.07, 0, 0}))};
  const collision::Detection detection = detect_all({ball(kOrigin, 0.04)}, objects, cameras());
  EXPECT_EQ(detection.counts.objects, 3u);
  EXPECT_EQ(detection.counts.colliding, 2u);
  EXPECT_EQ(detection.counts.free_by_image, 1u);
  EXPECT_EQ(detection.counts.box_colliding, 2u);
  EXPECT_EQ(stages_sum(detection.counts), 3u);
}

// The faces of the box have no sample in the hull. The paper's boxes miss this case.
TEST_F(PaperDetectionTest, AHullWhollyInsideABoxIsACandidate) {
  // Two plates below and above a ball: neither they nor the faces of their box touch it.
  std::vector<collision::Triangle> shell =
      collision::world_triangles(geometry::box_mesh({0.6, 0.6, 0.02}), at({0, 0, -0.3}));
  const auto lid =
      collision::world_triangles(geometry::box_mesh({0.6, 0.6, 0.02}), at({0, 0, 0.3}));
  shell.insert(shell.end(), lid.begin(), lid.end());
  const collision::Detection around = detect_all({ball(kOrigin, 0.03)}, {shell}, cameras());
  EXPECT_EQ(around.counts.box_may_hold, 1u);
  EXPECT_EQ(around.counts.triangles_queried, 24u);
  EXPECT_EQ(around.objects[0].verdict, collision::CollisionVerdict::undecided);
  // With a plate through the ball, the object with the same box collides.
  const auto plate = collision::world_triangles(geometry::box_mesh({0.2, 0.2, 0.002}), at(kOrigin));
  shell.insert(shell.end(), plate.begin(), plate.end());
  const collision::Detection through = detect_all({ball(kOrigin, 0.03)}, {shell}, cameras());
  EXPECT_EQ(through.counts.box_may_hold, 1u);
  ASSERT_TRUE(through.objects[0].colliding());
  EXPECT_GE(through.objects[0].triangles.front(), 24u);
}

TEST_F(PaperDetectionTest, CellsCertifyABoxThatOverlapsTheSilhouettesInEveryImage) {
  // Each camera sees another ball in front of or behind the box, and no ball is in the box.
  const std::vector<geometry::Camera> two = {camera_at({1, 0, 0}, 240, 0.8),
                                             camera_at({0, 1, 0}, 240, 0.8)};
  const collision::Detection detection = detect_all(
      {ball({-0.3, 0.05, 0.04}, 0.03), ball({-0.05, -0.3, -0.04}, 0.03)},
      {collision::world_triangles(geometry::box_mesh({0.2, 0.2, 0.2}), at(kOrigin))}, two);
  EXPECT_EQ(detection.objects[0].verdict, collision::CollisionVerdict::free);
  EXPECT_EQ(detection.counts.free_by_cells, 1u);
}

TEST_F(PaperDetectionTest, StageCountsSumToTheNumberOfObjects) {
  Random random(12);
  for (int scene = 0; scene < 30; ++scene) {
    std::vector<std::vector<collision::Triangle>> objects;
    for (int i = 0; i < 6; ++i) {
      const double radius_m = uniform(random, 0.01, 0.08);
      objects.push_back(collision::world_triangles(geometry::sphere_mesh(radius_m, 1),
                                                   at(random_in_ball(random, 0.3))));
    }
    const std::vector<hull::Capsule> real = random_object(random, 2);
    const collision::Detection detection = detect_all(real, objects, random_cameras(random, 3));
    EXPECT_EQ(stages_sum(detection.counts), objects.size());
  }
}

// Each stage, computed for one object at a time from the queries it consists of.
TEST_F(PaperDetectionTest, EqualsTheQueriesOfEachStage) {
  Random random(15);
  std::size_t by_cells = 0, may_hold = 0;
  const auto detector = collision::paper_detector(400, 10);
  for (int scene = 0; scene < 8; ++scene) {
    const CollisionHull hull(
        silhouettes_of({random_cameras(random, 2 + scene % 3),
                        scene % 4 ? random_object(random, 3) : std::vector{ball(kOrigin, 0.02)}}));
    std::vector<collision::Bvh> trees{collision::Bvh(geometry::Mesh{})};
    std::vector<collision::DetectionObject> moved;
    for (int i = 0; i < 6; ++i)
      trees.emplace_back(geometry::sphere_mesh(uniform(random, 0.02, 0.15), 1 + i % 2));
    std::vector<std::vector<collision::Triangle>> objects;
    for (const collision::Bvh& tree : trees) {
      moved.push_back({&tree, at(random_in_ball(random, scene % 4 ? 0.25 : 0.05))});
      objects.push_back(collision::world_triangles(tree.mesh(), moved.back().world_from_object));
    }
    query_.set_silhouettes(hull.silhouettes);
    const collision::Detection found = collision::detect(query_, objects);
    collision::DetectionCounts expected{.objects = objects.size()};
    for (std::size_t i = 0; i < objects.size(); ++i) {
      const collision::ObjectCollision& object = found.objects[i];
      Eigen::AlignedBox3d box;
      for (const collision::Triangle& t : objects[i])
        for (const Eigen::Vector3d& v : t) box.extend(v);
      if (objects[i].empty() || collision::is_certainly_free(hull.silhouettes, box)) {
        ++expected.free_by_image;
        EXPECT_EQ(object.verdict, collision::CollisionVerdict::free);
        EXPECT_FALSE(object.hull_in_box);
        continue;
      }
      const auto faces =
          collision::world_triangles(geometry::box_mesh(box.sizes()), at(box.center()));
      if (!query_.query(faces).points.empty()) {
        ++expected.box_colliding;
      } else if (collision::is_certainly_free(hull.silhouettes, box, 3)) {
        ++expected.free_by_cells;
        EXPECT_EQ(object.verdict, collision::CollisionVerdict::free);
        EXPECT_FALSE(object.hull_in_box);
        continue;
      } else {
        ++expected.box_may_hold;
      }
      const collision::TriangleQueryResult own = query_.query(objects[i]);
      expected.triangles_queried += objects[i].size();
      expected.points_unconfirmed += own.points_unconfirmed;
      expected.colliding += !own.points.empty();
      EXPECT_EQ(object.verdict, own.points.empty() ? collision::CollisionVerdict::undecided
                                                   : collision::CollisionVerdict::colliding);
      EXPECT_EQ(object.hull_in_box, own.points.empty());
      EXPECT_EQ(object.points, own.points);
      std::vector<std::uint32_t> triangles;
      for (const collision::CollisionPoint& p : own.points) triangles.push_back(p.triangle);
      triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
      EXPECT_EQ(object.triangles, triangles);
    }
    EXPECT_EQ(found.counts.objects, expected.objects);
    EXPECT_EQ(found.counts.free_by_image, expected.free_by_image);
    EXPECT_EQ(found.counts.box_colliding, expected.box_colliding);
    EXPECT_EQ(found.counts.free_by_cells, expected.free_by_cells);
    EXPECT_EQ(found.counts.box_may_hold, expected.box_may_hold);
    EXPECT_EQ(found.counts.colliding, expected.colliding);
    EXPECT_EQ(found.counts.triangles_queried, expected.triangles_queried);
    EXPECT_EQ(found.counts.points_unconfirmed, expected.points_unconfirmed);
    by_cells += expected.free_by_cells, may_hold += expected.box_may_hold;
    detector->set_hull(hull.query, hull.silhouettes);
    const std::size_t before = detector->counts().points_unconfirmed;
    const auto again = detector->detect(moved);
    for (std::size_t i = 0; i < objects.size(); ++i)
      EXPECT_EQ(again[i].points, found.objects[i].points);
    EXPECT_EQ(detector->counts().points_unconfirmed, before + expected.points_unconfirmed);
  }
  EXPECT_GT(by_cells, 0u);
  EXPECT_GT(may_hold, 0u);
}

TEST_F(PaperDetectionTest, RejectsAVertexThatIsNotFinite) {
  auto broken = collision::world_triangles(geometry::box_mesh({1, 1, 1}), at(kOrigin));
  broken[3][1].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(detect_all({ball(kOrigin, 0.04)}, {broken}, cameras()), std::invalid_argument);
  for (collision::Triangle& t : broken)  // far from the hull, so no later stage sees the vertex
    for (Eigen::Vector3d& v : t) v.x() += 30;
  EXPECT_THROW(detect_all({ball(kOrigin, 0.04)}, {broken}, cameras()), std::invalid_argument);
}

}  // namespace
}  // namespace fivepipe::test
