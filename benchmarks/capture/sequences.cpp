#include "benchmarks/capture/sequences.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture_node/synthetic/noise/noise.h"
#include "capture_node/synthetic/noise/sensor_noise.h"
#include "capture_node/synthetic/render.h"

namespace fivepipe::capture_bench {
namespace {

using capture::fractal_noise;
using capture::splitmix64;
using capture::unit_hash;

constexpr double kTurn = 2 * std::numbers::pi;

// Independent numbers of a seed.
enum class Stream : std::uint64_t { camera, noise, light, wind, people };
std::uint64_t key_of(std::uint64_t seed, Stream stream, std::uint64_t n = 0) {
  return splitmix64(splitmix64(splitmix64(seed), std::uint64_t(stream)), n);
}
// Uniform in [0, 1).
double uniform(std::uint64_t seed, Stream stream, std::uint64_t n) {
  return double(unit_hash(key_of(seed, stream, n)));
}

// A camera on a circle around the table.
config::RigCamera camera_of(std::uint64_t seed, int width_px, int height_px) {
  constexpr double kDistance_m = 1.7, kFieldOfView_rad = 0.85;
  const double azimuth = kTurn * uniform(seed, Stream::camera, 0),
               height_m = 1.1 + 0.5 * uniform(seed, Stream::camera, 1);
  config::RigCamera camera;
  camera.name = "camera";
  camera.source = camera.published =
      geometry::pinhole_from_fov(width_px, height_px, kFieldOfView_rad);
  camera.camera_from_mount = geometry::look_at(
      {kDistance_m * std::cos(azimuth), kDistance_m * std::sin(azimuth), height_m}, {0, 0, 0.2});
  return camera;
}

hull::ObjectPixels true_pixels(const std::vector<capture::SyntheticPart>& parts,
                               const geometry::Camera& camera) {
  hull::ObjectPixels pixels(camera.pinhole.width_px, camera.pinhole.height_px);
  for (const capture::SyntheticPart& part : parts)
    if (const auto* capsule = std::get_if<hull::Capsule>(&part.shape))
      pixels.add(hull::true_object_pixels({capsule, 1}, camera, hull::PixelRule::center));
    else
      pixels.add(hull::true_object_pixels(std::get<geometry::OrientedBox>(part.shape), camera));
  return pixels;
}

// Multiplies all levels, with saturation.
void scale(cv::Mat& bgr, double gain) { bgr.convertTo(bgr, -1, gain); }

// The gain of image n; images of the object follow those of the learning.
double flickering_gain(std::uint64_t seed, std::uint64_t n) {
  constexpr double kAmplitude = 0.04, kRandom = 0.02;
  const double cycles_per_image = 0.2 + 0.3 * uniform(seed, Stream::light, 0);
  return 1 + kAmplitude * std::sin(kTurn * cycles_per_image * double(n)) +
         kRandom * (2 * uniform(seed, Stream::light, n + 1) - 1);
}

double drifted_gain(std::uint64_t seed, int image) {
  constexpr double kLast = 0.12;
  const double sign = uniform(seed, Stream::light, 0) < 0.5 ? -1 : 1;
  return 1 + sign * kLast * double(image + 1) / kImages;
}

// Moves the object's levels towards those of the background.
void camouflage(cv::Mat& bgr, const cv::Mat& room_bgr, const hull::ObjectPixels& object) {
  constexpr double kContrast = 0.3;
  object.for_each_run(
      {0, 0, object.width_px(), object.height_px()}, [&](int v, int begin, int end) {
        for (int i = 3 * begin; i < 3 * end; ++i) {
          std::uint8_t& level = bgr.ptr(v)[i];
          const double room = room_bgr.ptr(v)[i];
          level = std::uint8_t(std::lround(room + kContrast * (double(level) - room)));
        }
      });
}

// Leaves in the upper part of the image.
class Leaves {
 public:
  Leaves(std::uint64_t seed, int width_px, int height_px)
      : seed_(seed), width_px_(width_px), height_px_(height_px * 2 / 5) {}

  // Draws those of image n.
  void draw(cv::Mat& bgr, std::uint64_t n) const {
    constexpr double kAmplitude_px = 6, kLeaf_px = 12;
    const std::uint64_t texture = key_of(seed_, Stream::wind);
    const double phase = kTurn * 0.13 * double(n) + uniform(seed_, Stream::wind, n + 1);
    for (int v = 0; v < height_px_; ++v)
      for (int u = 0; u < width_px_; ++u) {
        const double gust = std::sin(phase + 0.011 * u + 0.017 * v);
        const float leaf = fractal_noise(texture, float((u + kAmplitude_px * gust) / kLeaf_px),
                                         float((v + 0.5 * kAmplitude_px * gust) / kLeaf_px));
        std::uint8_t* const pixel = bgr.ptr(v) + 3 * u;
        const std::uint8_t levels[3] = {std::uint8_t(20 + 60 * leaf), std::uint8_t(40 + 170 * leaf),
                                        std::uint8_t(30 + 90 * leaf)};
        std::copy(std::begin(levels), std::end(levels), pixel);
      }
  }

