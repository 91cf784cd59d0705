// The parts of a cloth that a simulation does not change: masses, pins, and the constraints of
// extended position-based dynamics (XPBD), made from a triangle mesh at rest.
//
//   stretch  per triangle and fibre direction, weft u and warp v: |F_u| = 1, |F_v| = 1
//   shear    per triangle: F_u . F_v = 0
//            F is the deformation gradient in the fibres' frame (Baraff and Witkin, "Large Steps in
//            Cloth Simulation", 1998, section 4.2).
//   bending  per edge with two triangles: 2 sin(theta / 2) keeps its value at rest; theta is the
//            angle between the triangles' normals (Grinspun et al., "Discrete Shells", 2003). The
//            stiffness |edge|^2 / area of both triangles gives a cylinder the energy of a plate.
//   tether   per free vertex: not farther from its nearest pin than along the mesh at rest (Kim,
//            Chentanez and Mueller, "Long Range Attachments", 2012). Carries the weight of a
//            hanging cloth without many iterations.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/config/objects/cloth_settings.h"
#include "common/geometry/mesh.h"

namespace fivepipe::sim {

struct ClothTriangle {
  std::array<std::uint32_t, 3> vertices;
  double area_m2;
  // (p1 - p0, p2 - p0) times this is (F_u, F_v) [1/m].
  Eigen::Matrix2d fibres_from_edges;
};

struct ClothHinge {
  // The edge's vertices, then the opposite ones of its two triangles.
  std::array<std::uint32_t, 4> vertices;
  double rest_bend;  // 2 sin(theta / 2)
  double shape;      // area of both triangles / |edge|^2
};

struct ClothTether {
  std::uint32_t vertex, pin;
  double length_m;
};

// How a vertex may move.
struct ClothVertex {
  double inverse_mass_1_kg = 0;  // 0: fixed in place
  // Unit direction along which alone the vertex moves; zero: every direction.
  Eigen::Vector3d slides_along_world = Eigen::Vector3d::Zero();
};

struct ClothModel {
  std::vector<Eigen::Vector3d> start_world_m;
  std::vector<ClothVertex> vertices;
  // Sorted from the pins outward. The solver projects them in this order.
  std::vector<ClothTriangle> triangles;
  std::vector<ClothHinge> hinges;
  std::vector<ClothTether> tethers;
  double longest_tether_m = 0;
};

// Makes the model of a mesh at rest, in its object's frame. Fibres run along the longest axis of
// the mesh's box; in a triangle that is steep against it, along the next longest one. Throws
// std::invalid_argument if a triangle has no area or a pin's box contains no vertex (read_scene()
// reports both).
ClothModel cloth_model(const geometry::Mesh& mesh, const Eigen::Isometry3d& world_from_object,
                       const config::ClothSettings& settings);

// The value 2 sin(theta / 2) of a hinge and its derivative by each vertex. Positive if the normals
// turn about the edge by the right-hand rule.
struct Bend {
  double value;
  std::array<Eigen::Vector3d, 4> gradient_1_m;
};
// `p` are the positions of ClothHinge::vertices [m]. Returns nullopt if a triangle has no area.
std::optional<Bend> bend(const std::array<Eigen::Vector3d, 4>& p_m);

}  // namespace fivepipe::sim
