// Cameras about the table for the capture tests, and what their maps are compared by.
#pragma once
#include <gtest/gtest.h>

#include "capture_node/bit_morphology.h"
#include "capture_node/segmentation.h"
#include "capture_node/synthetic_source.h"

namespace fivepipe {

inline RigCamera table_camera(const std::string& name, const Eigen::Vector3d& eye_world_m, int width_px = 720, int height_px = 486) {
  RigCamera camera;
  camera.name = name;
  camera.source = camera.published = pinhole_from_fov(width_px, height_px, 0.75);
  camera.camera_from_mount = look_at(eye_world_m, {0, 0, 0.2});
  return camera;
}

inline std::vector<RigCamera> table_cameras() {
  std::vector<RigCamera> cameras{table_camera("left", {-1.5, 0.9, 1.3}), table_camera("right", {1.5, 0.9, 1.3}),
                                 table_camera("top", {0.1, -0.2, 2.0})};
  cameras[1].distortion = {-0.25, 0.08, 0.0005, -0.0003, 0};
  return cameras;
}

// Built once: its textures take longer than most tests.
inline std::shared_ptr<const Surroundings> test_room() {
  static const auto room = std::make_shared<const Surroundings>(1);
  return room;
}

inline ObjectPixels both(const ObjectPixels& a, const ObjectPixels& b) {
  ObjectPixels result = a;
  for (std::size_t i = 0; i < result.words().size(); ++i) result.mutable_words()[i] &= b.words()[i];
  return result;
}
inline std::size_t count_not_in(const ObjectPixels& a, const ObjectPixels& b) { return a.count() - both(a, b).count(); }

// A synthetic camera with its reference learnt.
struct TestCamera {
  TestCamera(const RigCamera& rig_camera, const SyntheticWorld& world, const SegmentationConfig& config, int background_frames = 24)
      : camera(rig_camera), source(world, rig_camera, 30, {}, test_room()), segmenter(rig_camera, reference(background_frames), config) {}
  ReferenceImage reference(int frames) {
    std::vector<cv::Mat> empty;
    for (int i = 0; i < frames; ++i) empty.push_back(source.background(i));
    return learn_reference(empty);
  }
  ObjectPixels segment(std::int64_t frame) {
    cv::Mat image;
    EXPECT_EQ(source.read(frame, image), ReadStatus::image);
    return segmenter.segment(image).value();
  }
  RigCamera camera;
  SyntheticImageSource source;
  Segmenter segmenter;
};

}  // namespace fivepipe
