#include "benchmarks/collision/shapes.h"

#include <cmath>
#include <numbers>
#include <random>

namespace fivepipe::collision_bench {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

Isometry3d turned(const Isometry3d& pose, double angle_rad, const Vector3d& axis) {
  return pose * Eigen::AngleAxisd(angle_rad, axis);
}
constexpr double kQuarter_rad = std::numbers::pi / 2;

void append_box(geometry::Mesh& assembly, const Vector3d& min_m, const Vector3d& max_m) {
  append(assembly, geometry::box_mesh(max_m - min_m),
         Isometry3d(Eigen::Translation3d(0.5 * (min_m + max_m))));
}

// Extrudes a convex or L-shaped, counter-clockwise outline along z, centered. The caps are fans
// from the outline's first corner.
geometry::Mesh prism(const std::vector<Eigen::Vector2d>& outline_m, double length_m) {
  geometry::Mesh mesh;
  const std::uint32_t n = std::uint32_t(outline_m.size());
  for (const double z_m : {-0.5 * length_m, 0.5 * length_m})
    for (const auto& corner : outline_m) mesh.vertices_m.emplace_back(corner.x(), corner.y(), z_m);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.triangles.push_back({i, j, n + j});
    mesh.triangles.push_back({i, n + j, n + i});
    if (i >= 1 && i + 1 < n) {
      mesh.triangles.push_back({0, j, i});
      mesh.triangles.push_back({n, n + i, n + j});
    }
  }
  return mesh;
}

void append_optics(geometry::Mesh& payload) {
  append(payload, tube_mesh(0.09, 0.083, 0.26, 300), at(-0.08, 0.02, 0.30));  // telescope
  append(payload, tube_mesh(0.098, 0.083, 0.02, 300), at(-0.08, 0.02, 0.43));
  append(payload, geometry::sphere_mesh(0.055, 4), at(-0.08, 0.02, 0.25));
  append(payload, tube_mesh(0.035, 0.031, 0.18, 150),
         turned(at(0.12, 0.05, 0.17), kQuarter_rad, Vector3d::UnitX()));  // photomultiplier tubes
  append(payload, tube_mesh(0.035, 0.031, 0.18, 150),
         turned(at(0.20, 0.05, 0.17), kQuarter_rad, Vector3d::UnitX()));
  for (const double x_m : {0.12, 0.20})
    append(payload, geometry::sphere_mesh(0.031, 3), at(x_m, -0.04, 0.17));
}

void append_frame(geometry::Mesh& payload) {
  append_box(payload, {-0.25, -0.2, 0}, {0.25, 0.2, 0.012});
  append_box(payload, {0.06, -0.04, 0.10}, {0.25, 0.15, 0.11});
  append_box(payload, {0.06, 0.15, 0.012}, {0.25, 0.158, 0.26});
  append_box(payload, {-0.25, 0.19, 0.012}, {0.05, 0.198, 0.30});
  for (const double x_m : {-0.24, -0.12, 0.0, 0.12, 0.24})
    for (const double y_m : {-0.185, 0.175})
      append(payload, bracket_mesh(0.03, 0.003, 0.05), at(x_m, y_m, 0.037));
  for (int i = 0; i < 8; ++i) {  // harness along the base plate
    append(payload, tube_mesh(0.004, 0, 0.4, 24),
           turned(at(0, -0.14 + 0.011 * i, 0.02), kQuarter_rad, Vector3d::UnitY()));
    append(payload, tube_mesh(0.007, 0.004, 0.01, 32),
           turned(at(-0.15 + 0.04 * i, -0.14 + 0.011 * i, 0.02), kQuarter_rad, Vector3d::UnitY()));
  }
}

}  // namespace

