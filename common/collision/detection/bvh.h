// Bounding volume hierarchy (BVH) of a mesh's triangles, in the object's frame. A rigid object
// builds it once; a deformed one refits it.
//
// Triangles are sorted along a space-filling curve (Morton 1966). A leaf holds 16 triangles and a
// node 16 boxes, the width of one SIMD vector. Coordinates are float, relative to the tree's
// origin. Boxes are rounded outward, so each contains its triangles.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/mesh.h"

namespace fivepipe::collision {

class Bvh {
 public:
  static constexpr int kArity = 16;
  // Up to kArity boxes: [axis][child], relative to the origin [m]. An absent child has a negative
  // half size.
  struct Boxes {
    alignas(64) std::array<std::array<float, kArity>, 3> center_m, half_m;
  };
  // Up to kArity triangles: [vertex][axis][triangle], relative to the origin [m]. The vertices of
  // an absent triangle are NaN.
  struct Leaf {
    alignas(64) std::array<std::array<std::array<float, kArity>, 3>, 3> vertices_m;
  };

  Bvh() = default;
  // Copies the mesh. Throws std::invalid_argument if a vertex is not finite or a triangle refers to
  // a vertex that does not exist.
  explicit Bvh(geometry::Mesh mesh);
  // Moves the vertices and keeps the order of the triangles. Throws std::invalid_argument, without
  // any change, if a vertex is not finite or the number of vertices differs.
  void refit(std::span<const Eigen::Vector3d> vertices_m);

  const geometry::Mesh& mesh() const { return mesh_; }
  // Origin of the tree's coordinates, in the object's frame.
  const Eigen::Vector3d& origin_m() const { return origin_m_; }
  // Radius of a ball about origin_m() that contains every triangle.
  double radius_m() const { return radius_m_; }

  int leaves() const { return int(leaves_.size()); }
  const Leaf& leaf(int i) const { return leaves_[std::size_t(i)]; }
  // The leaf's triangles, as indices into mesh().triangles.
  std::span<const std::uint32_t> triangles_of(int leaf) const;
  // Boxes i of level 0 bound the leaves 16 i to 16 i + 15; those of level n bound boxes 16 i to
  // 16 i + 15 of level n - 1. The last level has one node.
  int levels() const { return int(levels_.size()); }
  const Boxes& boxes(int level, int i) const { return levels_[std::size_t(level)][std::size_t(i)]; }
  bool empty() const { return leaves_.empty(); }
  // Identifies the contents within this process: trees with equal numbers have equal contents.
  // Each construction and refit assigns a new number; 0 is the empty tree.
  std::uint64_t content() const { return content_; }

 private:
  void fit();

  geometry::Mesh mesh_;
  Eigen::Vector3d origin_m_ = Eigen::Vector3d::Zero();
  double radius_m_ = 0;
  std::uint64_t content_ = 0;
  std::vector<std::uint32_t> order_;
  std::vector<Leaf> leaves_;
  std::vector<std::vector<Boxes>> levels_;
};

}  // namespace fivepipe::collision
