// Proximity against a closed form: rectangular maps make the hull an intersection of half-spaces.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/collision/proximity/proximity_queries.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

struct Plane {
  Vector3d normal;  // unit, out of the hull
  double at_m;      // distance from the origin along the normal
};

struct Wedge {
  std::vector<hull::Silhouette> silhouettes;
  std::vector<Plane> planes;
};

Wedge random_wedge(Random& random, int cameras) {
  Wedge wedge;
  for (int i = 0; i < cameras; ++i) {
    const geometry::Camera camera = looking(random_vector(random, 0.6, 1.2), 160, 121, 0.6);
    hull::ObjectPixels pixels(160, 121);
    const int u0 = int(uniform(random, 30, 75)), u1 = int(uniform(random, 85, 130)),
              v0 = int(uniform(random, 20, 55)), v1 = int(uniform(random, 66, 100));
    for (int v = v0; v < v1; ++v)
      for (int u = u0; u < u1; ++u) pixels.set(u, v);
    wedge.silhouettes.push_back({camera, pixels});
    const Vector3d eye_m = geometry::camera_center_world_m(camera);
    const auto corner = [&](double u_px, double v_px) {
      return Vector3d(geometry::ray_through(camera, {u_px - 0.5, v_px - 0.5}).direction_world);
    };
    const Vector3d around[] = {corner(u0, v0), corner(u1, v0), corner(u1, v1), corner(u0, v1)};
    for (int k = 0; k < 4; ++k) {
      Vector3d normal = around[k].cross(around[(k + 1) % 4]).normalized();
      if (normal.dot(around[(k + 2) % 4]) > 0) normal = -normal;
      wedge.planes.push_back({normal, normal.dot(eye_m)});
    }
  }
  return wedge;
}

// Exact distance to the intersection of half-spaces. The nearest point is on a face, an edge or a
// corner, so it is the nearest projection onto one to three planes that is inside all half-spaces.
class WedgeDistance {
 public:
  explicit WedgeDistance(const std::vector<Plane>& planes) : planes_(planes) {
    for (std::size_t i = 0; i < planes.size(); ++i) {
      add({i});
      for (std::size_t j = i + 1; j < planes.size(); ++j) {
        add({i, j});
        for (std::size_t k = j + 1; k < planes.size(); ++k) add({i, j, k});
      }
    }
  }
  double operator()(const Vector3d& p) const {
    if (in_all(p)) return 0;
    double nearest_m = kInfinity;
    for (const Feature& feature : features_) {
      const Vector3d q = p - feature.towards * (feature.normals * p - feature.at_m);
      const double to_m = (q - p).norm();
      if (to_m < nearest_m && in_all(q)) nearest_m = to_m;
    }
    return nearest_m;
  }

 private:
  struct Feature {  // face, edge or corner: its planes as rows; unused rows are 0
    Eigen::Matrix3d normals = Eigen::Matrix3d::Zero(), towards;
    Vector3d at_m = Vector3d::Zero();
  };
  void add(std::initializer_list<std::size_t> on) {
    Feature feature;
    Eigen::Index row = 0;
    for (const std::size_t i : on) {
      feature.normals.row(row) = planes_[i].normal.transpose();
      feature.at_m[row++] = planes_[i].at_m;
    }
    feature.towards = feature.normals.completeOrthogonalDecomposition().pseudoInverse();
    features_.push_back(feature);
  }
  bool in_all(const Vector3d& q) const {
    constexpr double kOnPlane_m = 1e-10;  // rounding of a projection
    return std::all_of(planes_.begin(), planes_.end(), [&](const Plane& plane) {
      return plane.normal.dot(q) <= plane.at_m + kOnPlane_m;
    });
  }
  std::vector<Plane> planes_;
  std::vector<Feature> features_;
};

TEST(Proximity, BoundsTheDistanceToAWedgeOfPlanes) {
  constexpr collision::ProximityOptions kOptions{0.15, 0.001};
  int below_cap = 0, beyond = 0, inside = 0;
  for (int seed = 1; seed <= 24; ++seed) {
    Random random(seed);
    const Wedge wedge = random_wedge(random, 1 + seed % 3);
    const WedgeDistance distance_m(wedge.planes);
    const Queries q(wedge.silhouettes);
    const auto points = random_points(random, 80, 0.35);
    const auto found = of_points(q.query, kOptions, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double true_m = distance_m(points[i]);
      ASSERT_LE(found[i].min_m, true_m + kRounding_m)
          << "seed " << seed << " at " << points[i].transpose();
      ASSERT_GE(found[i].max_m, true_m - kRounding_m)
          << "seed " << seed << " at " << points[i].transpose();
      if (true_m > kRounding_m && true_m < kOptions.cap_m) {
        ASSERT_TRUE(is_tight(found[i], kOptions))
            << "seed " << seed << " at " << points[i].transpose();
        ++below_cap;
      }
      if (true_m > kOptions.cap_m + kOptions.tolerance_m) {
        ASSERT_EQ(found[i], (collision::Proximity{kOptions.cap_m, kInfinity}));
        ++beyond;
      }
      inside += found[i] == collision::Proximity{0, 0};
    }
  }
  EXPECT_GT(below_cap, 400);
  EXPECT_GT(beyond, 150);
  EXPECT_GT(inside, 100);
}

TEST(Proximity, BoundsTheDistanceOfTrianglesToAWedgeOfPlanes) {
  constexpr collision::ProximityOptions kOptions{0.1, 0.001};
  int below_cap = 0;
  for (int seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    const Wedge wedge = random_wedge(random, 2);
    const WedgeDistance distance_m(wedge.planes);
    const Queries q(wedge.silhouettes);
    for (int i = 0; i < 20; ++i) {
      const collision::Triangle triangle = random_triangle(random, 0.25, i % 2 ? 0.02 : 0.3);
      const collision::Proximity found = of_triangles(q.query, kOptions, std::vector{triangle})[0];
      // The distance is 1-Lipschitz, so the nearest sample's distance is too large by at most half
      // the spacing of the samples.
      constexpr int kSamples = 16;
      const collision::TriangleView view = collision::view_of(triangle);
      const double longest_m = (view.base1_world_m - view.base0_world_m).norm();
      double sampled_m = kInfinity;
      for (int a = 0; a <= kSamples; ++a)
        for (int b = 0; a + b <= kSamples; ++b)
          sampled_m =
              std::min(sampled_m,
                       distance_m(triangle[0] + double(a) / kSamples * (triangle[1] - triangle[0]) +
                                  double(b) / kSamples * (triangle[2] - triangle[0])));
      ASSERT_LE(found.min_m, sampled_m + kRounding_m) << "seed " << seed << " triangle " << i;
      ASSERT_GE(found.max_m, sampled_m - longest_m / kSamples)
          << "seed " << seed << " triangle " << i;
      ASSERT_TRUE(is_tight(found, kOptions));
      below_cap += sampled_m > 0 && sampled_m < kOptions.cap_m;
    }
  }
  EXPECT_GT(below_cap, 40);
}

}  // namespace
}  // namespace fivepipe::test
