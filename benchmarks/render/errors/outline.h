// Outlines of drawn hulls and of true objects, and the distances between them.
#pragma once
#include <span>
#include <vector>

#include "benchmarks/render/errors/avatar.h"

namespace fivepipe::render_bench {

struct OutlinePoint {
  Eigen::Vector2d at_px;
  double depth_m;   // of the object or hull beside the outline
  bool is_counted;  // the other points only make the outline denser
};

// What an image shows: an outline, and the centre of its area.
struct ShownShape {
  std::vector<OutlinePoint> outline;
  Eigen::Vector2d centroid_px;
  // Harmonic mean over the outline: a motion by d moves the outline by d f / depth on average.
  double depth_m;
};

// Of a drawn hull: its outline runs along pixel edges. Edges of the image are none.
// Throws std::runtime_error if the image shows no hull.
ShownShape shape_of(const Drawn& drawn);
// Of a true object in the image of a camera, exact to a thousandth of a pixel. Throws
// std::runtime_error if the image does not show it.
ShownShape true_shape(std::span<const hull::Capsule> object, const geometry::Camera& camera);

// Lateral distances in the view at the object's depth [mm]: from each counted point of the outlines
// to the other outline, in both directions. The two shapes are seen by cameras with focal_px.
std::vector<double> outline_distances_mm(const ShownShape& a, const ShownShape& b, double focal_px);
double centroid_distance_mm(const ShownShape& a, const ShownShape& b, double focal_px);

}  // namespace fivepipe::render_bench
