// The shapes by which the overlays show collision results, and their colours.
//
//   CP_i      white disc               proximity  disc on the vertex or at the triangle's centroid:
//   recovery  arrow CP_obj to CP_hull,            red at the hull, yellow at half of the cap, blue
//             disc at CP_hull: green,             at the cap; none beyond
//             or orange if the object  N_hull     arrow from CP_hull, kNormalLength_m long: cyan
//             still collides                      (closed form) or magenta (four points)
#pragma once
#include <span>

#include "render_node/overlays/collision_marks.h"

namespace fivepipe::render {

// Colours are sRGB, 0 to 1.
struct Disc {
  Eigen::Vector3f p_world_m;
  Eigen::Vector3f rgb;
};
struct Arrow {
  Eigen::Vector3d from_world_m, to_world_m;
  Eigen::Vector3f rgb;
};

// In the order in which they are drawn.
struct OverlayShapes {
  std::vector<Disc> proximity, points, ends;
  std::vector<Arrow> arrows;
};

// Long enough to show its direction, and shorter than a hand.
inline constexpr double kNormalLength_m = 0.05;

// Adds the marks of one object. places_world_m: the place of each value of marks.proximity; unused
// without proximity.
void add_shapes(const CollisionMarks& marks, std::span<const Eigen::Vector3f> places_world_m,
                OverlayShapes& shapes);

// Returns the places of the object's proximity values in the world. vertices_m: the current
// vertices of object.mesh, in the object frame.
std::vector<Eigen::Vector3f> proximity_places_world_m(const OverlaidObject& object,
                                                      std::span<const Eigen::Vector3d> vertices_m,
                                                      const Eigen::Isometry3d& world_from_object);

// Returns the colour of a distance, which is a fraction of the cap, 0 to 1.
Eigen::Vector3f proximity_rgb(float distance);

}  // namespace fivepipe::render