 private:
  std::uint64_t seed_;
  int width_px_, height_px_;
};

// People walk through learning image n, half an image apart. Each is an ellipse with a texture.
void draw_passers_by(cv::Mat& bgr, std::uint64_t seed, int n) {
  constexpr int kPeople = 2;
  for (int person = 0; person < kPeople; ++person) {
    const std::uint64_t texture = key_of(seed, Stream::people, std::uint64_t(person));
    const double radius_px = bgr.cols / 16.0, speed = 1 + 0.3 * person;
    const double way = std::fmod(speed * n / kLearningImages + 0.5 * person, 1.0);
    const double center_u = (1.2 * way - 0.1) * bgr.cols,
                 center_v = (0.45 + 0.2 * person) * bgr.rows;
    const int u0 = std::max(0, int(center_u - radius_px)),
              u1 = std::min(bgr.cols, int(center_u + radius_px) + 1),
              v0 = std::max(0, int(center_v - 3 * radius_px)),
              v1 = std::min(bgr.rows, int(center_v + 3 * radius_px) + 1);
    for (int v = v0; v < v1; ++v)
      for (int u = u0; u < u1; ++u) {
        const double x = (u - center_u) / radius_px, y = (v - center_v) / (3 * radius_px);
        if (x * x + y * y > 1) continue;
        const float cloth = fractal_noise(texture, float(4 * x), float(8 * y));
        std::uint8_t* const pixel = bgr.ptr(v) + 3 * u;
        for (int c = 0; c < 3; ++c)
          pixel[c] = std::uint8_t(255 * (0.15 + 0.6 * cloth * unit_hash(texture + unsigned(c))));
      }
  }
}

}  // namespace

std::string name_of(Disturbance disturbance) {
  switch (disturbance) {
    case Disturbance::noise: return "noise";
    case Disturbance::shadow: return "shadow";
    case Disturbance::flicker: return "flicker";
    case Disturbance::drift: return "drift";
    case Disturbance::camouflage: return "camouflage";
    case Disturbance::waving: return "waving";
    case Disturbance::passers_by: return "passers_by";
  }
  return "";
}

bool is_static(Disturbance disturbance) {
  return disturbance == Disturbance::noise || disturbance == Disturbance::shadow ||
         disturbance == Disturbance::passers_by;
}

Sequence sequence(Disturbance disturbance, std::uint64_t seed, int width_px, int height_px) {
  config::SyntheticWorld world;
  world.seed = seed;
  world.cast_shadow = disturbance == Disturbance::shadow;
  const config::RigCamera camera = camera_of(seed, width_px, height_px);
  capture::SyntheticCamera renderer(world, camera,
                                    std::make_shared<const capture::Surroundings>(seed));
  const capture::SensorNoise noise(kNoise_levels);
  const Leaves leaves(seed, width_px, height_px);
  const cv::Mat room = renderer.image({}, camera.camera_from_mount);
  Sequence result{disturbance, {}, {}, {}};
  // Image n of all; those with the object follow the others.
  const auto finished = [&](cv::Mat image, int n) {
    if (disturbance == Disturbance::flicker) scale(image, flickering_gain(seed, std::uint64_t(n)));
    if (disturbance == Disturbance::drift && n >= kLearningImages)
      scale(image, drifted_gain(seed, n - kLearningImages));
    noise.add(image, key_of(seed, Stream::noise, std::uint64_t(n)));
    return image;
  };
  for (int n = 0; n < kLearningImages; ++n) {
    cv::Mat image = room.clone();
    if (disturbance == Disturbance::waving) leaves.draw(image, std::uint64_t(n));
    if (disturbance == Disturbance::passers_by) draw_passers_by(image, seed, n);
    result.learning.push_back(finished(image, n));
  }
  for (int i = 0; i < kImages; ++i) {
    const int n = kLearningImages + i;
    const auto parts = capture::synthetic_parts(world, world.period_s * i / kImages);
    const hull::ObjectPixels object = true_pixels(parts, config::published_camera(camera));
    cv::Mat image = renderer.image(parts, camera.camera_from_mount);
    if (disturbance == Disturbance::camouflage) camouflage(image, room, object);
    if (disturbance == Disturbance::waving) {
      cv::Mat background = room.clone();
      leaves.draw(background, std::uint64_t(n));
      object.for_each_run({0, 0, width_px, height_px}, [&](int v, int begin, int end) {
        std::copy(image.ptr(v) + 3 * begin, image.ptr(v) + 3 * end, background.ptr(v) + 3 * begin);
      });
      image = background;
    }
    result.images.push_back(finished(image, n));
    result.truth.push_back(object);
  }
  return result;
}

}  // namespace fivepipe::capture_bench