geometry::Mesh tube_mesh(double radius_m, double inner_radius_m, double length_m, int sides) {
  std::vector<Eigen::Vector2d> circle;
  for (int i = 0; i < sides; ++i)
    circle.emplace_back(std::cos(2 * std::numbers::pi * i / sides),
                        std::sin(2 * std::numbers::pi * i / sides));
  if (!(inner_radius_m > 0)) {
    for (auto& corner : circle) corner *= radius_m;
    return prism(circle, length_m);
  }
  geometry::Mesh mesh;  // four rings: outer bottom, outer top, inner top, inner bottom
  const double radii_m[] = {radius_m, radius_m, inner_radius_m, inner_radius_m},
               ends[] = {-0.5, 0.5, 0.5, -0.5};
  for (int ring = 0; ring < 4; ++ring)
    for (const auto& corner : circle)
      mesh.vertices_m.emplace_back(radii_m[ring] * corner.x(), radii_m[ring] * corner.y(),
                                   ends[ring] * length_m);
  const auto vertex = [&](int ring, int side) {
    return std::uint32_t(ring % 4 * sides + side % sides);
  };
  for (int ring = 0; ring < 4; ++ring)
    for (int side = 0; side < sides; ++side) {
      mesh.triangles.push_back(
          {vertex(ring, side), vertex(ring, side + 1), vertex(ring + 1, side + 1)});
      mesh.triangles.push_back(
          {vertex(ring, side), vertex(ring + 1, side + 1), vertex(ring + 1, side)});
    }
  return mesh;
}

geometry::Mesh bracket_mesh(double leg_m, double thickness_m, double length_m) {
  // The first corner is the inner one; a fan from it stays inside the L.
  return prism({{thickness_m, thickness_m},
                {thickness_m, leg_m},
                {0, leg_m},
                {0, 0},
                {leg_m, 0},
                {leg_m, thickness_m}},
               length_m);
}

void append(geometry::Mesh& assembly, const geometry::Mesh& part,
            const Isometry3d& assembly_from_part) {
  const std::uint32_t first = std::uint32_t(assembly.vertices_m.size());
  for (const Vector3d& v : part.vertices_m) assembly.vertices_m.push_back(assembly_from_part * v);
  for (const auto& [a, b, c] : part.triangles)
    assembly.triangles.push_back({first + a, first + b, first + c});
}

geometry::Mesh chair_mesh() {
  geometry::Mesh chair;
  append_box(chair, {-0.22, -0.22, 0.41}, {0.22, 0.22, 0.45});
  append_box(chair, {-0.22, 0.19, 0.45}, {0.22, 0.22, 0.90});
  for (const double x_m : {-0.22, 0.18})
    for (const double y_m : {-0.22, 0.18})
      append_box(chair, {x_m, y_m, 0}, {x_m + 0.04, y_m + 0.04, 0.41});
  return chair;
}

geometry::Mesh table_mesh(double width_m, double depth_m, double height_m) {
  geometry::Mesh table;
  const double w = 0.5 * width_m, d = 0.5 * depth_m, leg_m = 0.05, top_m = 0.03;
  append_box(table, {-w, -d, height_m - top_m}, {w, d, height_m});
  for (const double x_m : {-w, w - leg_m})
    for (const double y_m : {-d, d - leg_m})
      append_box(table, {x_m, y_m, 0}, {x_m + leg_m, y_m + leg_m, height_m - top_m});
  return table;
}

geometry::Mesh payload_mesh(std::size_t triangles) {
  geometry::Mesh payload;
  append_frame(payload);
  append_optics(payload);
  const geometry::Mesh bolt = tube_mesh(0.003, 0, 0.008, 12);
  // The engine returns the same numbers everywhere; the standard distributions do not.
  std::mt19937 random(4);
  const auto between = [&](double low, double high) {
    return low + (high - low) * double(random()) / double(std::mt19937::max());
  };
  while (payload.triangles.size() < triangles) {
    const bool on_base = payload.triangles.size() % 3 != 0;
    if (on_base)
      append(payload, bolt, at(between(-0.24, 0.24), between(-0.19, 0.19), 0.016));
    else
      append(payload, bolt,
             turned(at(between(-0.24, 0.24), between(-0.02, 0.15), between(0.11, 0.26)),
                    kQuarter_rad, Vector3d::UnitX()));
  }
  return payload;
}

}  // namespace fivepipe::collision_bench
