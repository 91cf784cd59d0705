// Connected components of the hull.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <numbers>
#include <stdexcept>

#include "common/collision/tracking/hull_components.h"
#include "tests/support/collision/scene.h"
#include "tests/support/hull/queries.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

const Eigen::AlignedBox3d kSpace(Vector3d(-0.3, -0.3, -0.3), Vector3d(0.3, 0.3, 0.3));

std::vector<collision::HullComponent> components_of(
    const std::vector<hull::Silhouette>& silhouettes, double cell_m, int threads = 1,
    const Eigen::AlignedBox3d& within = kSpace, const hull::HullRule& rule = {}) {
  base::WorkerPool pool(threads);
  hull::CpuHull hull(pool, silhouettes, rule);
  return collision::hull_components(hull::HullQuery(hull), {within, cell_m});
}

// Many cameras on all sides: the hull is almost the object.
std::vector<geometry::Camera> all_around(int size_px = 300) {
  std::vector<geometry::Camera> cameras = ring(12, 1.5, 0.5, size_px, 0.9);
  for (const geometry::Camera& c : ring(12, 1.5, -0.4, size_px, 0.9)) cameras.push_back(c);
  for (const geometry::Camera& c : ring(8, 1.5, 1.1, size_px, 0.9)) cameras.push_back(c);
  return cameras;
}

TEST(HullComponents, MomentsEqualTheSumOverCellsInTheHull) {
  Random random(1);
  for (int scene = 0; scene < 6; ++scene) {
    const auto silhouettes =
        silhouettes_of({random_cameras(random, 3 + scene % 3),
                        {{random_in_ball(random, 0.1), random_in_ball(random, 0.1),
                          uniform(random, 0.02, 0.05)}}});
    const double cell_m = 0.012;
    const auto components = components_of(silhouettes, cell_m);
    double count = 0, found = 0;
    Vector3d sum = Vector3d::Zero(), found_sum = Vector3d::Zero();
    for (int z = 0; z < 50; ++z)
      for (int y = 0; y < 50; ++y)
        for (int x = 0; x < 50; ++x) {
          const Vector3d p = kSpace.min() + cell_m * Vector3d(x + 0.5, y + 0.5, z + 0.5);
          if (!hull::in_hull(silhouettes, p)) continue;
          ++count;
          sum += p;
        }
    for (const collision::HullComponent& component : components)
      found += double(component.cells),
          found_sum += double(component.cells) * component.centroid_world_m;
    // Components of one cell are dropped.
    EXPECT_NEAR(found, count, 3 + 0.01 * count);
    if (found == count) {
      EXPECT_LT((found_sum - sum).norm() / count, 1e-9);
    }
  }
}

struct Reference {
  std::size_t cells = 0;
  Vector3d centroid_world_m = Vector3d::Zero();
  Eigen::Matrix3d covariance_world_m2 = Eigen::Matrix3d::Zero();
  Eigen::AlignedBox3d box_world_m;
  bool at_the_search_box = false;  // at a side or the top
};

