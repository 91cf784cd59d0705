// Connected components of the visual hull: position, size and shape of each.
//
// A box of space is subdivided until each cell is certified free or certified in the hull
// (contact_simd.h), or has the size cell_m; then its centre decides. Cells that share a face, an
// edge or a corner belong to one component (connected components: Rosenfeld and Pfaltz, 1966).
#pragma once
#include <vector>

#include "common/collision/tracking/component_outlines.h"
#include "common/hull/query/hull_query.h"

namespace fivepipe::collision {

struct HullComponent {
  Eigen::Vector3d centroid_world_m = Eigen::Vector3d::Zero();  // of the volume
  double volume_m3 = 0;
  Eigen::Matrix3d covariance_world_m2 = Eigen::Matrix3d::Zero();  // of the volume
  Eigen::AlignedBox3d box_world_m;
  std::size_t cells = 0;
  // Touches a side or the top of the search box, or an image border, so more of it may exist. The
  // bottom of the box is the floor, on which real objects stand.
  bool clipped = false;
  std::vector<ComponentOutline> outlines;  // filled if HullComponentsOptions::outlines is set
};

struct HullComponentsOptions {
  Eigen::AlignedBox3d within_world_m;  // not empty
  double cell_m = 0.005;      // edge of the smallest cells; components closer than this merge
  std::size_t min_cells = 2;  // drops smaller components
  bool outlines = false;      // also compute outlines; ComponentTracker needs them for rotations
};

// Maximum number of cells in the box.
inline constexpr std::size_t kMaxComponentCells = std::size_t{1} << 27;
// Returns the components by descending volume. The result does not depend on the number of threads.
// Throws std::invalid_argument if the box is empty or not finite, cell_m is not positive, or the
// box has more than kMaxComponentCells cells.
std::vector<HullComponent> hull_components(const hull::HullQuery& query,
                                           const HullComponentsOptions& options);

}  // namespace fivepipe::collision
