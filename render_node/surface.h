// A scene object's triangles prepared for shading: corners with normals and pattern coordinates.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/config/scene.h"

namespace fivepipe::render {

// One corner of a triangle; the layout is the vertex buffer's.
struct SurfaceCorner {
  Eigen::Vector3f p_object_m;
  Eigen::Vector3f
      normal;  // unit, object frame, on the side from which the triangle is counter-clockwise
  Eigen::Vector2f pattern_m;  // lies in the surface and moves with it when it deforms
};

class Surface {
 public:
  explicit Surface(const config::SceneObject& object);

  std::size_t vertices() const { return rest_m_.size(); }
  std::size_t triangles() const { return triangles_.size(); }

  // Three corners per triangle, in the mesh's order, as modelled or with the mesh's vertices moved
  // to vertices_m (x y z each, object frame, finite, 3 * vertices() of them). Normals are smooth
  // over edges of less than kCrease_rad and broken at sharper ones.
  std::vector<SurfaceCorner> corners() const;
  std::vector<SurfaceCorner> corners(std::span<const float> vertices_m) const;
  // One value a vertex, as the corners need it.
  std::vector<float> at_corners(std::span<const float> of_vertices) const;

 private:
  std::vector<SurfaceCorner> shaded(const std::vector<Eigen::Vector3f>& positions_m) const;

  std::vector<Eigen::Vector3f> rest_m_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<Eigen::Vector2f> pattern_m_;  // per corner
  std::vector<std::uint32_t> faces_begin_,
      faces_;  // vertex v is shared by triangles faces_[faces_begin_[v] .. faces_begin_[v + 1])
};

inline constexpr double kCrease_rad =
    0.7;  // 40 degrees: above a coarse ball's and a curtain's folds, below a box's edges

}  // namespace fivepipe::render