// The components of the cells whose center is in the hull, cell by cell: neighbours share a face,
// an edge or a corner. Each cell is a cube, so its own moments count.
std::vector<Reference> reference_components(const std::vector<hull::Silhouette>& silhouettes,
                                            const Eigen::AlignedBox3d& within, double cell_m,
                                            std::size_t min_cells) {
  const Eigen::Vector3i size = (within.sizes() / cell_m).array().ceil().cast<int>();
  std::map<std::array<int, 3>, bool> open;  // by (z, y, x)
  const auto center = [&](const std::array<int, 3>& cell) -> Vector3d {
    return within.min() + cell_m * Vector3d(cell[2] + 0.5, cell[1] + 0.5, cell[0] + 0.5);
  };
  for (int z = 0; z < size.z(); ++z)
    for (int y = 0; y < size.y(); ++y)
      for (int x = 0; x < size.x(); ++x)
        if (hull::in_hull(silhouettes, center({z, y, x}))) open[{z, y, x}] = true;
  std::vector<Reference> found;
  for (auto& [seed, is_open] : open) {
    if (!is_open) continue;
    std::vector<std::array<int, 3>> cells{seed};
    is_open = false;
    for (std::size_t i = 0; i < cells.size(); ++i)
      for (int n = 0; n < 27; ++n) {
        const auto next = open.find(
            {cells[i][0] + n / 9 - 1, cells[i][1] + n / 3 % 3 - 1, cells[i][2] + n % 3 - 1});
        if (next != open.end() && next->second) next->second = false, cells.push_back(next->first);
      }
    if (cells.size() < min_cells) continue;
    Reference component;
    component.cells = cells.size();
    const double count = double(cells.size());
    for (const auto& cell : cells) {
      component.centroid_world_m += center(cell) / count;
      component.box_world_m.extend(center(cell) - Vector3d::Constant(0.5 * cell_m));
      component.box_world_m.extend(center(cell) + Vector3d::Constant(0.5 * cell_m));
      for (std::size_t axis = 0; axis < 3; ++axis)
        // The next centre would be outside of the box.
        component.at_the_search_box |=
            (axis > 0 && cell[axis] == 0) ||
            center(cell)[2 - Eigen::Index(axis)] + cell_m > within.max()[2 - Eigen::Index(axis)];
    }
    for (const auto& cell : cells) {
      const Vector3d off = center(cell) - component.centroid_world_m;
      component.covariance_world_m2 +=
          (off * off.transpose() + cell_m * cell_m / 12 * Eigen::Matrix3d::Identity()) / count;
    }
    found.push_back(component);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Reference& a, const Reference& b) { return a.cells > b.cells; });
  return found;
}

TEST(HullComponents, EqualALabellingCellByCell) {
  Random random(7);
  std::size_t components = 0, at_the_search_box = 0;
  for (int scene = 0; scene < 6; ++scene) {
    // Scattered squares, seen by two to four cameras, that the images' borders do not clip.
    std::vector<hull::Silhouette> silhouettes;
    for (const geometry::Camera& camera :
         ring(2 + scene % 2, 1.2, 0.15 + 0.05 * scene, 120, 0.7, Vector3d(0, 0, 0.02))) {
      silhouettes.push_back({camera, hull::ObjectPixels(120, 120)});
      for (int i = 0; i < 60; ++i) {
        const int u0 = int(uniform(random, 2, 100)), v0 = int(uniform(random, 2, 100)),
                  side = int(uniform(random, 1, 5));
        for (int v = v0; v < v0 + side; ++v)
          for (int u = u0; u < u0 + side; ++u) silhouettes.back().pixels.set(u, v);
      }
    }
    // From less than one word of cells to more than two, and sizes that cells do not divide.
    const Eigen::AlignedBox3d within(Vector3d(-0.2, -0.15, -0.12), Vector3d(scene % 3 == 0   ? 0.1
                                                                            : scene % 3 == 1 ? 0.19
                                                                                             : 0.6,
                                                                            0.15, 0.111));
    const double cell_m = 0.0061;
    base::WorkerPool pool(2);
    hull::CpuHull hull(pool, silhouettes);
    for (const std::size_t min_cells : {1u, 30u}) {
      const auto found =
          collision::hull_components(hull::HullQuery(hull), {within, cell_m, min_cells});
      const auto expected = reference_components(silhouettes, within, cell_m, min_cells);
      ASSERT_EQ(found.size(), expected.size()) << scene;
      for (std::size_t i = 0; i < found.size(); ++i) {
        const collision::HullComponent& component = found[i];
        const Reference& truth = expected[i];
        EXPECT_EQ(component.cells, truth.cells) << scene << ' ' << i;
        EXPECT_NEAR(component.volume_m3, double(truth.cells) * cell_m * cell_m * cell_m, 1e-15);
        EXPECT_LT((component.centroid_world_m - truth.centroid_world_m).norm(), 1e-12);
        EXPECT_LT((component.covariance_world_m2 - truth.covariance_world_m2).norm(), 1e-13);
        EXPECT_LT((component.box_world_m.min() - truth.box_world_m.min()).norm(), 1e-12);
        EXPECT_LT((component.box_world_m.max() - truth.box_world_m.max()).norm(), 1e-12);
        EXPECT_EQ(component.clipped, truth.at_the_search_box) << scene << ' ' << i;
        EXPECT_TRUE(component.outlines.empty());
        ++components, at_the_search_box += truth.at_the_search_box;
      }
    }
  }
  EXPECT_GT(components, 40u);
  EXPECT_GT(at_the_search_box, 5u);
  EXPECT_LT(at_the_search_box, components);
}

