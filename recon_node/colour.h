// Colour of the hull: each visible point takes the colour of the camera image that sees it most as the eye does (the paper
// textures the hull with its camera images, section 3.2 and figure 1).
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/hull/colour_region.h"
#include "common/hull/hull.h"

namespace fivepipe {

// Points on the way from a hull point to a camera at which the hull is asked whether it hides the one from the other [m]. They
// are sparse: what is thinner than their spacing may be missed, and the colour is then that of what stands before it.
inline constexpr std::array<double, 4> kOcclusionProbes_m = {0.02, 0.04, 0.08, 0.16};
// A point that no image holds.
inline constexpr std::array<std::uint8_t, 3> kUnseenBgr = {128, 128, 128};

// One frame's images made ready. Borrows silhouettes and regions.
class HullColour {
 public:
  HullColour(std::span<const Silhouette> silhouettes, std::span<const ColourRegion> regions);

  // B, G, R of a hull point as seen from the eye: among the images whose region holds it, that whose line of sight is closest to the
  // eye's, ties to the first; images from which the hull hides the point come only after all others. Bilinear.
  std::array<std::uint8_t, 3> at(const Eigen::Vector3d& p_world_m, const Eigen::Vector3d& eye_world_m) const;

 private:
  struct Image {
    const ColourRegion* region;
    Eigen::Vector3d centre_world_m;
  };
  bool hidden(const Eigen::Vector3d& p_world_m, const Eigen::Vector3d& camera_world_m) const;

  std::span<const Silhouette> silhouettes_;
  std::vector<Image> images_;
};

}  // namespace fivepipe
