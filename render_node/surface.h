// Prepares the triangles of a scene object for shading: corners with normals and pattern
// coordinates.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/config/scene.h"

namespace fivepipe::render {

// One corner of a triangle. The vertex buffer has this layout.
struct SurfaceCorner {
  Eigen::Vector3f p_object_m;
  Eigen::Vector3f normal;  // unit length, object frame, outward for counter-clockwise triangles
  // Coordinates in the surface at rest; they do not change when the surface deforms.
  Eigen::Vector2f pattern_m;
};

class Surface {
 public:
  explicit Surface(const config::SceneObject& object);

  std::size_t vertices() const { return rest_m_.size(); }
  std::size_t triangles() const { return triangles_.size(); }

  // Returns three corners per triangle in mesh order, of the mesh at rest or with its vertices
  // moved to vertices_m (x y z per vertex, object frame, finite, 3 * vertices() values). Two faces
  // share a smooth normal at their common vertex if the angle between them is at most kCrease_rad.
  std::vector<SurfaceCorner> corners() const;
  std::vector<SurfaceCorner> corners(std::span<const float> vertices_m) const;
  // Expands one value per vertex to one value per corner.
  std::vector<float> at_corners(std::span<const float> of_vertices) const;

 private:
  std::vector<SurfaceCorner> shaded(const std::vector<Eigen::Vector3f>& positions_m) const;

  std::vector<Eigen::Vector3f> rest_m_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<Eigen::Vector2f> pattern_m_;  // per corner
  // Vertex v belongs to the triangles faces_[faces_begin_[v] .. faces_begin_[v + 1]).
  std::vector<std::uint32_t> faces_begin_, faces_;
};

// 40 degrees: larger than the edges of a coarse sphere and of a curtain's folds, smaller than those
// of a box.
inline constexpr double kCrease_rad = 0.7;

}  // namespace fivepipe::render
