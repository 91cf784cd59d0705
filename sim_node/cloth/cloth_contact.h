// Contact of a cloth with the hull: which points of the cloth are in the hull, and where each
// leaves it (paper, section 4.5).
//
// The tested surface is the cloth, shifted towards the hull by its thickness. A cloth that rests on
// the hull therefore stays in contact.
//
// A point leaves the hull along V_rec of the scene. Without one it leaves along the normal of its
// triangle, on the side where the hull ends sooner, and the triangle keeps its side while it stays
// in contact.
#pragma once
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "common/collision/detection/bvh.h"
#include "sim_node/cloth/cloth.h"
#include "sim_node/hull/current_hull.h"

namespace fivepipe::sim {

class ClothHullContact {
 public:
  // The arguments are those of Cloth.
  ClothHullContact(const geometry::Mesh& mesh, const config::ClothSettings& settings);

  // Returns the contacts of the cloth's present shape with the hull, by part and ascending
  // triangle. Each has the offset at which its point has left the hull. A part has its place at
  // before_s before the newest frame, the end of a step of step_s; its contacts have its velocity
  // in the middle of that step (hull_part.h). Requires hull.query(). Invalidates the results of
  // hull.detect().
  std::vector<ClothContact> find(const Cloth& cloth, CurrentHull& hull, double step_s,
                                 double before_s);
  // Forgets the sides of triangles that had no contact for kSideSteps steps. Call once per step.
  void forget_idle_sides();
  // Distance by which the deepest point of the last find() has to move [m]; 0 without contacts.
  double deepest_m() const { return deepest_m_; }
  // Number of triangles in contact in the last find(); one in contact with two parts counts twice.
  std::size_t triangles() const { return triangles_; }
  // Forgets the triangles' sides.
  void reset();
  // Number of collision points without an exit within kMaxClothExit_m since the previous call.
  std::uint64_t take_without_exit() { return std::exchange(without_exit_, 0); }

 private:
  void shift(const Cloth& cloth);
  void find(const Cloth& cloth, CurrentHull& hull, const HullPart& part, double step_s,
            double before_s, std::vector<ClothContact>& contacts);
  // Returns nullopt if the triangle has no normal, or if the hull ends on neither side. The point
  // is that in the newest frame's hull; the direction is the present one.
  std::optional<Eigen::Vector3d> direction(std::uint32_t triangle, const Cloth& cloth,
                                           const Eigen::Vector3d& p_newest_m,
                                           const Eigen::Matrix3d& newest_from_now,
                                           const hull::HullQuery& query);

  config::ClothSettings settings_;
  collision::Bvh tree_;  // of the shifted cloth, in the world frame
  std::vector<Eigen::Vector3d> shifted_world_m_;
  // The side on which a triangle leaves the hull without V_rec: +1 along its normal, -1 against it,
  // 0: not in contact. It is kept for kSideSteps without contact.
  struct Side {
    std::int8_t sign = 0;
    std::uint8_t steps_without_contact = 0;
  };
  std::vector<Side> sides_;  // by triangle
  double deepest_m_ = 0;
  std::size_t triangles_ = 0;
  std::uint64_t without_exit_ = 0;
};

// A triangle keeps its side over a frame without contact: the steps of 1/240 s of a frame at 15 Hz.
inline constexpr int kSideSteps = 16;
// The hull may be this thick along V_rec: more than a forearm and less than a body.
inline constexpr double kMaxClothExit_m = 0.3;

}  // namespace fivepipe::sim
