// A triangle that the GPU refines (gl_contact_shaders.h): what it is given of it, and from what it
// finds to points of the world, in double.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "common/collision/detection/cpu/triangle_walk.h"
#include "common/collision/detection/gl/gl_contact_shaders.h"

namespace fivepipe::collision {

struct GlContact {
  std::size_t object;
  std::uint32_t triangle;     // of the mesh
  bool solid;                 // all of it is in the hull
  Triangle vertices_world_m;  // in vertex_order()
  TriangleGrid grid;
  bool sampling;  // points are asked for, not the verdict alone

  bool too_large() const { return grid.units > kMaxUnits; }
  int sampled() const;  // the level whose parts are sampled together
  int rows() const;     // of samples in one of them
  int finest() const;   // the last level
};

// Appends the samples of a part that were found in it or can't be told; of one found beyond the
// samples' grid, its middle.
void add_points(const GlContact& contact, const gl_contact::Part& found,
                std::vector<Eigen::Vector3d>& points_world_m);
std::size_t count_points(const GlContact& contact, const gl_contact::Part& found);
std::array<Eigen::Vector3d, 3> corners_world_m(const GlContact& contact,
                                               const gl_contact::Part& part);

// The samples of all of the triangle.
void add_all_points(const GlContact& contact, std::vector<Eigen::Vector3d>& points_world_m);

}  // namespace fivepipe::collision
