// Segmentation of the recording seated4cam: four cameras around a seated person. Skipped if the
// recording is absent.
#include <filesystem>
#include <opencv2/core.hpp>

#include "tests/support/capture/capture_rig.h"
#include "tests/support/capture/footage.h"
#include "tests/support/sanitizer.h"

namespace fivepipe::capture {
namespace {

namespace fs = std::filesystem;

const fs::path kFootage = test::seated4cam_folder();

// The default settings, which launch/deployments/seated4cam.yaml has, in the middle of the image.
Segmenter footage_segmenter(Background background, const config::SegmentationConfig& config = {}) {
  hull::ObjectPixels middle(background.width_px, background.height_px);
  for (int v = 130; v < 460; ++v) middle.set_run(120, 460, v);
  return Segmenter(std::move(background), config, std::move(middle));
}

struct Footage {
  config::RigCamera camera;
  std::vector<cv::Mat> background;
  cv::Mat image;
};

// Positions below are pixels of the captured image.
Footage footage(const std::string& name, int frame) {
  Footage result;
  result.camera = test::table_camera(name, {0, -1, 1}, 644, 486);
  result.background = read_background(result.camera, (kFootage / name / "background.avi").string());
  // To learn four cameras from all frames takes more than two minutes with the thread sanitizer.
  if (test::kHasSanitizer) result.background.resize(8);
  open_file_source(result.camera, {(kFootage / name / "video.avi").string(), {}, 0})
      ->read(frame, result.image);
  return result;
}

// Regions of the image of cam1: the centre of the chest, and floor beside the chair that the person
// shades.
constexpr hull::PixelRect kTorso{376, 200, 408, 236};
constexpr hull::PixelRect kFloorShadow{396, 306, 414, 328};

double fraction_in(const hull::ObjectPixels& pixels, const hull::PixelRect& rect) {
  std::size_t n = 0;
  for (int v = rect.v0_px; v < rect.v1_px; ++v)
    for (int u = rect.u0_px; u < rect.u1_px; ++u) n += pixels.contains(u, v);
  return double(n) / double(rect.area_px());
}

TEST(Footage, SeatedPersonIsFoundInEveryCamera) {
  if (!fs::exists(kFootage)) GTEST_SKIP() << "no recording at " << kFootage;
  for (const char* name : {"cam1", "cam2", "cam3", "cam4"}) {
    const Footage shot = footage(name, 200);
    const hull::ObjectPixels pixels =
        footage_segmenter(learn_background(shot.background)).segment(shot.image)->object;
    const double fraction = double(pixels.count()) / (644.0 * 486.0);
    // A seated person of 1.7 m, 3 to 4 m away at f = 490 px, fills about 70 x 190 to 120 x 270 px.
    EXPECT_GT(fraction, 0.02) << name;
    EXPECT_LT(fraction, 0.10) << name;
    EXPECT_TRUE(segmentation_diagnostics(pixels).empty());
  }
}

TEST(Footage, SegmentsWholePersonWithoutFloorShadow) {
  if (!fs::exists(kFootage)) GTEST_SKIP() << "no recording at " << kFootage;
  const Footage shot = footage("cam1", 200);
  const Background background = learn_background(shot.background);
  config::SegmentationConfig with_shadow;
  with_shadow.shadow_min_brightness = 1;
  const hull::ObjectPixels pixels = footage_segmenter(background).segment(shot.image)->object;
  const hull::ObjectPixels shadow_too =
      footage_segmenter(background, with_shadow).segment(shot.image)->object;
  EXPECT_GT(fraction_in(pixels, kTorso), 0.98) << "the torso has holes";
  EXPECT_GT(fraction_in(shadow_too, kFloorShadow), 0.5) << "the region has no shadow";
  EXPECT_LT(fraction_in(pixels, kFloorShadow), 0.1) << "the shadow is segmented as object";
}

}  // namespace
}  // namespace fivepipe::capture
