#include "benchmarks/hull/truth.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace fivepipe::hull_bench {
namespace {

// The step of the search for the analytic hull's first point, before bisection. Thinner parts may
// be missed.
constexpr double kSurfaceStep_m = 0.5e-3;
// The search covers this distance before and behind the exact hull's point: many pixel footprints.
constexpr double kSurfaceSearch_m = 0.1;

std::optional<double> analytic_depth_m(const HullScene& scene,
                                       const std::vector<geometry::Camera>& cameras,
                                       const geometry::Ray& ray, double near_m, double far_m) {
  const auto inside = [&](double t) {
    return hull::in_analytic_hull(scene.object, cameras,
                                  ray.origin_world_m + t * ray.direction_world);
  };
  for (double t = near_m; t < far_m; t += kSurfaceStep_m) {
    if (!inside(t)) continue;
    double out = t - kSurfaceStep_m, in = t;
    for (int i = 0; i < 20; ++i) (inside(0.5 * (out + in)) ? in : out) = 0.5 * (out + in);
    return in;
  }
  return std::nullopt;
}

}  // namespace

Truth::Truth(const HullScene& scene, const hull::View& view, std::vector<float> cpu_depth_m,
             int rays, int surface_rays)
    : cpu_depth_m_(std::move(cpu_depth_m)) {
  std::vector<geometry::Camera> cameras;
  for (const hull::Silhouette& s : scene.silhouettes) cameras.push_back(s.camera);
  std::vector<std::size_t> hits;
  for (std::size_t i = 0; i < cpu_depth_m_.size(); ++i)
    if (cpu_depth_m_[i] != hull::kNoHull) hits.push_back(i);
  const int width = view.camera.pinhole.width_px;
  std::mt19937_64 random(1);
  for (int n = 0; n < rays; ++n) {
    const bool on_hull = n % 2 && !hits.empty();
    TrueRay ray{on_hull ? hits[random() % hits.size()] : random() % cpu_depth_m_.size(),
                std::nullopt, std::nullopt};
    const geometry::Ray line =
        geometry::ray_through(view.camera, Eigen::Vector2d(double(ray.pixel % std::size_t(width)),
                                                           double(ray.pixel / std::size_t(width))));
    const auto pieces = hull::reference_intervals(scene.silhouettes, line, view.near_m, view.far_m);
    if (!pieces.empty()) ray.first = pieces.front();
    if (on_hull && ray.first && !scene.object.empty() && surface_rays-- > 0)
      ray.surface_m = analytic_depth_m(scene, cameras, line,
                                       std::max(view.near_m, ray.first->enter - kSurfaceSearch_m),
                                       std::min(view.far_m, ray.first->enter + kSurfaceSearch_m));
    rays_.push_back(ray);
  }
}

Errors Truth::errors_of(std::span<const float> depth_m, double spacing_mm, bool exact) const {
  Errors errors;
  for (const TrueRay& ray : rays_) {
    const float depth = depth_m[ray.pixel];
    const bool hit = depth != hull::kNoHull, expected = ray.first.has_value();
    ++errors.rays;
    errors.reference_hits += expected;
    errors.wrong_hits += hit && !expected;
    errors.wrong_misses += !hit && expected;
    if (hit && ray.surface_m)
      errors.surface_mm.push_back(std::abs(double(depth) - *ray.surface_m) * 1000);
    if (!hit || !expected) continue;
    const double error_mm = std::abs(double(depth) - ray.first->enter) * 1000;
    errors.all_mm.push_back(error_mm);
    if (spacing_mm > 0 && float(ray.first->leave) < depth && error_mm > spacing_mm)
      ++errors.wrong_pieces;
    else
      errors.depth_mm.push_back(error_mm);
  }
  for (std::size_t i = 0; exact && i < depth_m.size(); ++i) {
    if ((depth_m[i] == hull::kNoHull) != (cpu_depth_m_[i] == hull::kNoHull))
      ++errors.other_pixels;
    else if (depth_m[i] != hull::kNoHull)
      errors.other_depth =
          std::max(errors.other_depth, std::abs(double(depth_m[i]) / double(cpu_depth_m_[i]) - 1));
  }
  return errors;
}

}  // namespace fivepipe::hull_bench
