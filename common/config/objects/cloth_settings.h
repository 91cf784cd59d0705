// Settings of a scene object that moves as cloth.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

namespace fivepipe::config {

// Fixes the vertices that are in a box at the start.
struct ClothPin {
  Eigen::AlignedBox3d box_m;  // object frame; its faces belong to it
  // Direction along which the vertices may slide, object frame, of any length; absent: none.
  std::optional<Eigen::Vector3d> slides_along = {};
};

struct ClothSettings {
  double density_kg_m2 = 0.2;  // of a light curtain
  // Compliances are the inverse of stiffness, 0 is rigid. In-plane energy per area is
  // strain^2 / (2 compliance); bending energy per area is curvature^2 / (2 compliance).
  double stretch_compliance_m_n = 1e-5;
  // Instead of stretch_compliance_m_n along a compressed fibre. Wrinkles that are finer than the
  // mesh make a cloth soft: a strip of length l buckles at pi^2 / (l^2 bending compliance), which
  // is 0.23 N/m for 5 cm and the defaults.
  double compression_compliance_m_n = 1.0;
  double shear_compliance_m_n = 1e-3;
  double bending_compliance_1_nm = 1.7e4;
  // The stress of a strain rate is this time times the rate times the stiffness.
  double damping_s = 1e-3;
  // Deceleration of every vertex by air, divided by its velocity.
  double air_drag_1_s = 1.0;
  // Distance that the cloth keeps from the hull, with self_collision from itself, and with
  // object_collision from rigid objects.
  double thickness_m = 0.002;
  // Coulomb coefficient against rigid objects and the hull, which is at rest if the scene has no
  // history.
  double friction = 0.3;
  bool self_collision = false;
  bool object_collision = false;  // whether the scene's rigid objects stop the vertices
  // Direction in which vertices leave the hull, world frame, of any length (paper, section 4.5).
  // Absent: the triangles' normals.
  std::optional<Eigen::Vector3d> v_rec_world = {};
  std::vector<ClothPin> pins = {};
};

// A second of the paper's curtain of 720 triangles takes 0.24 s of one core, and the time grows
// with their number: a larger cloth would stop the simulation for minutes.
inline constexpr std::size_t kMaxClothTriangles = 100'000;
// A triangle whose height is a smaller fraction of its longest side has no usable normal.
inline constexpr double kMinClothShape = 1e-6;

}  // namespace fivepipe::config
