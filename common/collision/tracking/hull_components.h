// The connected parts of the visual hull: where each is, how large, how it lies.
//
// A box of space is halved until each cell is certified free or certified in the hull
// (contact_lanes.h), or is of the size asked for: then its middle decides. Parts are cells that
// touch at a face, an edge or a corner (connected components, Rosenfeld and Pfaltz, 1966).
#pragma once
#include <vector>

#include "common/collision/tracking/component_outlines.h"
#include "common/hull/query/hull_query.h"

namespace fivepipe::collision {

struct HullComponent {
  Eigen::Vector3d centroid_world_m = Eigen::Vector3d::Zero();  // of mass, of even density
  double volume_m3 = 0;
  Eigen::Matrix3d covariance_world_m2 = Eigen::Matrix3d::Zero();  // of its points
  Eigen::AlignedBox3d box_world_m;
  std::size_t cells = 0;
  bool cut = false;  // it reaches the border of the box looked at, or of a camera's image: there
                     // may be more of it
  std::vector<ComponentOutline> outlines;  // where asked for
};

struct HullComponentsOptions {
  Eigen::AlignedBox3d within_world_m;  // not empty
  double cell_m =
      0.005;  // edge of the smallest cells: what lies that near to each other is one part
  std::size_t min_cells = 2;  // smaller parts are left out
  bool outlines = false;      // wanted as well: what ComponentTracker tells rotations by
};

// Largest part first. The same for every number of threads. Throws std::invalid_argument where the
// box is empty or not finite, the cell is not positive, or there would be more than
// kMaxComponentCells cells in the box; or where the hull's rule is not Limits::all.
inline constexpr std::size_t kMaxComponentCells = std::size_t{1} << 27;
std::vector<HullComponent> hull_components(const hull::HullQuery& query,
                                           const HullComponentsOptions& options);

}  // namespace fivepipe::collision
