// Backend `gl`: which triangles collide with the visual hull, and where, by compute shaders;
// verdicts as certain as backend `cpu`'s, and of the same meaning (cpu_detection.h).
//
//   1. trees       as backend `cpu`: a level of boxes a pass, then the triangles of the leaves
//   left, looked up in the cameras' maps.
//   2. parts       of the triangles left, halved pass by pass: free ones are dropped, those on the
//   samples' grid sampled, and where no sample is
//                  in the hull, halved on until each is free, one is found, or they are kFinest of
//                  eps.
//   3. on the CPU  every point that was found is asked in double. What the GPU left open, and what
//   it found and double does not confirm, is
//                  walked as backend `cpu` does (triangle_walk.h).
//
// The GPU's numbers are float; what they may be off is derived (gl_contact_camera.cpp) from what
// GLSL promises of them, and added to each look. So `free` is certified on every driver that keeps
// those promises; a point is in the hull on any.
#pragma once
#include <memory>
#include <span>

#include "common/collision/detection/cpu/cpu_detection.h"

namespace fivepipe::collision {

// Room for parts on the GPU [parts of 16 bytes, in three buffers]. Where it does not do, the pass
// is run again with twice as many; where `most` does not, triangles are walked on the CPU.
// Multiples of 64.
struct GlDetectionRoom {
  std::size_t first = std::size_t{1} << 16, max = std::size_t{1} << 21;
};

struct GlDetectionCounts {
  std::size_t triangles_open = 0;    // not free after 1.
  std::size_t parts = 0, found = 0;  // looked at in 2.; of them, with something in the hull
  std::size_t unconfirmed = 0;  // triangles: float was sure of a point, and double confirms none. 0
                                // on a driver that rounds as promised
  std::size_t triangles_on_cpu = 0;  // walked there
  std::size_t objects_on_cpu =
      0;  // too large for float or for the GPU's memory: all of them was left to backend `cpu`
  std::size_t overflows = 0;             // of the room for parts
  std::size_t over_budget = 0;           // as CpuDetectionCounts
  double descent_ms = 0, refine_ms = 0;  // GPU time of 1. and 2.
};

// Needs a current OpenGL 4.5 context from construction to destruction; changes no state but
// bindings. Not to be shared between threads.
class GlDetection {
 public:
  explicit GlDetection(const GlDetectionRoom& room =
                           {});  // throws GlError; std::invalid_argument: a room that can't be
  ~GlDetection();
  GlDetection(GlDetection&&) noexcept;
  GlDetection& operator=(GlDetection&&) noexcept;

  // The hull that is asked from now on; it, and the query, must stay until the next. Its maps are
  // written to the GPU.
  void set_hull(const hull::HullQuery& query);

  // As CpuDetection::detect, points of a triangle in another order; a hull has been set. Trees stay
  // on the GPU from call to call. The same input gives the same bits on the same driver; on others,
  // points of which float can't tell are all asked in double, but where a triangle has none on the
  // grid, the one that is found may be another, or the triangle be touching instead.
  std::span<ObjectCollision> detect(std::span<const DetectionObject> objects,
                                    const DetectionOptions& options = {},
                                    GlDetectionCounts* counts = nullptr);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace fivepipe::collision
