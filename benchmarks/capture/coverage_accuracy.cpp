#include "benchmarks/capture/coverage_accuracy.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>

#include "capture_node/segmentation/segmentation.h"
#include "capture_node/synthetic/noise/sensor_noise.h"
#include "capture_node/synthetic/render.h"
#include "common/base/timing.h"
#include "common/hull/coverage/coverage_hull.h"
#include "common/hull/coverage/thin_coverage.h"

namespace fivepipe::capture_bench {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kRaysPerAxis = 4;  // of a pixel
constexpr int kLearningImages = 24;
// One ray of this many is compared with the truth, which takes long.
constexpr std::size_t kComparedRay = 3;
constexpr std::array kAllMaps{MapKind::centre, MapKind::segmented, MapKind::exact_coverage,
                              MapKind::estimated_coverage};

// One camera that looks at the synthetic world.
class Imaged {
 public:
  Imaged(const config::SyntheticWorld& world, const config::RigCamera& camera, std::uint64_t number)
      : camera_(camera),
        number_(number),
        noise_(world.noise_sigma_levels),
        renderer_(world, capture::with_finer_pixels(camera, kRaysPerAxis),
                  std::make_shared<const capture::Surroundings>(world.seed)) {
    const cv::Mat empty = exact({});
    std::vector<cv::Mat> learning;
    for (int i = 0; i < kLearningImages; ++i) learning.push_back(with_noise(empty.clone()));
    segmenter_.emplace(capture::learn_background(learning), config::SegmentationConfig());
  }
  cv::Mat image(const std::vector<capture::SyntheticPart>& parts) {
    return with_noise(exact(parts));
  }
  capture::Segmenter& segmenter() { return *segmenter_; }
  geometry::Camera camera() const { return config::published_camera(camera_); }

 private:
  cv::Mat exact(const std::vector<capture::SyntheticPart>& parts) {
    return capture::mean_of_pixels(renderer_.image(parts, camera_.camera_from_mount), kRaysPerAxis);
  }
  cv::Mat with_noise(cv::Mat bgr) {
    noise_.add(bgr, ++images_ * 1000 + number_);
    return bgr;
  }

  config::RigCamera camera_;
  std::uint64_t number_, images_ = 0;
  capture::SensorNoise noise_;
  capture::SyntheticCamera renderer_;
  std::optional<capture::Segmenter> segmenter_;
};

// The maps of all cameras in one pose.
struct Pose {
  std::vector<hull::Capsule> object;
  std::vector<hull::Silhouette> centre, segmented;
  std::vector<hull::CoverageOutline> exact, estimated;  // of `centre` and of `segmented`
};

Pose pose_of(std::vector<Imaged>& cameras, const config::SyntheticWorld& world, double t_s) {
  Pose pose;
  const std::vector<capture::SyntheticPart> parts = capture::synthetic_parts(world, t_s);
  for (const capture::SyntheticPart& part : parts)
    pose.object.push_back(std::get<hull::Capsule>(part.shape));
  for (Imaged& one : cameras) {
    const geometry::Camera camera = one.camera();
    pose.centre.push_back(
        {camera, hull::true_object_pixels(pose.object, camera, hull::PixelRule::center)});
    pose.exact.push_back(
        hull::true_coverage(pose.object, camera).outline(pose.centre.back().pixels));
    const cv::Mat image = one.image(parts);
    const capture::Segmentation found = *one.segmenter().segment(image);
    pose.segmented.push_back({camera, found.object});
    pose.estimated.push_back(
        hull::preserve_thin(one.segmenter().coverage(image, found)).outline(found.object));
  }
  return pose;
}

std::vector<hull::CoverageSilhouette> covered(const std::vector<hull::Silhouette>& silhouettes,
                                              const std::vector<hull::CoverageOutline>& outlines) {
  std::vector<hull::CoverageSilhouette> all;
  for (std::size_t i = 0; i < silhouettes.size(); ++i)
    all.push_back(
        {silhouettes[i].camera, hull::SparseCoverageMap(silhouettes[i].pixels, outlines[i])});
  return all;
}

// Keeps its memory from pose to pose, as recon_node does.
class Reconstruction {
 public:
  explicit Reconstruction(base::WorkerPool& pool) : binary_(pool), coverage_(pool) {}
  void depths(const Pose& pose, MapKind maps, const hull::View& view, hull::DepthTile& tile) {
    switch (maps) {
      case MapKind::centre: binary_.assign(pose.centre); break;
      case MapKind::segmented: binary_.assign(pose.segmented); break;
      case MapKind::exact_coverage: coverage_.assign(covered(pose.centre, pose.exact)); break;
      case MapKind::estimated_coverage:
        coverage_.assign(covered(pose.segmented, pose.estimated));
        break;
    }
    if (maps == MapKind::centre || maps == MapKind::segmented)
      binary_.depth(view, tile.rect, tile.depth_m);
    else
      coverage_.depth(view, tile.rect, tile.depth_m);
  }

