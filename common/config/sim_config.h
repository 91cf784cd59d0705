// Settings of the simulation node.
#pragma once
#include "common/hull/hull.h"

namespace fivepipe::config {

// How the simulation finds collisions with the hull. cpu, gl: certified results
// (common/collision/detection/detection.h). paper: samples the hull in OpenGL as the paper does.
enum class CollisionBackend { cpu, gl, paper };

inline constexpr int kMaxCollisionPoints = 1'000'000;  // per object

struct SimConfig {
  CollisionBackend collision = CollisionBackend::cpu;
  int threads = 1;  // for all queries of the hull; any number gives the same bits
  // cpu, gl: a triangle whose part in the hull is thinner than this may stay `undecided`.
  double eps_m = 0.5e-3;
  double spacing_m = 3e-3;  // cpu, gl: maximum distance between neighbouring collision points
  // paper: each triangle is queried in a viewport of viewport_px x viewport_px (section 4.2.4).
  int viewport_px = 10;
  // paper: size of the window that holds the viewports. All backends: number of samples along the
  // lines of a response with search `sampled`.
  int window_px = 400;
  double step_s = 1.0 / 240;  // time step of the simulation
  // Maximum number of collision points published per object; more set the `truncated` flag.
  int max_points = 256;
  hull::HullRule hull_rule = {};  // of the deployment
  bool coverage = false;          // of the deployment: sub-pixel silhouettes
};

}  // namespace fivepipe::config