// Two squares in one image, of which the second touches one side of it, or is one pixel inside.
TEST(HullComponents, AreClippedAtEachSideOfAnImage) {
  const geometry::Camera camera = camera_at({0, 0, 1}, 64, 0.64, kOrigin, Vector3d::UnitY());
  for (int side = 0; side < 4; ++side)
    for (const int inside_px : {0, 1, 2}) {
      hull::ObjectPixels pixels(64, 64);
      const auto square = [&](int u0, int v0) {
        for (int v = v0; v < v0 + 10; ++v)
          for (int u = u0; u < u0 + 12; ++u) pixels.set(u, v);
      };
      square(26, 26);
      const int low = inside_px;
      square(side == 0   ? low
             : side == 1 ? 52 - low
                         : 26,
             side == 2   ? low
             : side == 3 ? 54 - low
                         : 26);
      const auto components = components_of({{camera, pixels}}, 0.005, 1,
                                            {Vector3d(-1, -1, -0.02), Vector3d(1, 1, 0.02)});
      ASSERT_EQ(components.size(), 2u);
      EXPECT_TRUE(components[0].clipped && components[1].clipped);  // at the search box in z
      // A ball's hull, which the search box does not clip.
      std::vector<hull::Silhouette> both{{camera, pixels}};
      const geometry::Camera across = camera_at({1, 0.1, 0}, 400, 2);
      both.push_back({across, hull::ObjectPixels(400, 400)});
      for (int v = 195; v < 205; ++v)
        for (int u = 10; u < 390; ++u) both.back().pixels.set(u, v);
      const auto thin =
          components_of(both, 0.005, 1, {Vector3d(-0.5, -0.5, -0.2), Vector3d(0.5, 0.5, 0.2)});
      ASSERT_EQ(thin.size(), 2u) << side;
      int clipped = 0;
      for (const collision::HullComponent& component : thin) {
        const bool central = component.centroid_world_m.head<2>().norm() < 0.1;
        EXPECT_FALSE(central && component.clipped) << side << ' ' << inside_px;
        clipped += component.clipped;
      }
      EXPECT_EQ(clipped, inside_px == 0) << side << ' ' << inside_px;
    }
}

TEST(HullComponents, BallAndRodMomentsAreCorrect) {
  const Vector3d axis = Vector3d(1, 2, -0.5).normalized();
  const hull::Capsule rod{Vector3d(-0.1, 0, 0.05) - 0.08 * axis,
                          Vector3d(-0.1, 0, 0.05) + 0.08 * axis, 0.02};
  const auto components =
      components_of(silhouettes_of({ball({0.15, -0.05, 0}, 0.05), rod}, all_around()), 0.004);
  ASSERT_EQ(components.size(), 2u);
  const collision::HullComponent &sphere = components[0].centroid_world_m.x() > 0 ? components[0]
                                                                                  : components[1],
                                 &capsule = components[0].centroid_world_m.x() > 0 ? components[1]
                                                                                   : components[0];
  EXPECT_LT((sphere.centroid_world_m - Vector3d(0.15, -0.05, 0)).norm(), 0.002);
  EXPECT_NEAR(sphere.volume_m3, 4.0 / 3 * std::numbers::pi * 1.25e-4, 0.15 * 5.2e-4);
  EXPECT_LT((capsule.centroid_world_m - Vector3d(-0.1, 0, 0.05)).norm(), 0.002);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(capsule.covariance_world_m2);
  EXPECT_GT(std::abs(axes.eigenvectors().col(2).dot(axis)), std::cos(0.02));
  EXPECT_NEAR(std::sqrt(axes.eigenvalues()(2)), 0.2 / std::sqrt(12.0),
              0.01);  // about that of a rod of its length
  EXPECT_FALSE(sphere.clipped || capsule.clipped);
}