 private:
  hull::CpuHull binary_;
  hull::CoverageHull coverage_;
};

// First depth in [near_m, far_m] at which the ray is in the hull of the true silhouettes.
std::optional<double> true_depth_m(const std::vector<hull::Capsule>& object,
                                   const std::vector<geometry::Camera>& cameras,
                                   const geometry::Ray& ray, double near_m, double far_m) {
  constexpr double kStep_m = 1e-3;
  const auto inside = [&](double t) {
    return hull::in_analytic_hull(object, cameras, ray.origin_world_m + t * ray.direction_world);
  };
  for (double t = near_m + kStep_m; t < far_m; t += kStep_m) {
    if (!inside(t)) continue;
    double out = t - kStep_m, in = t;
    for (int i = 0; i < 30; ++i) (inside(0.5 * (out + in)) ? in : out) = 0.5 * (out + in);
    return in;
  }
  return std::nullopt;
}

void add_errors(const Pose& pose, const hull::View& view, const std::vector<hull::DepthTile>& tiles,
                CoverageAccuracy& all) {
  std::vector<geometry::Camera> cameras;
  for (const hull::Silhouette& s : pose.centre) cameras.push_back(s.camera);
  const int width = view.camera.pinhole.width_px;
  for (std::size_t i = 0; i < tiles[0].depth_m.size(); i += kComparedRay) {
    double nearest_m = hull::kNoHull, farthest_m = 0;
    std::size_t hits = 0;
    for (const hull::DepthTile& tile : tiles)
      if (const double depth_m = tile.depth_m[i]; depth_m != hull::kNoHull) {
        nearest_m = std::min(nearest_m, depth_m);
        farthest_m = std::max(farthest_m, depth_m);
        ++hits;
      }
    if (hits == 0) continue;
    const geometry::Ray ray =
        geometry::ray_through(view.camera, Vector2d(int(i) % width, int(i) / width));
    const double from_m = nearest_m - kSearch_m;
    if (hull::in_analytic_hull(pose.object, cameras,
                               ray.origin_world_m + from_m * ray.direction_world))
      continue;  // the true hull begins before
    ++all.rays;
    const auto truth_m = true_depth_m(pose.object, cameras, ray, from_m, farthest_m + kSearch_m);
    for (std::size_t m = 0; m < tiles.size(); ++m) {
      const double depth_m = tiles[m].depth_m[i];
      all.rows[m].missed += truth_m && depth_m == hull::kNoHull;
      all.rows[m].extra += !truth_m && depth_m != hull::kNoHull;
      if (truth_m && hits == tiles.size())
        all.rows[m].error_mm.push_back(1e3 * std::abs(depth_m - *truth_m));
    }
  }
}

}  // namespace

std::string name_of(MapKind maps) {
  switch (maps) {
    case MapKind::centre: return "binary, by pixel centres";
    case MapKind::segmented: return "binary, segmented";
    case MapKind::exact_coverage: return "coverage, exact";
    case MapKind::estimated_coverage: return "coverage, from images";
  }
  return "";
}

CoverageAccuracy measure_coverage(const config::Rig& rig, int poses, int timed_runs) {
  const config::SyntheticWorld world;
  std::vector<Imaged> cameras;
  for (const config::RigCamera& camera : rig.cameras)
    if (camera.gives_shape && camera.mount == config::Mount::world)
      cameras.emplace_back(world, camera, cameras.size());
  const hull::View view{{geometry::pinhole_from_fov(320, 240, 65 * M_PI / 180),
                         geometry::look_at({0.0, -0.75, 0.55}, {0.0, 0.05, 0.2})},
                        0.05,
                        5};
  CoverageAccuracy all;
  for (const MapKind maps : kAllMaps) all.rows.push_back({maps, {}, {}, 0, 0});
  base::WorkerPool pool(1);
  Reconstruction reconstruction(pool);
  const hull::PixelRect whole{0, 0, view.camera.pinhole.width_px, view.camera.pinhole.height_px};
  for (int i = 0; i < poses; ++i) {
    const Pose pose = pose_of(cameras, world, world.period_s * (i + 0.3) / poses);
    std::vector<hull::DepthTile> tiles(kAllMaps.size(),
                                       {whole, std::vector<float>(whole.area_px())});
    for (std::size_t m = 0; m < kAllMaps.size(); ++m)
      reconstruction.depths(pose, kAllMaps[m], view, tiles[m]);
    add_errors(pose, view, tiles, all);
    for (int run = 0; run < timed_runs; ++run)
      for (CoverageRow& row : all.rows) {
        const auto start = std::chrono::steady_clock::now();
        reconstruction.depths(pose, row.maps, view, tiles[0]);
        row.time_ms.push_back(1e3 * base::seconds_since(start));
      }
  }
  return all;
}

}  // namespace fivepipe::capture_bench
