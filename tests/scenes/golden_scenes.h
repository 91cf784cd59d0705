// The shipped scenes with golden images, and how far an image may differ from them.
#pragma once
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/scenes/scene_player.h"
#include "tests/support/golden_image.h"

namespace fivepipe::test {

// Another driver may round a shade, a texture or the edge of a shadow differently. Bounds of
// GoldenTolerance: of a pixel, of the mean, and the fraction of wrong pixels.
inline constexpr int kShade_levels = 12;
inline constexpr double kMean_levels = 0.2;
inline constexpr double kOtherPixels = 0.002;

// The comparison refuses an image in which a square of this size has another colour.
inline constexpr int kNoticed_px = 32;

struct GoldenScene {
  std::string name;  // of the deployment
  // The simulation starts here: shortly before what the image shows.
  std::int64_t first_frame;
  GoldenTolerance tolerance{kMean_levels, kShade_levels, kOtherPixels};
};

inline const std::vector<GoldenScene> kGoldenScenes = {
    {"curtain", 24},    {"blocks", 60}, {"door", 30},    {"particles", 48},
    {"warm_plate", 60}, {"demo", 0},    {"payload", 46}, {"engine", 84},
};

// Returns the scene of the deployment with this name. Throws std::invalid_argument.
inline GoldenScene golden_scene(const std::string& name) {
  for (const GoldenScene& scene : kGoldenScenes)
    if (scene.name == name) return scene;
  throw std::invalid_argument("no golden scene " + name);
}

inline std::string golden_file(const GoldenScene& scene) { return "scenes/" + scene.name + ".png"; }
inline cv::Mat golden_of(const GoldenScene& scene) {
  return cv::imread(std::string(FIVEPIPE_SOURCE_DIR) + "/tests/golden/" + golden_file(scene));
}

}  // namespace fivepipe::test