TEST(HullComponents, TouchingCellsFormOneComponent) {
  const auto separate =
      silhouettes_of({ball({-0.06, 0, 0}, 0.04), ball({0.06, 0, 0}, 0.04)}, all_around());
  const auto overlapping =
      silhouettes_of({ball({-0.03, 0, 0}, 0.04), ball({0.03, 0, 0}, 0.04)}, all_around());
  EXPECT_EQ(components_of(separate, 0.005).size(), 2u);
  EXPECT_EQ(components_of(overlapping, 0.005).size(), 1u);
}

TEST(HullComponents, IsClippedAtTheSearchBoxAndImageBorder) {
  const auto silhouettes = silhouettes_of({ball(kOrigin, 0.05)}, all_around());
  EXPECT_FALSE(components_of(silhouettes, 0.005)[0].clipped);
  EXPECT_TRUE(components_of(silhouettes, 0.005, 1,
                            {Vector3d(-0.3, -0.3, -0.3), Vector3d(0.01, 0.3, 0.3)})[0]
                  .clipped);
  EXPECT_TRUE(components_of(silhouettes, 0.005, 1,
                            {Vector3d(-0.3, -0.3, -0.3), Vector3d(0.3, 0.3, 0.01)})[0]
                  .clipped);
  EXPECT_FALSE(components_of(silhouettes, 0.005, 1,
                             {Vector3d(-0.3, -0.3, -0.01), Vector3d(0.3, 0.3, 0.3)})[0]
                   .clipped)
      << "it stands on the floor";
  const auto at_border = silhouettes_of({ball({0.43, 0, 0}, 0.05)}, ring(4, 1.5, 1.2, 300, 0.9));
  for (const collision::HullComponent& component :
       components_of(at_border, 0.005, 1, {Vector3d(0.2, -0.3, -0.3), Vector3d(0.8, 0.3, 0.3)}))
    EXPECT_TRUE(component.clipped);
}

// The box also cuts the hull. Its upper faces are a third of a cell beyond the last whole layer.
TEST(HullComponents, IsClippedAtABoxThatIsNoMultipleOfTheCells) {
  const auto silhouettes = silhouettes_of({ball(kOrigin, 0.05)}, all_around());
  const double cell_m = 0.006, least_m = -0.3, upper_m = least_m + (50 + 1.0 / 3) * cell_m;
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::AlignedBox3d box(Vector3d::Constant(least_m), Vector3d::Constant(0.3));
    box.max()[axis] = upper_m;  // through the ball
    const auto found = components_of(silhouettes, cell_m, 1, box, {.within_world_m = box});
    ASSERT_EQ(found.size(), 1u) << axis;
    EXPECT_TRUE(found[0].clipped) << axis;
    box.max()[axis] += 0.1;  // beside it
    EXPECT_FALSE(components_of(silhouettes, cell_m, 1, box, {.within_world_m = box})[0].clipped)
        << axis;
  }
}

TEST(HullComponents, AreIndependentOfThreads) {
  const auto silhouettes = silhouettes_of({ball({-0.06, 0, 0}, 0.04), ball({0.06, 0, 0}, 0.03)},
                                          ring(4, 1.5, 0.6, 300, 0.9));
  const auto one = components_of(silhouettes, 0.005, 1),
             three = components_of(silhouettes, 0.005, 3);
  ASSERT_EQ(one.size(), three.size());
  for (std::size_t i = 0; i < one.size(); ++i)
    EXPECT_EQ(one[i].centroid_world_m, three[i].centroid_world_m);
}

