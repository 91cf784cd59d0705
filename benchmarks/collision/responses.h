// Time and error of the response for the same CP_obj and V_rec, by three methods: exact rays, the
// paper's window, and the polygonised hull.
#pragma once
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "benchmarks/collision/methods.h"

namespace fivepipe::collision_bench {

// A recovery direction and its true exit from the hull.
struct ResponseCase {
  Eigen::Vector3d cp_object_world_m, v_rec_world;  // unit length
  double height_m;                                 // of the triangle ABC: the longest search
  double d_rec_m;  // by the exact reference: each camera's epipolar line, pixel by pixel
  struct Surface {
    std::size_t camera;  // the limiting camera
    Eigen::Vector3d normal_world;
  };
  // Of the hull of the true silhouettes. Empty if the scene has none, or if different cameras limit
  // the two hulls near CP_hull.
  std::optional<Surface> surface;
};
// Returns the default case of each colliding object (the farthest CP_i, towards the object's
// center), then sixty seeded CP_i, along their triangles' normals, towards the nearer side. Keeps
// only the cases that have an exit within 5 cm by the exact reference.
std::vector<ResponseCase> response_cases(const CollisionScene& scene);

struct Quantiles {
  double median = 0, p95 = 0, worst = 0;
  std::size_t count = 0;
};
struct ResponseErrors {
  std::size_t cases = 0, no_exit = 0;  // no_exit: the method finds none
  Quantiles cp_hull_mm = {}, d_rec_mm = {}, n_hull_deg = {};
};

class Responses {
 public:
  // Borrows the scene. Needs a current OpenGL context.
  explicit Responses(const CollisionScene& scene);
  ~Responses();

  // Returns the time in ms of the responses (CP_obj among the method's points, CP_hull, D_rec and
  // N_hull) of all colliding objects, on one thread except for OpenGL. It omits the query after the
  // move that verifies the recovery, because that is another detection. nullopt if the method
  // returns no points, and for fcl, whose response is a plain loop over triangles.
  std::optional<double> frame_ms(const Method& method,
                                 std::span<const collision::ObjectCollision> found);
  // nullopt if the method returns no points.
  std::optional<ResponseErrors> errors(const Method& method);
  // Returns the time in ms to refit the trees of deforming objects, which is part of the query of
  // methods with such trees. nullopt if it is not measured separately (fcl).
  std::optional<double> refit_ms(const Method& method);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace fivepipe::collision_bench
