// Accuracy of sub-pixel silhouettes: depth of the hull of binary and of coverage maps against the
// hull of the true silhouettes, on a synthetic rig whose images have partly covered pixels and
// noise.
#pragma once
#include <string>
#include <vector>

#include "common/config/rig.h"

namespace fivepipe::capture_bench {

// The maps of one row: by the pixels' centres, as segmented, with the true coverage, and with the
// coverage that capture_node estimates from the segmented images.
enum class MapKind { centre, segmented, exact_coverage, estimated_coverage };
std::string name_of(MapKind maps);

struct CoverageRow {
  MapKind maps;
  // Of the rays that meet all four hulls and the true one within kSearch_m of them.
  std::vector<double> error_mm;
  // For the depths of the whole view from the maps that recon_node receives; one thread.
  std::vector<double> time_ms;
  // Rays that meet the true hull but not that of the maps, and the reverse.
  std::size_t missed, extra;
};
struct CoverageAccuracy {
  std::vector<CoverageRow> rows;  // in the order of MapKind
  // Compared rays that meet the hull of one of the rows. Rays on which the true hull begins more
  // than kSearch_m before do not count.
  std::size_t rays = 0;
};

// Reconstructs the hand with the pipe in several poses from the cameras of the rig that give shape
// and are fixed in the world. Each image is the mean of 4 x 4 rays per pixel with sensor noise. The
// view is that of launch/deployments/demo.yaml with 320x240 rays.
CoverageAccuracy measure_coverage(const config::Rig& rig, int poses, int timed_runs);

// Depths of the true hull are searched this far before and behind those of the rows.
inline constexpr double kSearch_m = 0.02;

}  // namespace fivepipe::capture_bench
