// A camera of the synthetic world as an image source.
#pragma once
#include <functional>
#include <memory>

#include "capture_node/sources/image_source.h"
#include "capture_node/synthetic/noise/sensor_noise.h"
#include "capture_node/synthetic/render.h"

namespace fivepipe::capture {

class SyntheticImageSource final : public ImageSource {
 public:
  // eye_from_world at a time [s]. Only cameras mounted on the viewer use it.
  using EyePath = std::function<Eigen::Isometry3d(double t_s)>;
  SyntheticImageSource(const config::SyntheticWorld& world, const config::RigCamera& camera,
                       double frame_rate_hz, EyePath eye,
                       std::shared_ptr<const Surroundings> surroundings);

  // Frame f shows the world at f / frame_rate_hz [s]. The same seed, camera and frame give the same
  // bits. Always returns ReadStatus::image.
  ReadStatus read(std::int64_t frame, cv::Mat& bgr) override;
  // Renders one period of the world in advance, so that read() only copies images. Does nothing and
  // returns false for a camera mounted on the viewer, and if the period is not a whole number of
  // frames.
  bool prerender();
  // Returns the empty room, with different noise for each index. Only for cameras fixed in the
  // world.
  cv::Mat background(int index);

 private:
  struct PrerenderedRegion {  // the part of an image that differs from the room
    cv::Rect region;
    cv::Mat bgr;
  };
  Eigen::Isometry3d pose_at(double t_s) const;
  cv::Mat rendered(std::int64_t frame);
  cv::Mat room();
  config::SyntheticWorld world_;
  config::RigCamera camera_;
  double frame_rate_hz_;
  EyePath eye_;
  SyntheticCamera renderer_;  // with supersampling, of finer pixels
  SensorNoise noise_;
  std::uint64_t noise_key_;
  cv::Mat room_bgr_;                            // background of `prerendered_`
  std::vector<PrerenderedRegion> prerendered_;  // by frame of the period; empty: render on demand
};

}  // namespace fivepipe::capture
