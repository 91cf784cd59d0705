// The hull's surface as a view sees it: which camera's silhouette ends the hull there, and the
// plane it ends in (hull_border.h).
#pragma once
#include <Eigen/Core>
#include <vector>

#include "common/hull/query/hull_query.h"

namespace fivepipe::hull {

inline constexpr int kNearPlane = -1;  // the hull is there from the view's near plane on
inline constexpr int kNoSurface = -2;

// Of the view's pixels in `rect`, row by row.
struct HullSurface {
  PixelRect rect;
  std::vector<int> limiting_camera;  // index in the silhouettes as given; kNearPlane, kNoSurface
  std::vector<Eigen::Vector3f> normal_world;  // unit, out of the hull, never away from the eye; at
                                              // the near plane towards the eye; 0 without surface
};

// The tile is of the query's hull and of this view; a pixel whose ray the hull doesn't meet after
// all has no surface. Where two cameras limit at once (an edge of the hull), one of them stands,
// always the same. By `seen`, an image's border limits too. A normal's error is that of the
// contour's fit (contour.h). In the hull's pool; the same for every order of the silhouettes but
// for their indices, division into tiles, and number of threads.
HullSurface hull_surface(const HullQuery& query, const View& view, const DepthTile& tile);

}  // namespace fivepipe::hull
