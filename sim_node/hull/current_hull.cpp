#include "sim_node/hull/current_hull.h"

#include <cassert>

#include "common/collision/detection/cpu/cpu_detector.h"
#include "common/collision/detection/gl/gl_detector.h"
#include "common/collision/detection/paper/paper_detector.h"

namespace fivepipe::sim {
namespace {

// Limit on an object's collision points, from which its response is computed.
constexpr std::size_t kPointsForResponse = 4096;

std::unique_ptr<collision::CollisionDetector> detector_for(const config::SimConfig& config) {
  if (config.collision == config::CollisionBackend::paper)
    return collision::paper_detector(config.window_px, config.viewport_px);
  const collision::DetectionOptions options{
      .eps_m = config.eps_m, .spacing_m = config.spacing_m, .max_points = kPointsForResponse};
  return config.collision == config::CollisionBackend::gl ? collision::gl_detector(options)
                                                          : collision::cpu_detector(options);
}

}  // namespace

CurrentHull::CurrentHull(const config::Scene& scene, const config::SimConfig& config,
                         bool is_needed, const Eigen::AlignedBox3d& real_volume_world_m)
    : is_needed_(is_needed),
      pool_(config.threads),
      rule_(config.hull_rule),
      detector_(detector_for(config)) {
  if (scene.history)
    history_.emplace(*scene.history, real_volume_world_m, pool_, scene.objects.size(), rule_);
}

std::span<const hull::CoverageSilhouette> CurrentHull::coverage() {
  if (coverage_.empty())
    for (std::size_t i = 0; i < outlines_.size(); ++i)
      coverage_.push_back(
          {silhouettes_[i].camera, hull::SparseCoverageMap(silhouettes_[i].pixels, outlines_[i])});
  return coverage_;
}

void CurrentHull::set(double time_s, std::span<const hull::Silhouette> silhouettes,
                      std::span<const hull::CoverageOutline> outlines) {
  assert(outlines.empty() || outlines.size() == silhouettes.size());
  time_s_ = time_s;
  silhouettes_ = silhouettes;
  outlines_ = outlines;
  coverage_.clear();
  ++frames_;
  if (history_) {
    history_->add(time_s, silhouettes);
    query_ = &history_->query();
    parts_ = history_->parts();
  } else if (is_needed_) {
    hull_.assign(silhouettes, rule_);
    query_ = &own_query_.emplace(hull_);
    parts_.resize(1);
  }
  if (query_) detector_->set_hull(*query_, silhouettes);
}

std::span<collision::ObjectCollision> CurrentHull::detect(
    std::span<const collision::DetectionObject> objects) {
  const std::span<collision::ObjectCollision> collisions = detector_->detect(objects);
  counts_ = detector_->counts();
  return collisions;
}

collision::Requery CurrentHull::requery(const collision::DetectionObject& object) {
  return [this, object](const Eigen::Vector3d& move_world_m) {
    collision::DetectionObject moved = object;
    moved.world_from_object = Eigen::Translation3d(move_world_m) * moved.world_from_object;
    moved.rp_object_world_m += move_world_m;
    return std::move(detector_->detect({&moved, 1}).front());
  };
}

}  // namespace fivepipe::sim
