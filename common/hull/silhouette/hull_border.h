// Where a ray comes into the hull: which camera's silhouette ends the hull there, and the plane it
// ends in.
//
// Where camera i limits, the tangent plane is spanned by its centre and the silhouette's tangent
// l_i at the point's pixel: its normal is the first three components of P_i^T l_i, normalised
// (design, "Response").
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "common/hull/cpu/ray_walk.h"
#include "common/hull/query/hull_query.h"
#include "common/hull/silhouette/contour.h"

namespace fivepipe::hull {

// Where a ray enters the hull, and through whose border.
struct RayBorder {
  double t;         // ray parameter
  int camera = -1;  // of CpuHull::cameras(); none where the ray starts in the hull
  Kept kept = Kept::object;
};
// `lines` are the images of the ray, as CpuHull::cameras(). Finds the very parameter of
// HullQuery::first_entry.
std::optional<RayBorder> first_border(const CpuHull& hull, std::span<const ImageLine> lines,
                                      double near, double far);

// Unit, out of the hull, and its error as contour.h has it.
struct BorderNormal {
  Eigen::Vector3d normal_world;
  double error_rad;
};
// At a border that a ray comes in through. Nothing where there is no edge of the map near it, or it
// is not finite.
std::optional<BorderNormal> normal_at(const CpuHull& hull, const RayBorder& border,
                                      const ImageLine& line);

// A camera whose border ends the hull at a point.
struct LimitingCamera {
  int camera;  // index in the silhouettes as given
  Eigen::Vector3d normal_world;
  double error_rad;
  double distance_px;  // from the point's pixel to the border
};
// Closer than this to a border [px], a binary map does not tell on which side of it a point of the
// object's surface is.
inline constexpr double kAtBorder_px = 1.0;

struct LimitingCameras {
  double t;  // where the ray enters the hull
  // First the one whose border the ray crosses there; then all others whose border is within
  // kAtBorder_px, nearest first: an edge of the hull, or a corner. At most kMaxLimiting.
  std::vector<LimitingCamera> cameras;
};
inline constexpr std::size_t kMaxLimiting = 4;
// At the first entry of the ray between near and far; nothing where there is none, it starts in the
// hull, or no edge is found.
std::optional<LimitingCameras> limiting_cameras(const HullQuery& query, const geometry::Ray& ray,
                                                double near, double far);

}  // namespace fivepipe::hull
