// Contact of a cloth with itself: vertices with triangles. After each step, a vertex that has
// passed through a triangle returns to its side, and one that is nearer to a triangle than the
// thickness, and nearer than at the start, leaves it. Two edges can pass through each other, so a
// cloth that folds needs triangles that are smaller than its folds.
//
// The paths are those of Bridson, Fedkiw and Anderson, "Robust Treatment of Collisions, Contact and
// Friction for Cloth Animation", 2002, section 6; the response is that of Cloth::separate().
#pragma once
#include <vector>

#include "common/collision/detection/bvh.h"
#include "sim_node/cloth/cloth.h"

namespace fivepipe::sim {

class ClothSelfContact {
 public:
  // start_world_m: by vertex of the mesh. The cloth is at its start.
  ClothSelfContact(const geometry::Mesh& mesh, std::vector<Eigen::Vector3d> start_world_m,
                   double thickness_m);

  // Separates the vertices and triangles of the cloth. Call after each step. Returns the number of
  // contacts that it found.
  std::uint64_t separate(Cloth& cloth);
  void reset() { separated_world_m_ = start_world_m_; }  // the cloth is at its start again

 private:
  std::vector<ClothSelfTouch> find(const Cloth& cloth);
  // Appends the contacts of one vertex. moved_m: the longest move of a vertex since the
  // last separate().
  void find(std::uint32_t vertex, const Cloth& cloth, double moved_m,
            std::vector<ClothSelfTouch>& touches) const;
  // The distance that a vertex keeps from a triangle.
  double kept_m(std::uint32_t vertex, std::uint32_t triangle) const;

  collision::Bvh tree_;  // world frame
  std::vector<Eigen::Vector3d> start_world_m_;
  // By vertex, at the end of the last separate(). Paths begin there, so that a vertex also returns
  // to its side if the hull has pushed it through a triangle since.
  std::vector<Eigen::Vector3d> separated_world_m_;
  double thickness_m_;
};

// A contact may push a vertex into another one; the rest of the penetration waits for the next
// step.
inline constexpr int kMaxSelfSeparations = 4;

}  // namespace fivepipe::sim
