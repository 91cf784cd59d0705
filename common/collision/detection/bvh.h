// A tree of boxes over a mesh's triangles, in the object's frame: built once for a rigid object,
// refitted where it deforms.
//
// Triangles in the order of a space-filling curve (Morton, 1966), sixteen a leaf, sixteen boxes a
// node: what one vector of lanes looks at. Numbers are float, from the tree's origin; boxes are
// rounded outward, so that they hold their triangles.
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
  struct Boxes {  // of up to kArity children, side by side; those that are not there have a
                  // negative half size
    alignas(64) std::array<std::array<float, kArity>, 3> center_m, half_m;
  };
  struct Leaf {  // kArity triangles: [vertex][axis][triangle]; those that are not there are NaN
    alignas(64) std::array<std::array<std::array<float, kArity>, 3>, 3> vertices_m;
  };

  Bvh() = default;
  // Copies the mesh. Throws std::invalid_argument where a vertex is not finite or a triangle names
  // a vertex that is not there.
  explicit Bvh(geometry::Mesh mesh);
  // New places for the same vertices; the order of triangles stays. Throws as above, and where
  // their number differs.
  void refit(std::span<const Eigen::Vector3d> vertices_m);

  const geometry::Mesh& mesh() const { return mesh_; }
  const Eigen::Vector3d& origin_m() const { return origin_m_; }
  double radius_m() const { return radius_m_; }  // of a ball about the origin that holds all

  int leaves() const { return int(leaves_.size()); }
  const Leaf& leaf(int i) const { return leaves_[std::size_t(i)]; }
  // The leaf's triangles, by number in the mesh.
  std::span<const std::uint32_t> triangles_of(int leaf) const;
  // Level 0: boxes of leaves 16 i ... 16 i + 15; level n: of what boxes(n - 1, 16 i ...) hold
  // together. The last level has one.
  int levels() const { return int(levels_.size()); }
  const Boxes& boxes(int level, int i) const { return levels_[std::size_t(level)][std::size_t(i)]; }
  bool empty() const { return leaves_.empty(); }
  // Equal numbers, equal contents: anew with every construction and refit, in this process. 0:
  // empty.
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
