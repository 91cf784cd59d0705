// The hull's surface as a view sees it: the camera whose silhouette limits the hull at each pixel,
// and the surface normal (hull_border.h).
#pragma once
#include <Eigen/Core>
#include <vector>

#include "common/hull/query/hull_query.h"

namespace fivepipe::hull {

inline constexpr int kNearPlane = -1;  // the ray is in the hull at the view's near plane
inline constexpr int kNoSurface = -2;

// One entry per pixel of `rect`, row-major.
struct HullSurface {
  PixelRect rect;
  // Index in the silhouettes given to CpuHull::assign(), kNearPlane or kNoSurface.
  std::vector<int> limiting_camera;
  // Unit normal out of the hull; it never points away from the eye. At the near plane it points
  // towards the eye; without a surface it is 0.
  std::vector<Eigen::Vector3f> normal_world;
};

// `tile` must hold depths of the query's hull from this view. Returns the surface of the tile's
// pixels. A pixel has no surface if its ray does not meet the hull in double or normal_at() returns
// nullopt. If two cameras limit the hull at once (an edge of the hull), the result names one of
// them deterministically. With Limits::seen an image's border can also limit the hull. A normal's
// error is that of contour_fit(). Runs in the hull's pool. Except for the indices, the result does
// not depend on the order of the silhouettes; nor does it depend on the division into tiles or the
// number of threads.
HullSurface hull_surface(const HullQuery& query, const View& view, const DepthTile& tile);

}  // namespace fivepipe::hull
