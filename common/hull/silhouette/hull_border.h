// The point at which a ray enters the hull: the camera whose silhouette limits the hull there, and
// the tangent plane.
//
// If camera i limits the hull, the tangent plane contains the camera's centre and the silhouette's
// tangent l_i at the point's pixel. Its normal is the first three components of P_i^T l_i,
// normalised.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "common/hull/cpu/ray_walk.h"
#include "common/hull/query/hull_query.h"
#include "common/hull/silhouette/contour.h"

namespace fivepipe::hull {

// The entry of a ray into the hull, and the camera whose border it crosses there.
struct RayBorder {
  double t;         // ray parameter
  int camera = -1;  // index in CpuHull::cameras(); -1: the ray starts in the hull
  Kept kept = Kept::object;
};
// Returns the first border between near and far, at the same parameter as HullQuery::first_entry(),
// or nullopt. The caller clips near and far to the rule's box. `lines` are the ray's images in the
// order of CpuHull::cameras().
std::optional<RayBorder> first_border(const CpuHull& hull, std::span<const ImageLine> lines,
                                      double near, double far);

// Unit normal out of the hull, and its error (ContourFit::error_rad).
struct BorderNormal {
  Eigen::Vector3d normal_world;
  double error_rad;
};
// Returns the normal at a border with camera >= 0; `line` is the ray's image in that camera.
// Returns nullopt if the border's pixel is not finite or more than one pixel outside the image, or
// if no edge of the map is next to it.
std::optional<BorderNormal> normal_at(const CpuHull& hull, const RayBorder& border,
                                      const ImageLine& line);

// A camera whose border limits the hull at a point.
struct LimitingCamera {
  int camera;  // index in the silhouettes given to CpuHull::assign()
  Eigen::Vector3d normal_world;
  double error_rad;
  double distance_px;  // from the point's pixel to the border
};
// A point of the object's surface that is closer than this to a border may be on either side of the
// border in a binary map [px].
inline constexpr double kAtBorder_px = 1.0;

struct LimitingCameras {
  double t;  // parameter at which the ray enters the hull
  // First the camera whose border the ray crosses; then all others with a border within
  // kAtBorder_px, nearest first (the point is then on an edge or corner of the hull). At most
  // kMaxLimiting.
  std::vector<LimitingCamera> cameras;
};
inline constexpr std::size_t kMaxLimiting = 4;
// Returns the cameras at the first entry of the ray between near and far. Returns nullopt if there
// is no entry, the ray starts in the hull or enters it through the rule's box, or no edge of a map
// is found.
std::optional<LimitingCameras> limiting_cameras(const HullQuery& query, const geometry::Ray& ray,
                                                double near, double far);

// A plane that touches the hull. The hull is on the side normal . x <= offset_m.
struct TangentPlane {
  Eigen::Vector3d normal_world;  // unit, out of the hull
  double offset_m;
  double error_rad;  // ContourFit::error_rad
  // Extent of the silhouette from the contour along the inward normal, at most kMaxThickness_px.
  int thickness_px;
};
inline constexpr int kMaxThickness_px = 64;
inline constexpr std::size_t kMaxTangentPlanes = 8;
// Returns the planes that bound the hull near a point: for each camera whose border is at most
// reach_px from the point's pixel, the plane of the fitted contour's tangent there. They are smooth
// where the hull's surface has steps of a pixel: on a ball of 25 px 0.5 degrees and 0.1 px from the
// cones of the true silhouettes (median). At most the kMaxTangentPlanes nearest to the point.
std::vector<TangentPlane> tangent_planes(const HullQuery& query, const Eigen::Vector3d& p_world_m,
                                         int reach_px);
// Returns the point nearest to p that is on the hull's side of all planes, or nullopt if there is
// none.
std::optional<Eigen::Vector3d> nearest_in(std::span<const TangentPlane> planes,
                                          const Eigen::Vector3d& p_world_m);

}  // namespace fivepipe::hull
