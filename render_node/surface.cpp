#include "render_node/surface.h"

#include <cmath>

namespace fivepipe::render {
namespace {

// A vertex of more triangles (the hub of a fan) is shaded flat, because the work per vertex grows
// with the square of their number.
constexpr std::uint32_t kMaxSmoothFaces = 64;

// Returns the two object axes of the pattern coordinates: x and z for a curtain, otherwise the two
// axes other than the one nearest to the face normal.
std::array<int, 2> pattern_axes(const config::Shape& shape, const Eigen::Vector3f& face_normal) {
  int across = 1;
  if (!std::holds_alternative<config::CurtainShape>(shape))
    face_normal.cwiseAbs().maxCoeff(&across);
  return {across == 0 ? 1 : 0, across == 2 ? 1 : 2};
}

// Returns the normal of the triangle with the length of twice its area; zero if it is degenerate.
Eigen::Vector3f area_normal(const std::vector<Eigen::Vector3f>& p,
                            const std::array<std::uint32_t, 3>& t) {
  return (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]);
}

}  // namespace

Surface::Surface(const config::SceneObject& object) {
  const geometry::Mesh mesh = config::mesh_of(object);
  for (const Eigen::Vector3d& v : mesh.vertices_m) rest_m_.push_back(v.cast<float>());
  triangles_ = mesh.triangles;
  faces_begin_.assign(rest_m_.size() + 1, 0);
  for (const auto& triangle : triangles_) {
    const auto [a, b] = pattern_axes(object.shape, area_normal(rest_m_, triangle));
    for (const std::uint32_t v : triangle) {
      pattern_m_.emplace_back(rest_m_[v][a], rest_m_[v][b]);
      ++faces_begin_[v + 1];
    }
  }
  for (std::size_t v = 0; v < rest_m_.size(); ++v) faces_begin_[v + 1] += faces_begin_[v];
  faces_.resize(3 * triangles_.size());
  std::vector<std::uint32_t> next(faces_begin_.begin(), faces_begin_.end() - 1);
  for (std::uint32_t t = 0; t < triangles_.size(); ++t)
    for (const std::uint32_t v : triangles_[t]) faces_[next[v]++] = t;
}

std::vector<SurfaceCorner> Surface::corners() const { return shaded(rest_m_); }

std::vector<SurfaceCorner> Surface::corners(std::span<const float> vertices_m) const {
  std::vector<Eigen::Vector3f> positions_m(rest_m_.size());
  for (std::size_t v = 0; v < positions_m.size(); ++v)
    positions_m[v] =
        Eigen::Vector3f(vertices_m[3 * v], vertices_m[3 * v + 1], vertices_m[3 * v + 2]);
  return shaded(positions_m);
}

std::vector<float> Surface::at_corners(std::span<const float> of_vertices) const {
  std::vector<float> values;
  values.reserve(3 * triangles_.size());
  for (const auto& triangle : triangles_)
    for (const std::uint32_t v : triangle) values.push_back(of_vertices[v]);
  return values;
}

std::vector<SurfaceCorner> Surface::shaded(const std::vector<Eigen::Vector3f>& positions_m) const {
  static const float smallest_cosine = float(std::cos(kCrease_rad));
  std::vector<Eigen::Vector3f> area_normals, units;  // of the triangles
  for (const auto& triangle : triangles_) {
    area_normals.push_back(area_normal(positions_m, triangle));
    const float length = area_normals.back().norm();
    // A degenerate triangle covers no pixel, so any unit normal is valid.
    units.push_back(length > 0 ? Eigen::Vector3f(area_normals.back() / length)
                               : Eigen::Vector3f::UnitZ());
  }
  std::vector<SurfaceCorner> corners;
  corners.reserve(3 * triangles_.size());
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t v = triangles_[t][corner];
      Eigen::Vector3f sum = area_normals[t];
      if (faces_begin_[v + 1] - faces_begin_[v] <= kMaxSmoothFaces)
        for (std::uint32_t i = faces_begin_[v]; i < faces_begin_[v + 1]; ++i)
          if (faces_[i] != t && units[faces_[i]].dot(units[t]) >= smallest_cosine)
            sum += area_normals[faces_[i]];
      const float length = sum.norm();
      corners.push_back({positions_m[v], length > 0 ? Eigen::Vector3f(sum / length) : units[t],
                         pattern_m_[3 * t + std::size_t(corner)]});
    }
  return corners;
}

}  // namespace fivepipe::render
