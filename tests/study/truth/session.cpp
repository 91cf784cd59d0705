#include "tests/study/truth/session.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include "capture_node/synthetic/world.h"
#include "tests/support/capture/actor_silhouettes.h"
#include "tests/support/capture/capture_rig.h"
#include "tests/support/hull/test_pool.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

constexpr double kSessionRate_hz = 30;

const config::SceneObject& object_of(const config::Deployment& deployment,
                                     const std::string& name) {
  for (const config::SceneObject& object : deployment.scene.objects)
    if (object.name == name) return object;
  throw std::invalid_argument("no object " + name);
}

std::vector<SpacingInterval> as_gaps(const Session& session,
                                     std::vector<SpacingInterval> intervals) {
  for (SpacingInterval& i : intervals) i = {session.gap_of(i.low_m), session.gap_of(i.high_m)};
  return intervals;
}

HullEnd end_at(const Session& session, double gap_m, double time_s, double height_m) {
  return {gap_m, 0, time_s, session.box.world_from_box * Vector3d(0, 0, height_m)};
}

}  // namespace

Session::Session(const std::string& name, const std::map<std::string, std::string>& settings,
                 const std::string& part_name, const Vector3d& axis_world, double gap,
                 const SpacingInterval& range)
    : deployment(config::load_deployment(
          FIVEPIPE_SOURCE_DIR "/launch/deployments/" + name + ".yaml", settings)),
      world(config::capture_of_all_nodes(deployment).synthetic),
      cameras(cameras_of(deployment.rig)),
      box(box_on_axis(object_of(deployment, part_name).world_from_object,
                      std::get<config::BoxShape>(object_of(deployment, part_name).shape).size_m,
                      axis_world)),
      part(config::mesh_of(object_of(deployment, part_name)),
           object_of(deployment, part_name).world_from_object, axis_world),
      gap_m(gap),
      moved_range{range.low_m - gap, range.high_m - gap} {
  for (const std::size_t i : config::shape_cameras(deployment.rig))
    rig_cameras.push_back(deployment.rig.cameras[i]);
}

std::vector<capture::SyntheticPart> Session::parts_at(double t_s) const {
  return capture::synthetic_parts(world, t_s);
}

Session payload_session(const std::map<std::string, std::string>& settings) {
  return {"payload", settings, "payload_a", Vector3d::UnitZ(), 0.18, {0.10, 0.34}};
}

Session engine_session(const std::map<std::string, std::string>& settings) {
  return {"engine", settings, "battery", Vector3d::UnitX(), 0.22, {0.05, 0.60}};
}

std::vector<SpacingInterval> truly_free(const Session& session, std::span<const double> times_s) {
  std::vector<SpacingInterval> colliding;
  for (const double t_s : times_s)
    for (const SpacingInterval& i : colliding_spacings(session.box, session.parts_at(t_s)))
      colliding.push_back(i);
  return as_gaps(session, complement(united(std::move(colliding)), session.moved_range));
}

std::vector<SpacingInterval> studied_free(
    const Session& session, const std::vector<std::vector<hull::Silhouette>>& frames) {
  study::SpacingStudy study({{session.part, session.moved_range, {}, false}},
                            {.rule = session.deployment.hull_rule}, test_pool());
  for (const std::vector<hull::Silhouette>& silhouettes : frames)
    study.add({silhouettes, 1 / kSessionRate_hz});
  return as_gaps(session, study.results().front().free);
}

HullEnd hull_end_below(const Session& session, std::span<const double> times_s, double free_gap_m) {
  // Heights in the frame of the box, whose lower face is at -half_m.z() if it is not moved.
  const double face_m = -session.box.half_m.z(), top_m = free_gap_m - session.gap_m + face_m;
  double known_m = session.moved_range.low_m + face_m;
  HullEnd end = end_at(session, session.gap_of(known_m - face_m), 0, known_m);
  double limit_m = known_m;
  for (const double t_s : times_s) {
    if (!(known_m < top_m)) break;
    const ConeHull hull(session.parts_at(t_s), session.cameras);
    // Frames that end lower are discarded at once.
    const ConeHull::Bound bound = hull.highest(session.box, {known_m, top_m}, kConeTolerance_m);
    limit_m = std::max(limit_m, bound.max_m);
    if (!(bound.min_m > known_m)) continue;
    known_m = bound.min_m;
    end = end_at(session, session.gap_of(known_m - face_m), t_s, known_m);
  }
  end.error_m = limit_m - known_m;
  return end;
}

