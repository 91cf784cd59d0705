// The viewer: pinholes of its two images, the path of its head, and its eyes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/config/view/head_path.h"
#include "common/config/view/viewer.h"

namespace fivepipe::config {

namespace {

// Minimum sine of the angle between viewing direction and up. Below it (a twentieth of a pixel's
// angle), the image has no defined up direction.
constexpr double kMinSineToUp = 1e-4;
constexpr int kChecksPerSegment = 64;
// First and last keys closer than this are one pose: the path is closed.
constexpr double kSamePose_m = 1e-9;

struct EyeAndTarget {
  Eigen::Vector3d eye_world_m, target_world_m;
};

EyeAndTarget operator-(const HeadKey& a, const HeadKey& b) {
  return {a.eye_world_m - b.eye_world_m, a.target_world_m - b.target_world_m};
}

bool is_closed(const std::vector<HeadKey>& path) {
  const EyeAndTarget gap = path.back() - path.front();
  return gap.eye_world_m.norm() < kSamePose_m && gap.target_world_m.norm() < kSamePose_m;
}

// Returns the Catmull-Rom tangent [m/s] at a key: the chord between its neighbours, divided by
// their time difference. On a closed path, the neighbours wrap around; on an open one, the first
// and last keys have one neighbour.
EyeAndTarget velocity_at(const std::vector<HeadKey>& path, std::size_t key) {
  const std::size_t last = path.size() - 1;
  const bool goes_round = is_closed(path) && (key == 0 || key == last);
  const HeadKey& before = goes_round ? path[last - 1] : path[key == 0 ? 0 : key - 1];
  const HeadKey& after = goes_round ? path[1] : path[std::min(key + 1, last)];
  const double duration_s = goes_round ? (path[last].t_s - before.t_s) + (after.t_s - path[0].t_s)
                                       : after.t_s - before.t_s;
  const EyeAndTarget chord = after - before;
  return {chord.eye_world_m / duration_s, chord.target_world_m / duration_s};
}

// Interpolates by a cubic Hermite curve in the segment from key to key + 1.
EyeAndTarget pose_in_segment(const std::vector<HeadKey>& path, std::size_t key, double t_s) {
  const HeadKey &a = path[key], &b = path[key + 1];
  const double duration_s = b.t_s - a.t_s, u = (t_s - a.t_s) / duration_s;
  const double at_b = u * u * (3 - 2 * u), at_a = 1 - at_b,
               along_a_s = u * (1 - u) * (1 - u) * duration_s,
               along_b_s = u * u * (u - 1) * duration_s;
  const EyeAndTarget va = velocity_at(path, key), vb = velocity_at(path, key + 1);
  return {at_a * a.eye_world_m + at_b * b.eye_world_m + along_a_s * va.eye_world_m +
              along_b_s * vb.eye_world_m,
          at_a * a.target_world_m + at_b * b.target_world_m + along_a_s * va.target_world_m +
              along_b_s * vb.target_world_m};
}

bool has_up_direction(const EyeAndTarget& pose) {
  return config::has_up_direction(pose.eye_world_m, pose.target_world_m, Eigen::Vector3d::UnitZ());
}

}  // namespace

bool has_up_direction(const Eigen::Vector3d& eye_m, const Eigen::Vector3d& target_m,
                      const Eigen::Vector3d& up) {
  return (target_m - eye_m).normalized().cross(up).norm() > kMinSineToUp;
}

geometry::Pinhole render_pinhole(const Viewer& viewer) {
  return geometry::pinhole_from_fov(viewer.render_width_px, viewer.render_height_px,
                                    viewer.horizontal_fov_rad);
}

geometry::Pinhole recon_pinhole(const Viewer& viewer) {
  return geometry::resized(render_pinhole(viewer), viewer.recon_width_px, viewer.recon_height_px);
}

Eigen::Isometry3d eye_from_world_at(const Viewer& viewer, double t_s) {
  const std::vector<HeadKey>& path = viewer.path;
  if (path.size() == 1) return geometry::look_at(path[0].eye_world_m, path[0].target_world_m);
  const double period_s = path.back().t_s;
  const double in_period_s = t_s - period_s * std::floor(t_s / period_s);
  const auto after = std::upper_bound(path.begin() + 1, path.end() - 1, in_period_s,
                                      [](double t, const HeadKey& key) { return t < key.t_s; });
  const EyeAndTarget pose = pose_in_segment(path, after - path.begin() - 1, in_period_s);
  return geometry::look_at(pose.eye_world_m, pose.target_world_m);
}

std::vector<double> eye_positions_m(const Viewer& viewer) {
  if (!viewer.eye_distance_m) return {0};
  return {-0.5 * *viewer.eye_distance_m, 0.5 * *viewer.eye_distance_m};
}

Eigen::Isometry3d eye_at(double x_m, const Eigen::Isometry3d& head_from_world) {
  Eigen::Isometry3d eye_from_world = head_from_world;
  eye_from_world.translation().x() -= x_m;
  return eye_from_world;
}

int composite_width_px(const Viewer& viewer) {
  return int(eye_positions_m(viewer).size()) * viewer.render_width_px;
}

std::vector<HeadPathFault> head_path_faults(const std::vector<HeadKey>& path) {
  std::vector<HeadPathFault> faults;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (i == 0 && path[i].t_s != 0)
      faults.push_back({i, fmt::format("t_s of the first key must be 0, is {}", path[i].t_s)});
    if (i > 0 && !(path[i].t_s > path[i - 1].t_s))
      faults.push_back(
          {i, fmt::format("t_s must be greater than that of the previous key ({}), is {}",
                          path[i - 1].t_s, path[i].t_s)});
    if (!has_up_direction({path[i].eye_world_m, path[i].target_world_m}))
      faults.push_back({i,
                        "the target is at the eye, or straight above or below it: the view has no "
                        "up direction"});
  }
  if (!faults.empty()) return faults;
  for (std::size_t i = 0; i + 1 < path.size(); ++i)
    for (int step = 1; step < kChecksPerSegment; ++step)
      if (!has_up_direction(pose_in_segment(
              path, i, path[i].t_s + (path[i + 1].t_s - path[i].t_s) * step / kChecksPerSegment))) {
        faults.push_back({i,
                          "between this key and the next, the eye looks straight up or down: the "
                          "view has no up direction"});
        break;
      }
  return faults;
}

}  // namespace fivepipe::config
