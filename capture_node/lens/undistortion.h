// Maps the captured image (with lens distortion) to the published pinhole image.
//
// Segmentation runs before, on the captured image, because its noise is independent per pixel and
// its reference is exact; interpolation would mix neighbouring pixels into every difference.
// Undistortion then moves one bit per pixel by nearest neighbour, and interpolates coverage, and
// colours only in the region that the caller needs.
#pragma once
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "common/config/rig.h"
#include "common/hull/coverage/coverage_map.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::capture {

class Undistortion {
 public:
  explicit Undistortion(const config::RigCamera& camera);

  // Returns true if the captured image is the published one.
  bool identity() const { return identity_; }
  // Returns the published pixels whose source pixel is set. Pixels that the source does not see
  // stay unset. `source` must have the captured size.
  hull::ObjectPixels published(const hull::ObjectPixels& source) const;
  // Returns the published coverage by bilinear interpolation; 0 where the source sees nothing.
  // `source` must have the captured size.
  hull::CoverageMap published(const hull::CoverageMap& source) const;
  // Returns the part `region` of the published image by bilinear interpolation. Pixels that the
  // source does not see are black. `region` must be inside the published image.
  cv::Mat published(const cv::Mat& source_bgr, const hull::PixelRect& region) const;
  // Returns true if the captured image sees this published pixel.
  bool sees(int u_px, int v_px) const;
  // Returns whether it shows every published pixel.
  bool sees_all() const;

 private:
  // Smallest source rectangle that contains the source pixels of one word (64 published pixels).
  struct SourceRect {
    std::int32_t u0, v0, u1, v1;
  };
  // Published pixels [begin, begin + length) of a word, which show `length` neighbouring bits of
  // one row of the source map, from source_bit on.
  struct Run {
    std::int32_t source_bit;
    std::uint8_t begin, length;
  };
  // Appends the source bit of published pixel u of a word; words and pixels increase.
  void add_bit(std::size_t word, int u, std::int32_t source_bit);

  bool identity_ = false;
  int source_width_px_ = 0, source_height_px_ = 0, width_px_ = 0, height_px_ = 0;
  std::vector<Run> runs_;                 // of all words
  std::vector<std::uint32_t> run_ends_;   // per published word: the end of its runs
  std::vector<SourceRect> source_rects_;  // per published word
  std::vector<std::uint64_t> seen_;       // published pixels that the source sees, by word
  cv::Mat position_, fraction_;           // CV_16SC2 and CV_16UC1, as cv::remap takes them
};

// Returns the captured pixels whose directions are outside the published image. Pixels beyond
// monotonic_radius() have no direction and are not set.
hull::ObjectPixels outside_published(const config::RigCamera& camera);

}  // namespace fivepipe::capture
