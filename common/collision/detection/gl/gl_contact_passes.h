// The GPU side of backend `gl` (gl_detection.h): uploads maps and BVHs, and runs the compute passes
// that descend the BVHs and refine the remaining triangles.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/collision/detection/cpu/cpu_detection.h"
#include "common/collision/detection/gl/gl_contact_buffers.h"
#include "common/gl/objects.h"

namespace fivepipe::collision {

// Needs a current OpenGL 4.5 context from construction to destruction. Changes no OpenGL state
// except bindings.
class GlContactPasses {
 public:
  GlContactPasses();  // throws GlError

  // Uploads the hull's maps. Returns false if there are more than 64 cameras, or if the maps exceed
  // the driver's largest storage block; the caller must then not run any pass.
  bool set_maps(const hull::CpuHull& hull);

  // Sets the objects of the next passes. BVHs stay on the GPU from call to call and are uploaded
  // again when their contents change. Returns for each object whether it fits. An object does not
  // fit if it is too large for float or for the driver's largest storage block; the passes ignore
  // it.
  std::vector<char> set_objects(const hull::CpuHull& hull,
                                std::span<const DetectionObject> objects);

  // Returns the triangles that are not free, in any order.
  std::vector<gl_contact::OpenTriangle> open_triangles();

  struct Refined {
    std::vector<gl_contact::Part> found;    // sorted by triangle, level, position
    std::vector<gl_contact::State> states;  // by triangle
    std::size_t parts = 0;                  // number of parts tested
  };
  // Refines triangles, given about origin_world_m() in the world's axes. `first` contains their
  // parts of level 0. `room` is the capacity of each part buffer, in parts. Returns nullopt if it
  // is too small.
  std::optional<Refined> refine(std::span<const gl_contact::RefinedTriangle> triangles,
                                std::span<const gl_contact::Part> first, std::size_t room);

  // Largest `room` that the driver supports, in parts.
  std::size_t max_room() const {
    return (max_bytes_ - sizeof(gl_contact::FoundHeader)) / sizeof(gl_contact::Part) /
           gl_contact::kGroup * gl_contact::kGroup;
  }
  // A point near the hull: the origin of the frame of refined triangles.
  const Eigen::Vector3d& origin_world_m() const { return origin_world_m_; }
  // GPU time of the last open_triangles() and refine(). Both wait for the GPU.
  double descent_ms() const { return descent_timer_.elapsed_ms(); }
  double refine_ms() const { return refine_timer_.elapsed_ms(); }

 private:
  void place_trees(std::span<const DetectionObject> objects, std::vector<char>& fits);
  void use(const gl::GlProgram& program) const;
  void run_passes(int to_blocks, int beyond, std::size_t room);
  gl_contact::GlCamera placed(gl_contact::GlCamera camera, std::size_t map) const;

  struct PlacedTree {
    std::uint64_t content;
    std::size_t first_word;
  };
  struct PlacedMap {
    std::size_t first_byte;  // of its base pixel
    std::int32_t stride;
  };
  gl::GlProgram boxes_, triangles_, refine_, sample_, blocks_;
  gl::GlBuffer skip_map_buffer_, frame_camera_buffer_, camera_buffer_, object_buffer_, tree_buffer_,
      descent_buffer_, node_buffers_[2], leaf_buffer_, open_buffer_;
  gl::GlBuffer triangle_buffer_, refinement_buffer_, part_buffers_[2], block_buffer_, found_buffer_,
      state_buffer_;
  gl::GlTimer descent_timer_, refine_timer_;
  std::size_t max_bytes_ = 0, tree_words_ = 0;
  std::vector<PlacedMap> maps_;
  Eigen::Vector3d origin_world_m_ = Eigen::Vector3d::Zero();
  std::vector<PlacedTree> placed_;
  std::vector<gl_contact::Object> objects_;
  std::vector<gl_contact::Node> roots_;
  std::size_t nodes_ = 0, leaves_ = 0, all_triangles_ = 0;
  int levels_ = 0;
};

}  // namespace fivepipe::collision
