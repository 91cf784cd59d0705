// Cameras around the table for the capture tests, and functions that compare their maps.
#pragma once
#include <gtest/gtest.h>

#include "capture_node/lens/undistortion.h"
#include "capture_node/segmentation/bit_morphology.h"
#include "capture_node/segmentation/segmentation.h"
#include "capture_node/sources/synthetic_source.h"

namespace fivepipe::test {

inline config::RigCamera table_camera(const std::string& name, const Eigen::Vector3d& eye_world_m,
                                      int width_px = 720, int height_px = 486) {
  config::RigCamera camera;
  camera.name = name;
  camera.source = camera.published = geometry::pinhole_from_fov(width_px, height_px, 0.75);
  camera.camera_from_mount = geometry::look_at(eye_world_m, {0, 0, 0.2});
  return camera;
}

inline std::vector<config::RigCamera> table_cameras() {
  std::vector<config::RigCamera> cameras{table_camera("left", {-1.5, 0.9, 1.3}),
                                         table_camera("right", {1.5, 0.9, 1.3}),
                                         table_camera("top", {0.1, -0.2, 2.0})};
  cameras[1].distortion = {-0.25, 0.08, 0.0005, -0.0003, 0};
  return cameras;
}

// Built once, because its textures take longer than most tests.
inline std::shared_ptr<const capture::Surroundings> test_room() {
  static const auto room = std::make_shared<const capture::Surroundings>(1);
  return room;
}

// A part that is a capsule.
inline const hull::Capsule& capsule_of(const capture::SyntheticPart& part) {
  return std::get<hull::Capsule>(part.shape);
}

// The capsules of the synthetic object at time t_s, without their materials. It has no other parts.
inline std::vector<hull::Capsule> synthetic_object(const config::SyntheticWorld& world,
                                                   double t_s) {
  std::vector<hull::Capsule> object;
  for (const capture::SyntheticPart& part : capture::synthetic_parts(world, t_s))
    object.push_back(capsule_of(part));
  return object;
}

// Reads the next image of a device, for which it waits as capture_node does.
inline capture::ReadStatus read_next(capture::ImageSource& source, cv::Mat& bgr) {
  source.wait_for_image(std::chrono::steady_clock::now() + capture::kImageTimeout);
  return source.read(0, bgr);
}

// Pixels set in both maps.
inline hull::ObjectPixels both(hull::ObjectPixels a, const hull::ObjectPixels& b) {
  a.keep(b);
  return a;
}
// Number of pixels of `a` that are not set in `b`.
inline std::size_t count_not_in(const hull::ObjectPixels& a, const hull::ObjectPixels& b) {
  return a.count() - a.count_common(b);
}

// A synthetic camera and its segmenter, with a learned background.
struct TestCamera {
  TestCamera(const config::RigCamera& rig_camera, const config::SyntheticWorld& world,
             const config::SegmentationConfig& config, int background_frames = 24)
      : camera(rig_camera),
        source(world, rig_camera, 30, {}, test_room()),
        segmenter(background(background_frames), config),
        undistortion(rig_camera) {}
  capture::Background background(int frames) {
    std::vector<cv::Mat> empty;
    for (int i = 0; i < frames; ++i) empty.push_back(source.background(i));
    return capture::learn_background(empty);
  }
  hull::ObjectPixels segment(std::int64_t frame) {
    cv::Mat image;
    EXPECT_EQ(source.read(frame, image), capture::ReadStatus::image);
    return undistortion.published(segmenter.segment(image)->object);
  }
  config::RigCamera camera;
  capture::SyntheticImageSource source;
  capture::Segmenter segmenter;
  capture::Undistortion undistortion;
};

}  // namespace fivepipe::test
