// Colours the hull: each visible point gets the weighted mean of the camera images that see it. An
// image that sees the point from nearly the same direction as the eye has the largest weight. The
// paper textures the hull with its camera images (section 3.2, figure 1); the weights are those of
// view-dependent texture mapping (Debevec, Taylor, Malik 1996, section 3).
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/hull/colour_region.h"
#include "common/hull/hull.h"

namespace fivepipe::hull {

// Distances from a hull point towards a camera at which the hull is tested for occlusion [m]. Hull
// that is thinner than their spacing may be missed; the point then gets the colour of the occluder.
// The first distance is within the excess that ragged silhouette borders add to a hull, so a hit
// there is doubtful; a hit at any other distance means that the point is hidden.
inline constexpr std::array<double, 4> kOcclusionProbes_m = {0.02, 0.04, 0.08, 0.16};
// Factors on the weight of an image: kDoubtfulWeight if only the first probe is in the hull,
// kHiddenWeight if another probe is. The latter is small, so a hidden image counts only if no image
// sees the point.
inline constexpr double kDoubtfulWeight = 0.3, kHiddenWeight = 1e-9;
// Skips the images whose weights together are below this fraction of the sum so far. They change
// the result by at most a quarter of a grey level.
inline constexpr double kNegligibleFraction = 1.0 / 1024;
// The colour of a point that no image contains.
inline constexpr std::array<std::uint8_t, 3> kUnseenBgr = {128, 128, 128};

// The images of one frame, prepared for queries. The silhouettes and regions must outlive it.
class HullColour {
 public:
  // If the camera of a region is one of the silhouettes' cameras, only its object pixels give
  // colour: at the border of the hull the other pixels show the background.
  // `rule`: of the hull, which occludes.
  HullColour(std::span<const Silhouette> silhouettes, std::span<const ColourRegion> regions,
             const HullRule& rule = {});

  // Returns B, G, R of a hull point as seen from the eye, with bilinear sampling. If the directions
  // to the camera and to the eye differ by angle a, the image has weight ((1 + cos a) / 2) ^ 16: a
  // third at 30 degrees, a hundredth at 60. Blending avoids the flicker between images that
  // choosing one image per pixel would cause on a ragged hull.
  std::array<std::uint8_t, 3> at(const Eigen::Vector3d& p_world_m,
                                 const Eigen::Vector3d& eye_world_m) const;

 private:
  using Homogeneous = Eigen::Vector3d;  // pixel times depth; linear along a line in space
  struct Image {
    const ColourRegion* region;
    const ObjectPixels* object;  // null if the camera has no silhouette
    std::size_t silhouette;      // index of the camera's silhouette; their number if it has none
    Eigen::Vector3d center_world_m;
    std::vector<Homogeneous> center_seen;  // the camera center as each silhouette's camera sees it
  };
  enum class Sight { unseen, empty, object };
  Sight sight(std::size_t silhouette, const Homogeneous& seen) const;
  bool is_in_hull(std::size_t own, double fraction, const Image& image,
                  std::span<const Homogeneous> p_seen) const;
  double visibility(const Image& image, const Eigen::Vector3d& p_world_m,
                    std::span<const Homogeneous> p_seen) const;

  std::span<const Silhouette> silhouettes_;
  HullRule rule_;
  std::vector<Eigen::Matrix<double, 3, 4>> projections_;  // pixel_from_world, by silhouette
  std::vector<Image> images_;
};

}  // namespace fivepipe::hull
