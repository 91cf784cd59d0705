// How well object pixels match the true ones.
#pragma once
#include "common/hull/object_pixels.h"

namespace fivepipe::capture_bench {

// Sums over the images of a sequence.
class Score {
 public:
  // Both maps have the same size.
  void add(const hull::ObjectPixels& found, const hull::ObjectPixels& truth);

  // Harmonic mean of precision and recall; 1: all pixels are right.
  double f1() const;
  // Pixels that are in both maps, per pixel that is in one of them.
  double iou() const;
  // Fraction of the true object pixels that are found.
  double recall() const;
  // Mean distance [px] from a pixel of one outline to the nearest of the other, of all outline
  // pixels of both. A distance counts as at most kMaxDistance_px, so that a speck far from the
  // object does not decide.
  double boundary_error_px() const;

  static constexpr double kMaxDistance_px = 20;

 private:
  double both_ = 0, found_ = 0, true_ = 0;
  double distance_px_ = 0, outline_px_ = 0;
};

}  // namespace fivepipe::capture_bench
