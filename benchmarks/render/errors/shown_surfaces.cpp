#include "benchmarks/render/errors/shown_surfaces.h"

#include <algorithm>

namespace fivepipe::render_bench {
namespace {

// A black surface is drawn as 0. The darkest white one faces away from the light and downwards, and
// has the dark cells of a checker: 0.07 * 0.62 of the light, 58 levels in sRGB.
constexpr int kWhite_levels = 30;

config::Scene with_colours_of_bit(config::Scene scene, const SurfaceNumbers& numbers, int bit) {
  const auto colour = [&](int number) {
    const double level = number >> bit & 1;
    return std::array<double, 3>{level, level, level};
  };
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    scene.objects[i].colour_rgb = colour(numbers.object(i));
  for (std::size_t i = 0; i < scene.particles.size(); ++i)
    scene.particles[i].colour_rgb = colour(numbers.particle(i));
  scene.background_rgb = colour(SurfaceNumbers::kBackground);
  return scene;
}

}  // namespace

SurfaceNumbers::SurfaceNumbers(const config::Scene& scene)
    : objects(int(scene.objects.size())), bits(1) {
  while ((1 << bits) - 1 <= objects + int(scene.particles.size())) ++bits;
  hull = (1 << bits) - 1;
}

ShownSurfaces::ShownSurfaces(const config::Scene& scene, const config::Viewer& viewer)
    : numbers_(scene) {
  for (int bit = 0; bit < numbers_.bits; ++bit)
    renderers_.emplace_back(with_colours_of_bit(scene, numbers_, bit), viewer);
}

cv::Mat ShownSurfaces::of(const render::HullFrame& hull,
                          std::span<const render::ParticleCloud> particles,
                          const render::HullFrame* light_hull) {
  render::HullFrame white = hull;
  std::fill(white.bgr.begin(), white.bgr.end(), std::uint8_t(255));
  cv::Mat shown;
  for (int bit = 0; bit < numbers_.bits; ++bit) {
    renderers_[std::size_t(bit)].draw(white, {}, {}, particles, light_hull);
    const cv::Mat image = renderers_[std::size_t(bit)].image_bgr();
    if (shown.empty()) shown = cv::Mat::zeros(image.size(), CV_16U);
    for (int v = 0; v < image.rows; ++v)
      for (int u = 0; u < image.cols; ++u)
        shown.at<std::uint16_t>(v, u) |=
            std::uint16_t((image.at<cv::Vec3b>(v, u)[1] > kWhite_levels) << bit);
  }
  return shown;
}

}  // namespace fivepipe::render_bench
