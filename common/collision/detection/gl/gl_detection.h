// Backend `gl`: verdicts and collision points of triangles against the visual hull, in compute
// shaders. Its verdicts have the same meaning and certainty as those of backend `cpu`
// (cpu_detection.h).
//
//   1. BVH       As in backend `cpu`: one pass per level tests the boxes, then one pass tests the
//                triangles of the remaining leaves, against the cameras' skip maps.
//   2. parts     Each pass halves the parts of the remaining triangles and drops the free ones.
//                Parts of the sample grid are sampled. A triangle without a sample in the hull is
//                halved further until every part is free, a point is found, or the parts reach
//                eps_m / kFinest.
//   3. CPU       The CPU tests every found point in double. It walks each triangle
//                (triangle_walk.h) that the GPU left open, or of which double confirms no point.
//
// The GPU computes in float. The error bounds derive from what GLSL guarantees
// (gl_contact_camera.cpp) and widen each lookup. So `free` is certified on every driver that keeps
// those guarantees, and a collision point is in the hull on any driver.
#pragma once
#include <memory>
#include <span>

#include "common/collision/detection/cpu/cpu_detection.h"

namespace fivepipe::collision {

// Capacity of each of three buffers on the GPU, in parts of 16 bytes: the initial value and the
// maximum, both multiples of 64. A refinement that exceeds it runs again with twice the capacity;
// at the maximum the CPU walks its triangles.
struct GlDetectionRoom {
  std::size_t first = std::size_t{1} << 16, max = std::size_t{1} << 21;
};

struct GlDetectionCounts {
  // Triangles that are not free after step 1.
  std::size_t triangles_open = 0;
  // Parts tested in step 2, and those with a point in the hull.
  std::size_t parts = 0, found = 0;
  // Triangles of which float was certain of a point and double confirms none. 0 on a driver that
  // rounds as GLSL requires.
  std::size_t unconfirmed = 0;
  std::size_t triangles_on_cpu = 0;
  // Objects that backend `cpu` tested because they are too large for float or for the GPU's memory.
  // The tests of the fallbacks check this and `overflows`.
  std::size_t objects_on_cpu = 0;
  // Number of refinements that exceeded the capacity for parts.
  std::size_t overflows = 0;
  // As in CpuDetectionCounts.
  std::size_t over_budget = 0;
  // GPU time of steps 1 and 2.
  double descent_ms = 0, refine_ms = 0;
};

// Needs a current OpenGL 4.5 context from construction to destruction. Changes no OpenGL state
// except bindings. Must not be shared between threads.
class GlDetection {
 public:
  // Throws GlError, or std::invalid_argument if `room` is not valid.
  explicit GlDetection(const GlDetectionRoom& room = {});
  ~GlDetection();

  // Sets the hull that detect() tests, and uploads its maps. Borrows the query and its hull until
  // the next call.
  void set_hull(const hull::HullQuery& query);

  // As CpuDetection::detect(), with a triangle's points in another order. Requires a hull. BVHs
  // stay on the GPU from call to call. The same input gives the same bits on the same driver. On
  // another driver a triangle without a sample in the hull may get another point, or be undecided;
  // all other points are the same, because double decides those that float cannot.
  std::span<ObjectCollision> detect(std::span<const DetectionObject> objects,
                                    const DetectionOptions& options = {},
                                    GlDetectionCounts* counts = nullptr);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace fivepipe::collision
