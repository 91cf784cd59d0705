// Fixture for the tests of the response: a real ball seen by cameras on its horizon, and virtual
// objects.
#pragma once
#include "common/collision/response/response.h"
#include "tests/support/collision/scene.h"
#include "tests/support/hull/queries.h"

namespace fivepipe::test {

inline constexpr double kRealRadius_m = 0.05, kVirtualRadius_m = 0.04;
inline constexpr double kFlatness_m = 0.02 * kVirtualRadius_m;
inline constexpr double kField_m = 0.16;
inline constexpr int kImage_px = 320;
inline constexpr double kScanStep_m = 1e-5;  // results within 0.01 mm of the truth count as exact
inline constexpr double kFootprint_m = kField_m / kImage_px;

// A hull with the top face z = 0. All cameras are in this plane and see it edge-on at the centre of
// their images.
inline std::vector<hull::Silhouette> plane_silhouettes() {
  std::vector<hull::Silhouette> silhouettes;
  for (const geometry::Camera& camera : ring(6, 1.0, 0, kImage_px, kField_m)) {
    hull::Silhouette s{camera, hull::ObjectPixels(kImage_px, kImage_px)};
    for (int v = kImage_px / 2; v < kImage_px; ++v)
      for (int u = 0; u < kImage_px; ++u) s.pixels.set(u, v);
    silhouettes.push_back(std::move(s));
  }
  return silhouettes;
}

// A real ball at the origin, seen by nine cameras on its horizon (18 silhouette directions), and a
// virtual ball above it.
class ResponseTest : public GlTest {
 protected:
  ResponseTest() { see({ball(kOrigin, kRealRadius_m)}); }

  void see(const std::vector<hull::Capsule>& real, int image_px = kImage_px) {
    real_ = real;
    see(silhouettes_of(real, ring(9, 1.0, 0, image_px, kField_m)));
  }
  void see(std::vector<hull::Silhouette> silhouettes) {
    silhouettes_ = std::move(silhouettes);
    detector_.set_silhouettes(silhouettes_);
    queries_.emplace(silhouettes_);
  }
  void place(std::vector<collision::Triangle> object, const Eigen::Vector3d& rp_object_m) {
    object_ = std::move(object);
    rp_object_m_ = rp_object_m;
    collision_ = moved(kOrigin);
  }
  void place(const Eigen::Vector3d& center_m) {
    place(collision::world_triangles(geometry::sphere_mesh(kVirtualRadius_m, 2), at(center_m)),
          center_m);
  }

  collision::ObjectCollision moved(const Eigen::Vector3d& move_m) {
    std::vector<collision::Triangle> object = object_;
    for (collision::Triangle& triangle : object)
      for (Eigen::Vector3d& v : triangle) v += move_m;
    return collision::detect(detector_, std::vector<std::vector<collision::Triangle>>{object})
        .objects[0];
  }
  collision::Requery requery() {
    return [this](const Eigen::Vector3d& move_m) { return moved(move_m); };
  }
  const hull::HullQuery& query() const { return queries_->query; }
  bool inside(const Eigen::Vector3d& p_world_m) const {
    return hull::in_hull(silhouettes_, p_world_m);
  }

  collision::Response respond_to(const collision::ResponseRequest& request,
                                 const collision::ResponseConfig& config = {}) {
    return collision::respond(query(), collision_, request, requery(), config);
  }
  // V_rec from the deepest point towards the ball's centre. The icosphere of 320 triangles is at
  // most kFlatness_m below its ball.
  collision::Response respond_by_default(const collision::ResponseConfig& config = {}) {
    return respond_to({rp_object_m_, std::nullopt, {true, true}, kFlatness_m}, config);
  }

  // Returns the distance from CP_obj of the farthest point on V_rec that is inside, up to reach_m
  // in steps of kScanStep_m.
  template <typename Inside>
  double exit_m(const collision::Response& response, double reach_m, Inside inside) const {
    for (double t_m = reach_m; t_m > 0; t_m -= kScanStep_m)
      if (inside(response.cp_object_world_m + t_m * response.v_rec_world)) return t_m;
    return 0;
  }

  std::vector<hull::Capsule> real_;
  std::vector<hull::Silhouette> silhouettes_;
  std::optional<Queries> queries_;
  collision::TriangleVolumeQuery detector_{400, 20};
  Eigen::Vector3d rp_object_m_;
  std::vector<collision::Triangle> object_;
  collision::ObjectCollision collision_;
};

// Returns a point at this distance from the real ball's centre.
inline Eigen::Vector3d above(double distance_m, double tilt_rad, double azimuth_rad) {
  return distance_m * Eigen::Vector3d(std::sin(tilt_rad) * std::cos(azimuth_rad),
                                      std::sin(tilt_rad) * std::sin(azimuth_rad),
                                      std::cos(tilt_rad));
}

// Returns a random center of the virtual ball: it overlaps the real ball by min_overlap_m to
// max_overlap_m, at most max_tilt_rad from +z.
inline Eigen::Vector3d random_above(Random& random, double min_overlap_m, double max_overlap_m,
                                    double max_tilt_rad) {
  const double overlap_m = uniform(random, min_overlap_m, max_overlap_m),
               tilt_rad = uniform(random, 0, max_tilt_rad), azimuth_rad = uniform(random, 0, 6.28);
  return above(kRealRadius_m + kVirtualRadius_m - overlap_m, tilt_rad, azimuth_rad);
}

inline double angle_rad(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace fivepipe::test