HullEnd hull_end_above(const Session& session, std::span<const double> times_s, double free_gap_m) {
  const double face_m = session.box.half_m.z(), bottom_m = free_gap_m - session.gap_m + face_m;
  double known_m = session.moved_range.high_m + face_m;
  HullEnd end = end_at(session, session.gap_of(known_m - face_m), 0, known_m);
  double limit_m = known_m;
  for (const double t_s : times_s) {
    if (!(known_m > bottom_m)) break;
    const ConeHull hull(session.parts_at(t_s), session.cameras);
    const ConeHull::Bound bound = hull.lowest(session.box, {bottom_m, known_m}, kConeTolerance_m);
    limit_m = std::min(limit_m, bound.min_m);
    if (!(bound.max_m < known_m)) continue;
    known_m = bound.max_m;
    end = end_at(session, session.gap_of(known_m - face_m), t_s, known_m);
  }
  end.error_m = known_m - limit_m;
  return end;
}

double footprint_m(const Session& session, const Vector3d& p_world_m) {
  double largest_m = 0;
  for (const geometry::Camera& camera : session.cameras)
    largest_m = std::max(largest_m, (camera.camera_from_world * p_world_m).z() /
                                        std::min(camera.pinhole.fx_px, camera.pinhole.fy_px));
  return largest_m;
}

std::vector<std::vector<hull::Silhouette>> exact_maps(const Session& session,
                                                      std::span<const double> times_s) {
  std::vector<std::vector<hull::Silhouette>> frames;
  for (const double t_s : times_s)
    frames.push_back(silhouettes_of(session.parts_at(t_s), session.cameras));
  return frames;
}

std::vector<std::vector<hull::Silhouette>> segmented_maps(const Session& session,
                                                          std::span<const double> times_s,
                                                          double noise_sigma_levels) {
  config::SyntheticWorld world = session.world;
  world.noise_sigma_levels = noise_sigma_levels;
  std::vector<std::vector<hull::Silhouette>> frames(times_s.size());
  for (const config::RigCamera& rig_camera : session.rig_cameras) {
    TestCamera camera(rig_camera, world, {});
    for (std::size_t i = 0; i < times_s.size(); ++i)
      frames[i].push_back({config::published_camera(rig_camera),
                           camera.segment(std::llround(times_s[i] * kSessionRate_hz))});
  }
  return frames;
}

std::vector<double> session_times(const Session& session, int step, int critical) {
  constexpr double kCritical_m = 1e-3;
  const int frames = int(0.5 * session.world.period_s * kSessionRate_hz);
  std::vector<double> ends_m(std::size_t(frames) + 1);
  for (int frame = 0; frame <= frames; ++frame) {
    const auto colliding =
        colliding_spacings(session.box, session.parts_at(frame / kSessionRate_hz));
    // The last interval in which the part's front meets something: the others may be behind it.
    ends_m[std::size_t(frame)] = -std::numeric_limits<double>::infinity();
    for (const SpacingInterval& i : colliding)
      if (i.high_m < session.moved_range.high_m) ends_m[std::size_t(frame)] = i.high_m;
  }
  const double first_m = *std::ranges::max_element(ends_m);
  std::vector<int> near;
  for (int frame = 0; frame <= frames; ++frame)
    if (ends_m[std::size_t(frame)] >= first_m - kCritical_m) near.push_back(frame);
  std::set<int> chosen;
  for (int frame = 0; frame <= frames && step > 0; frame += step) chosen.insert(frame);
  for (int i = 0; i < critical && !near.empty(); ++i)
    chosen.insert(near[near.size() * std::size_t(i) / std::size_t(critical)]);
  std::vector<double> times_s;
  for (const int frame : chosen) times_s.push_back(frame / kSessionRate_hz);
  return times_s;
}

}  // namespace fivepipe::test
