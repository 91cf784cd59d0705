// What one thread needs to examine the hull of one frame.
#pragma once
#include <memory>
#include <optional>
#include <span>

#include "common/base/worker_pool.h"
#include "common/collision/detection/cpu/cpu_detector.h"
#include "common/hull/query/hull_query.h"

namespace fivepipe::study {

struct FrameHull {
  FrameHull(const hull::HullRule& hull_rule, double detector_eps_m)
      : rule(hull_rule),
        eps_m(detector_eps_m),
        detector(collision::cpu_detector({.eps_m = eps_m, .spacing_m = 0})) {}

  // The silhouettes must outlive the next call.
  void set(std::span<const hull::Silhouette> silhouettes) {
    hull.assign(silhouettes, rule);
    query.emplace(hull);
    detector->set_hull(*query, silhouettes);
  }
  // A camera is not finite: nothing is known about the frame.
  bool is_unknown() const { return hull.unusable(); }
  bool is_empty() const { return hull.empty() && !hull.unusable(); }

  hull::HullRule rule;
  double eps_m;
  base::WorkerPool pool{1};
  hull::CpuHull hull{pool};
  std::optional<hull::HullQuery> query;
  std::unique_ptr<collision::CollisionDetector> detector;
};

}  // namespace fivepipe::study