TEST(HullComponents, EmptyHullHasNoneAndInvalidArgumentsThrow) {
  EXPECT_TRUE(components_of({}, 0.005).empty());
  const auto silhouettes = silhouettes_of({ball(kOrigin, 0.05)}, ring(4, 1.5, 0.6, 300, 0.9));
  EXPECT_TRUE(
      components_of(silhouettes, 0.005, 1, {Vector3d(0.2, 0.2, 0.2), Vector3d(0.3, 0.3, 0.3)})
          .empty());
  EXPECT_THROW(components_of(silhouettes, 0), std::invalid_argument);
  EXPECT_THROW(components_of(silhouettes, 1e-6), std::invalid_argument);
  EXPECT_THROW(components_of(silhouettes, std::numeric_limits<double>::infinity()),
               std::invalid_argument);
  EXPECT_THROW(components_of(silhouettes, 0.005, 1, {}), std::invalid_argument);
  EXPECT_THROW(
      components_of(silhouettes, 0.005, 1,
                    {Vector3d(0, 0, std::numeric_limits<double>::quiet_NaN()), Vector3d(1, 1, 1)}),
      std::invalid_argument);
}

// Limits::seen, on rigs whose cameras see only parts of the object.
TEST(HullComponents, HoldTheCellsThatTheSeeingCamerasKeep) {
  Random random(9);
  int only_seen = 0, clipped = 0;
  for (int scene = 0; scene < 8; ++scene) {
    const auto silhouettes =
        silhouettes_of({narrow_cameras(random, 2 + scene % 3), random_object(random, 2, 0.15)});
    for (const int min_seen : {1, 2}) {
      const hull::HullRule rule{hull::Limits::seen, min_seen};
      const double cell_m = 0.015;
      double count = 0, by_all = 0, found = 0;
      for (int z = 0; z < 40; ++z)
        for (int y = 0; y < 40; ++y)
          for (int x = 0; x < 40; ++x) {
            const Vector3d p = kSpace.min() + cell_m * Vector3d(x + 0.5, y + 0.5, z + 0.5);
            count += hull::in_hull(silhouettes, p, rule);
            by_all += hull::in_hull(silhouettes, p);
          }
      base::WorkerPool pool(1);
      hull::CpuHull hull(pool, silhouettes, rule);
      for (const collision::HullComponent& c : collision::hull_components(
               hull::HullQuery(hull), {.within_world_m = kSpace, .cell_m = cell_m, .min_cells = 1}))
        found += double(c.cells), clipped += c.clipped;
      EXPECT_EQ(found, count) << scene << ' ' << min_seen;
      only_seen += count > by_all;
    }
  }
  EXPECT_GT(only_seen, 8);
  EXPECT_GT(clipped, 4);
}

// A camera without object pixels that does not see the component does not cut it off.
TEST(HullComponents, ACameraThatSeesNothingClipsNothing) {
  auto silhouettes = silhouettes_of({ball(kOrigin, 0.05)}, ring(4, 1.5, 0.6, 100, 0.9));
  silhouettes.push_back({{geometry::pinhole_from_fov(64, 48, 0.8),
                          geometry::look_at({0, 0, 1}, {0.1, 0, 2}, Vector3d::UnitX())},
                         hull::ObjectPixels(64, 48)});
  EXPECT_TRUE(components_of(silhouettes, 0.01).empty());
  const auto found = components_of(silhouettes, 0.01, 1, kSpace, {hull::Limits::seen, 4});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_FALSE(found[0].clipped);
}

