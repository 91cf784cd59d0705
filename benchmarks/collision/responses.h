// The response's speed and error, for the same CP_obj and V_rec by each way to find it: exact rays,
// the paper's window, the polygonised hull.
#pragma once
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "benchmarks/collision/methods.h"

namespace fivepipe::collision_bench {

// A way out, and what is true of it.
struct ResponseCase {
  Eigen::Vector3d cp_object_world_m, v_rec_world;  // unit length
  double reach_m;                                  // height of ABC
  double d_rec_m;  // by the exact reference: each camera's epipolar line, pixel by pixel
  struct Surface {
    std::size_t camera;  // that limits
    Eigen::Vector3d normal_world;
  };
  std::optional<Surface> surface;  // of the hull of the true silhouettes, where the scene has such
                                   // and the same camera's ends both hulls near CP_hull
};
// For each colliding object the default: the farthest CP_i, towards the object's centre. And sixty
// CP_i drawn by seed, along their triangles' normals, towards the side that is nearer. Those that
// have a way out, by the exact reference, within 5 cm.
std::vector<ResponseCase> response_cases(const CollisionScene& scene);

struct Quantiles {
  double median = 0, p95 = 0, worst = 0;
  std::size_t count = 0;
};
struct ResponseErrors {
  std::size_t cases = 0, no_exit = 0;  // no_way: the method finds none, where there is one
  Quantiles cp_hull_mm = {}, d_rec_mm = {}, n_hull_deg = {};
};

class Responses {
 public:
  // Borrows the scene. Needs a current OpenGL context.
  explicit Responses(const CollisionScene& scene);
  ~Responses();

  // Milliseconds for the response of each colliding object, CP_obj chosen among what the method
  // found: CP_hull, D_rec, N_hull; on one thread but for OpenGL's. Without the query after the move
  // that says whether it was recovered: that is a detection again. Nothing where the method has no
  // points, or no response but a plain loop over triangles (fcl).
  std::optional<double> frame_ms(const Method& method,
                                 std::span<const collision::ObjectCollision> found);
  // Nothing for methods without points.
  std::optional<ResponseErrors> errors(const Method& method);
  // Of the trees of objects that deform; a part of the query of methods that have them. Nothing
  // where it is not told apart.
  std::optional<double> refit_ms(const Method& method);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace fivepipe::collision_bench
