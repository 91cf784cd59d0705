#include "capture_node/synthetic_source.h"

#include "capture_node/synthetic/noise.h"

namespace fivepipe {
namespace {

std::uint64_t key_of(std::uint64_t seed, const std::string& camera) {
  std::uint64_t key = mixed(seed);
  for (const char letter : camera) key = mixed(key, std::uint64_t(static_cast<unsigned char>(letter)));
  return key;
}

}  // namespace

SyntheticImageSource::SyntheticImageSource(const SyntheticWorld& world, const RigCamera& camera, double frame_rate_hz, EyePath eye,
                                           std::shared_ptr<const Surroundings> surroundings)
    : world_(world), camera_(camera), frame_rate_hz_(frame_rate_hz), eye_(std::move(eye)),
      renderer_(world, camera, std::move(surroundings)), noise_(world.noise_sigma_levels), noise_key_(key_of(world.seed, camera.name)) {}

Eigen::Isometry3d SyntheticImageSource::pose_at(double t_s) const {
  return camera_.mount == Mount::world ? camera_.camera_from_mount : camera_.camera_from_mount * eye_(t_s);
}

ReadStatus SyntheticImageSource::read(std::int64_t frame, cv::Mat& bgr) {
  const double t_s = double(frame) / frame_rate_hz_;
  bgr = renderer_.image(synthetic_parts(world_, t_s), pose_at(t_s));
  noise_.add(bgr, mixed(noise_key_, 2 * std::uint64_t(frame)));
  return ReadStatus::image;
}

cv::Mat SyntheticImageSource::background(int index) {
  cv::Mat bgr = renderer_.image({}, pose_at(0));
  noise_.add(bgr, mixed(noise_key_, 2 * std::uint64_t(index) + 1));  // odd: frames have the even ones
  return bgr;
}

}  // namespace fivepipe
