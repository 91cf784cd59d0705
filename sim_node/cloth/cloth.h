// The motion of a cloth by extended position-based dynamics (Macklin et al., "XPBD", 2016) in small
// substeps of one iteration each (Macklin et al., "Small Steps in Physics Simulation", 2019).
//
// The hull moves the cloth through contacts. A contact places a point of the cloth; the part of the
// motion that only corrects a penetration carries no velocity. The velocity towards the hull,
// relative to that of its surface, is then removed, and Coulomb friction acts on the velocity along
// it.
#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "sim_node/cloth/cloth_model.h"

namespace fivepipe::sim {

// A point of the cloth that must be on the outer side of a plane: normal . p >= offset_m.
struct ClothContact {
  std::uint32_t triangle;        // index in the mesh
  Eigen::Vector3d weights;       // barycentric: the point is the weighted sum of the corners
  Eigen::Vector3d normal_world;  // unit
  double offset_m;
  Eigen::Vector3d velocity_world_m_s = Eigen::Vector3d::Zero();  // of the hull's surface
};

// A vertex that must be at least distance_m from a point of a triangle, along the normal.
struct ClothSelfTouch {
  std::uint32_t vertex, triangle;  // indices in the mesh
  Eigen::Vector3d weights;         // barycentric, of the triangle's point
  Eigen::Vector3d normal_world;    // unit, towards the vertex's side
  double distance_m;
};

// A vertex that must move by missing_m along the normal, out of an object.
struct ClothVertexContact {
  std::uint32_t vertex;                // index in the mesh
  Eigen::Vector3d normal_world;        // unit
  double missing_m;                    // > 0
  Eigen::Vector3d slid_world_m;        // by the vertex in the step, relative to the surface
  Eigen::Vector3d velocity_world_m_s;  // of the object's surface
};

// Deterministic: the same calls give the same bits.
class Cloth {
 public:
  // `mesh` gives the triangles to which contacts refer; the arguments are those of cloth_model().
  Cloth(const geometry::Mesh& mesh, const Eigen::Isometry3d& world_from_object,
        const config::ClothSettings& settings);

  // Advances by step_s > 0 in equal substeps of at most kMaxClothSubstep_s. By the end of the step
  // the contacts' points have moved `share` (0 to 1) of the way to their planes, at constant speed.
  // A vertex faster than max_speed_m_s is slowed to it.
  void step(double step_s, const Eigen::Vector3d& gravity_world_m_s2,
            std::span<const ClothContact> contacts, double share, double max_speed_m_s);
  // Moves the contacts' points to their planes at once, without velocity. Returns whether any
  // moved: none does if their corners are fixed.
  bool project(std::span<const ClothContact> contacts);
  // Moves each vertex and triangle apart at once, one pair after the other, without velocity, and
  // removes the velocity with which they approach. Returns the largest distance that was missing.
  double separate(std::span<const ClothSelfTouch> touches);
  // Moves the vertex out at once, without velocity, and removes its velocity towards the object.
  // Coulomb friction reduces its way and its velocity along the object.
  void stop(const ClothVertexContact& contact);
  // Returns to the start, at rest.
  void reset();

  // One per vertex of the mesh; valid until the next step(), project() or reset().
  const std::vector<Eigen::Vector3d>& vertices_world_m() const { return p_; }
  const std::vector<Eigen::Vector3d>& velocities_world_m_s() const { return v_; }
  const ClothModel& model() const { return model_; }

 private:
  struct Placed {  // a contact during a step
    const ClothContact* contact;
    double start_m;  // normal . p at the start of the step
    bool touches;    // the last place() moved the point
  };
  void substep(double substep_s, const Eigen::Vector3d& gravity_world_m_s2,
               std::span<Placed> contacts, double progress, double max_speed_m_s);
  void project_triangle(const ClothTriangle& triangle, double substep_s);
  void project_hinge(const ClothHinge& hinge, double substep_s);
  void project_tether(const ClothTether& tether, double longest_m);
  // Projects a constraint whose energy is value^2 / (2 compliance) by one XPBD iteration.
  template <std::size_t N>
  void project(const std::array<std::uint32_t, N>& vertices,
               const std::array<Eigen::Vector3d, N>& gradient, double value, double compliance,
               double substep_s);
  // Moves the contact's point to normal . p >= offset_m without velocity, unless its corners are
  // fixed; returns whether it moved.
  bool place(const ClothContact& contact, double offset_m);
  // A weighted sum of vertices: a point of the cloth, or the offset between two points.
  template <std::size_t N>
  struct Sum {
    std::array<std::uint32_t, N> vertices;
    std::array<double, N> weights;
    Eigen::Vector3d of(const std::vector<Eigen::Vector3d>& vectors) const;
  };
  Sum<3> point(const ClothContact& contact) const;
  Sum<4> offset(const ClothSelfTouch& touch) const;  // from the triangle's point to the vertex
  // Changes the sum of the positions (or velocities) by `change` along a unit direction,
  // distributed over the vertices by their masses. Returns false if no vertex can follow.
  template <std::size_t N>
  bool push(const Sum<N>& sum, const Eigen::Vector3d& direction, double change,
            std::span<std::vector<Eigen::Vector3d>* const> of);
  // Removes the sum's velocity towards a surface of this velocity, and by friction that along it.
  template <std::size_t N>
  void slow(const Sum<N>& sum, const Eigen::Vector3d& normal, const Eigen::Vector3d& surface_m_s);

  config::ClothSettings settings_;
  ClothModel model_;
  std::vector<std::array<std::uint32_t, 3>> mesh_triangles_;
  std::vector<Eigen::Vector3d> p_, before_, v_;
};

// Short enough that a substep's free fall, 0.01 mm, is below the resolution of any map.
inline constexpr double kMaxClothSubstep_s = 1.0 / 960;

}  // namespace fivepipe::sim
