// The difference image (paper, section 3.1) by table lookup: classifies the pixels of an image
// against the background, 64 at a time. Most words hold background only: a comparison of all their
// levels, in the order of the image, with one tolerance shows that. Memory bounds the speed.
#pragma once
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "capture_node/segmentation/background.h"
#include "capture_node/segmentation/gain.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::capture {

// What a level must exceed to differ, grey levels of 255.
struct Tolerances {
  // A pixel differs if a channel is farther from the rounded mean than
  //   max(floor, min(ceiling, sigmas * measured sigma)) + jitter * gradient.
  double sigmas = 4, floor_levels = 8, ceiling_levels = 16;
  // The camera's movement against the background. The gradient is half the range of the levels in
  // the 3x3 neighbourhood.
  double jitter_px = 0.2;
  // A pixel differs strongly if a channel is farther than its own tolerance and (strong_factor - 1)
  // times the widest tolerance of the three. At least 1.
  double strong_factor = 2;
};

// Levels of the 64 pixels of one word, interleaved as in an image: b, g, r of the first pixel, and
// so on. Pixels beyond the row never differ.
using WordLevels = std::array<std::uint8_t, 192>;
// The same by channel b, g, r.
using LevelPlanes = std::array<std::array<std::uint8_t, 64>, 3>;

// The tables of one camera, by word, row-major as ObjectPixels.
struct DifferenceTables {
  struct Boxes {  // one for each pixel; an empty one has low 255 and high 0
    LevelPlanes low, high;
  };
  struct MovingWord {
    int word;
    std::vector<Boxes> boxes;
  };
  int width_px = 0, height_px = 0, words_per_row = 0;
  // The only tables that every image reads, so they are small: no level of a word differs if each
  // is within the word's tolerance of its mean.
  std::vector<WordLevels> mean;         // rounded
  std::vector<std::uint8_t> tolerance;  // the least of the word's
  // Only for words with a level beyond `tolerance`, as noise makes many.
  std::vector<WordLevels> tolerances;  // of each level, rounded down
  // A pixel differs strongly if a channel is farther than its tolerance by more than this:
  // (factor - 1) times the widest tolerance, rounded down on its own.
  std::vector<std::array<std::uint8_t, 64>> strong_excess;
  std::vector<MovingWord> moving;  // by word
};
DifferenceTables difference_tables(const Background& background, const Tolerances& tolerances);
// Computes the tables of row v again, after the background has changed there. brighter: by how much
// since it was learned, with its moving pixels' boxes, b, g, r. The gradients of the rows above and
// below also depend on the row; they stay as they are.
void refill_row(DifferenceTables& tables, const Background& background,
                const Tolerances& tolerances, int v, const Gain& brighter);

// Shadow preserves a surface's colour and reduces its brightness. With the pixel x and the
// background r, s = x.r / r.r is the brightness ratio and |x - s r| the colour distortion, both in
// grey levels (Horprasert, Harwood, Davis 1999). A pixel looks like shadow if s is at least the
// minimum brightness, and the colour distortion at most max(kShadowColour_levels, tan(tint) *
// s|r|), where `tint` is the largest angle between the colours: indirect light from the walls has
// another tint than the blocked light. Noise of three channels and rounding of the background.
inline constexpr float kShadowColour_levels = 8.0f;

struct Difference {
  hull::ObjectPixels differs;
  hull::ObjectPixels strongly;  // subset of `differs`
  // Subset of `differs`: no channel is above its bound, and the pixel looks like shadow.
  hull::ObjectPixels shadow;
};

struct DifferenceRequest {
  InverseGain inverse_gain = kNoGain;
  // Minimum brightness of a shadow; 1: `shadow` stays empty.
  double shadow_min_brightness = 0.5;
  double shadow_tint_degrees = 2;
  // Only these pixels are classified; the others do not differ. nullptr: all.
  const hull::ObjectPixels* within = nullptr;
};

// image: 8-bit BGR of the tables' size, `within` too (asserted). A saturated level (255) is never
// below its bound, because it may have been any brighter one.
Difference difference(const cv::Mat& image_bgr, const DifferenceTables& tables,
                      const DifferenceRequest& request);

}  // namespace fivepipe::capture
