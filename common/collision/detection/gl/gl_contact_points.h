// A triangle that the GPU refines (gl_contact_buffers.h), and the conversion of the parts that the
// GPU finds to world points in double.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "common/collision/detection/cpu/triangle_walk.h"
#include "common/collision/detection/gl/gl_contact_buffers.h"

namespace fivepipe::collision {

struct GlContact {
  std::size_t object;
  std::uint32_t triangle;     // index into the mesh
  bool solid;                 // the whole triangle is in the hull
  Triangle vertices_world_m;  // in vertex_order()
  TriangleGrid grid;
  bool sampling;  // collision points are requested, not the verdict alone

  bool too_large() const { return grid.units > kMaxUnits; }
  // Level of the parts that are sampled together, rows of samples in such a part, and last level.
  int sampled() const;
  int rows() const;
  int finest() const;
};

// Appends the samples of a part that the GPU found to be in the hull or could not decide. Of a part
// below the sample grid it appends the center.
void add_points(const GlContact& contact, const gl_contact::Part& found,
                std::vector<Eigen::Vector3d>& points_world_m);
// Returns the number of points that add_points() appends.
std::size_t count_points(const GlContact& contact, const gl_contact::Part& found);
// Returns the corners of the part.
std::array<Eigen::Vector3d, 3> corners_world_m(const GlContact& contact,
                                               const gl_contact::Part& part);

// Appends all samples of the triangle.
void add_all_points(const GlContact& contact, std::vector<Eigen::Vector3d>& points_world_m);

}  // namespace fivepipe::collision
