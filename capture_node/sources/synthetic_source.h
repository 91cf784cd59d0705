// A camera of the synthetic world as a source of images.
#pragma once
#include <functional>
#include <memory>

#include "capture_node/sources/image_source.h"
#include "capture_node/synthetic/render.h"

namespace fivepipe::capture {

class SyntheticImageSource final : public ImageSource {
 public:
  // eye_from_world at a time [s]: for cameras that the viewer carries.
  using EyePath = std::function<Eigen::Isometry3d(double t_s)>;
  SyntheticImageSource(const config::SyntheticWorld& world, const config::RigCamera& camera,
                       double frame_rate_hz, EyePath eye,
                       std::shared_ptr<const Surroundings> surroundings);

  // Frame f shows the world at f / frame_rate_hz. The same seed, camera and frame give the same
  // bits. Never missing, never ends.
  ReadStatus read(std::int64_t frame, cv::Mat& bgr) override;
  // Renders one period of the world ahead; read() then puts these images together. Does nothing for
  // cameras that the viewer carries, and where a period is not a whole number of frames.
  void prerender();
  // The empty room, with other noise for each index; only for cameras fixed in the world.
  cv::Mat background(int index);

 private:
  struct PrerenderedRegion {  // what of an image differs from the room
    cv::Rect region;
    cv::Mat bgr;
  };
  Eigen::Isometry3d pose_at(double t_s) const;
  cv::Mat rendered(std::int64_t frame);
  config::SyntheticWorld world_;
  config::RigCamera camera_;
  double frame_rate_hz_;
  EyePath eye_;
  SyntheticCamera renderer_;
  SensorNoise noise_;
  std::uint64_t noise_key_;
  cv::Mat room_bgr_;  // of `prerendered_`
  std::vector<PrerenderedRegion>
      prerendered_;  // by frame of the period; empty: nothing is rendered ahead
};

}  // namespace fivepipe::capture
