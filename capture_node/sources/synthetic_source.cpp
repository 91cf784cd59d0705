#include "capture_node/sources/synthetic_source.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "capture_node/synthetic/noise/noise.h"

namespace fivepipe::capture {
namespace {

// Maximum distance [frames] of a period from a whole number of frames: the rounding error of rate
// and period.
constexpr double kPeriodTolerance = 1e-6;

std::uint64_t key_of(std::uint64_t seed, const std::string& camera) {
  std::uint64_t key = splitmix64(seed);
  for (const char letter : camera)
    key = splitmix64(key, std::uint64_t(static_cast<unsigned char>(letter)));
  return key;
}

}  // namespace

SyntheticImageSource::SyntheticImageSource(const config::SyntheticWorld& world,
                                           const config::RigCamera& camera, double frame_rate_hz,
                                           EyePath eye,
                                           std::shared_ptr<const Surroundings> surroundings)
    : world_(world),
      camera_(camera),
      frame_rate_hz_(frame_rate_hz),
      eye_(std::move(eye)),
      renderer_(world, with_finer_pixels(camera, world.supersampling), std::move(surroundings)),
      noise_(world.noise_sigma_levels),
      noise_key_(key_of(world.seed, camera.name)) {}

Eigen::Isometry3d SyntheticImageSource::pose_at(double t_s) const {
  return camera_.mount == config::Mount::world ? camera_.camera_from_mount
                                               : camera_.camera_from_mount * eye_(t_s);
}

cv::Mat SyntheticImageSource::rendered(std::int64_t frame) {
  const double t_s = double(frame) / frame_rate_hz_;
  return mean_of_pixels(renderer_.image(synthetic_parts(world_, t_s), pose_at(t_s)),
                        world_.supersampling);
}

cv::Mat SyntheticImageSource::room() {
  return mean_of_pixels(renderer_.image({}, pose_at(0)), world_.supersampling);
}

bool SyntheticImageSource::prerender() {
  const double frames = world_.period_s * frame_rate_hz_;
  if (camera_.mount == config::Mount::viewer ||
      std::abs(frames - std::round(frames)) > kPeriodTolerance)
    return false;
  room_bgr_ = room();
  std::vector<PrerenderedRegion> ahead;
  for (std::int64_t frame = 0; frame < std::llround(frames); ++frame) {
    const cv::Mat bgr = rendered(frame);
    cv::Mat difference, changed;
    cv::absdiff(bgr, room_bgr_, difference);
    cv::reduce(difference.reshape(1, int(difference.total())), changed, 1, cv::REDUCE_MAX);
    const cv::Rect region = cv::boundingRect(changed.reshape(1, bgr.rows));
    ahead.push_back({region, bgr(region).clone()});
  }
  prerendered_ = std::move(ahead);
  return true;
}

ReadStatus SyntheticImageSource::read(std::int64_t frame, cv::Mat& bgr) {
  if (prerendered_.empty()) {
    bgr = rendered(frame);
  } else {
    const PrerenderedRegion& ahead = prerendered_[std::size_t(frame) % prerendered_.size()];
    bgr = room_bgr_.clone();
    ahead.bgr.copyTo(bgr(ahead.region));
  }
  noise_.add(bgr, splitmix64(noise_key_, 2 * std::uint64_t(frame)));
  return ReadStatus::image;
}

cv::Mat SyntheticImageSource::background(int index) {
  cv::Mat bgr = room();
  // Odd keys; read() uses the even ones.
  noise_.add(bgr, splitmix64(noise_key_, 2 * std::uint64_t(index) + 1));
  return bgr;
}

}  // namespace fivepipe::capture