// The fifth camera sees half of the first ball, and nothing of the second one.
TEST(HullComponents, OnlyTheComponentThatACameraSeesInPartIsClipped) {
  std::vector<geometry::Camera> cameras = ring(4, 1.5, 0.6, 100, 0.9);
  cameras.push_back({geometry::pinhole_from_fov(64, 48, 0.2),
                     geometry::look_at({-0.3, 0, 2}, {-0.3, 0, 0}, Vector3d::UnitY())});
  const auto silhouettes =
      silhouettes_of({ball({-0.1, 0, 0}, 0.05), ball({0.12, 0, 0}, 0.05)}, cameras);
  auto found = components_of(silhouettes, 0.01, 1, kSpace, {hull::Limits::seen, 4});
  ASSERT_EQ(found.size(), 2u);
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
    return a.box_world_m.min().x() < b.box_world_m.min().x();
  });
  EXPECT_TRUE(found[0].clipped);
  EXPECT_FALSE(found[1].clipped);
}

// The maximum is 512^3 cells.
TEST(HullComponents, HasAtMost134217728Cells) {
  const auto silhouettes = silhouettes_of({ball(kOrigin, 0.02)}, ring(4, 1.5, 0.6, 100, 0.9));
  const double cell_m = 0x1p-10;
  const Vector3d half = Vector3d::Constant(0.25);
  EXPECT_EQ(components_of(silhouettes, cell_m, 1, {-half, half}).size(), 1u);
  EXPECT_THROW(components_of(silhouettes, cell_m, 1, {-half, half + Vector3d(cell_m, 0, 0)}),
               std::invalid_argument);
}

// Cells of 5 mm; a component of one cell is dropped.
TEST(HullComponents, DefaultsAreCellsOfFiveMillimetresAndTwoCells) {
  Random random(8);
  std::vector<hull::Silhouette> noise;
  for (const geometry::Camera& camera : ring(2, 1.2, 0.5, 100, 0.5))
    noise.push_back({camera, random_pixels(random, 100, 100, 0.15)});
  const Queries q(noise);
  const auto cells = [&](const collision::HullComponentsOptions& options) {
    std::vector<std::size_t> found;
    for (const collision::HullComponent& c : collision::hull_components(q.query, options)) {
      found.push_back(c.cells);
      EXPECT_TRUE(c.outlines.empty());
    }
    return found;
  };
  const Eigen::AlignedBox3d within(Vector3d(-0.1, -0.1, -0.05), Vector3d(0.1, 0.1, 0.05));
  const auto found = cells({within});
  EXPECT_EQ(found, cells({within, 0.005, 2}));
  EXPECT_NE(found, cells({within, 0.01, 2}));
  EXPECT_NE(found, cells({within, 0.0025, 2}));
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found.back(), 2u);
  EXPECT_EQ(cells({within, 0.005, 1}).back(), 1u);
}

// Double decides every cell that the narrow camera does not certify free.
TEST(HullComponents, ACameraTooWideForFloatStillLimitsThem) {
  hull::Silhouette narrow{{{64, 64, 64, 64, 31.5, 31.5}, Eigen::Isometry3d::Identity()},
                          hull::ObjectPixels(64, 64)};
  for (int v = 10; v < 54; ++v) narrow.pixels.set_run(10, 54, v);
  const std::vector<hull::Silhouette> silhouettes{narrow, too_wide_for_float({10, 54})};
  const Eigen::AlignedBox3d within(Vector3d(-0.3, -0.3, 0.9), Vector3d(0.31, 0.3, 1.1));
  const auto found = components_of(silhouettes, 0.02, 1, within);
  const auto expected = reference_components(silhouettes, within, 0.02, 2);
  ASSERT_EQ(found.size(), 1u);
  ASSERT_EQ(expected.size(), 1u);
  EXPECT_EQ(found[0].cells, expected[0].cells);
  EXPECT_LT((found[0].centroid_world_m - expected[0].centroid_world_m).norm(), 1e-12);
}

}  // namespace
}  // namespace fivepipe::test
