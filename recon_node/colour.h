// Colour of the hull: each visible point takes the colours of the camera images that see it, those
// that see it most as the eye does counting most (the paper textures the hull with its camera
// images, section 3.2 and figure 1; the weights are those of view-dependent texture mapping,
// Debevec, Taylor, Malik 1996, section 3).
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/hull/colour_region.h"
#include "common/hull/hull.h"

namespace fivepipe::recon {

// Points on the way from a hull point to a camera at which the hull is asked whether it hides the
// one from the other [m]. They are sparse: what is thinner than their spacing may be missed, and
// the colour is then that of what stands before it. The first is within what segmentation's ragged
// borders add to a hull: it casts doubt, the others decide.
inline constexpr std::array<double, 4> kOcclusionProbes_m = {0.02, 0.04, 0.08, 0.16};
// What an image counts where the first probe alone is in the hull, and where any other is: only if
// no image sees the point.
inline constexpr double kDoubtfulWeight = 0.3, kHiddenWeight = 1e-9;
// Images that together count less than this beside the others are not asked: a quarter of a grey
// level at most.
inline constexpr double kNegligibleFraction = 1.0 / 1024;
// A point that no image holds.
inline constexpr std::array<std::uint8_t, 3> kUnseenBgr = {128, 128, 128};

// One frame's images made ready. Borrows silhouettes and regions.
class HullColour {
 public:
  // Of an image whose camera is one of the silhouettes', object pixels alone give colour: at the
  // hull's border the others show the background.
  HullColour(std::span<const hull::Silhouette> silhouettes,
             std::span<const hull::ColourRegion> regions);

  // B, G, R of a hull point as seen from the eye. Bilinear. An image whose line of sight is at
  // angle a from the eye's counts
  // ((1 + cos a) / 2) ^ 16: a third at 30 degrees, a hundredth at 60. Blended, not chosen: pixels
  // side by side on a ragged hull would flicker between images.
  std::array<std::uint8_t, 3> at(const Eigen::Vector3d& p_world_m,
                                 const Eigen::Vector3d& eye_world_m) const;

 private:
  using Homogeneous = Eigen::Vector3d;  // pixel times depth: linear along every line of points
  struct Image {
    const hull::ColourRegion* region;
    const hull::ObjectPixels* object;  // null: the image gives no shape
    std::size_t silhouette;            // whose pixels these are; that many: none
    Eigen::Vector3d center_world_m;
    std::vector<Homogeneous> center_seen;  // its centre, by silhouette
  };
  bool is_in_silhouette(std::size_t silhouette, const Homogeneous& seen) const;
  double visibility(const Image& image, const Eigen::Vector3d& p_world_m,
                    std::span<const Homogeneous> p_seen) const;

  std::span<const hull::Silhouette> silhouettes_;
  std::vector<Eigen::Matrix<double, 3, 4>> projections_;  // by silhouette
  std::vector<Image> images_;
};

}  // namespace fivepipe::recon
