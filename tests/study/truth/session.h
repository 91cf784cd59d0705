// Scripted sessions of the shipped deployments payload and engine, and what a spacing study of them
// finds, from the actors' geometry, from the exact silhouette cones, and from maps.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "common/study/spacing_study.h"
#include "tests/study/truth/cone_hull.h"

namespace fivepipe::test {

struct Session {
  // part: the object that moves along axis_world. gap_m: the spacing at which the scene has it.
  // range: of spacings.
  Session(const std::string& deployment, const std::map<std::string, std::string>& settings,
          const std::string& part, const Eigen::Vector3d& axis_world, double gap_m,
          const SpacingInterval& range);

  std::vector<capture::SyntheticPart> parts_at(double t_s) const;
  double gap_of(double moved_m) const { return gap_m + moved_m; }

  config::Deployment deployment;
  config::SyntheticWorld world;
  std::vector<config::RigCamera> rig_cameras;  // those that give shape
  std::vector<geometry::Camera> cameras;
  BoxOnAxis box;
  collision::MovablePart part;
  double gap_m;
  SpacingInterval moved_range;  // of the part, from where the scene has it
};

// Payload A above the PMT box. Spacings from 10 to 34 cm.
Session payload_session(const std::map<std::string, std::string>& settings);
// The battery beside the engine block. Spacings from 5 to 60 cm.
Session engine_session(const std::map<std::string, std::string>& settings);

// The spacings at which the part is free in every frame. All lists are in spacings (gap_of).
std::vector<SpacingInterval> truly_free(const Session& session, std::span<const double> times_s);
// The same for the study, on these maps.
std::vector<SpacingInterval> studied_free(const Session& session,
                                          const std::vector<std::vector<hull::Silhouette>>& frames);

// Where the hull of the exact cones ends, over all frames.
struct HullEnd {
  double gap_m;                // a spacing at which the part meets the hull
  double error_m;              // the end is at most this far from there
  double time_s;               // of the frame in which it is
  Eigen::Vector3d at_world_m;  // centre of the footprint, at the height of the end
};
inline constexpr double kConeTolerance_m = 0.1e-3;  // of error_m
// The least spacing above which the part is free up to a spacing that is free.
HullEnd hull_end_below(const Session& session, std::span<const double> times_s, double free_gap_m);
// The largest spacing below which it is free from there.
HullEnd hull_end_above(const Session& session, std::span<const double> times_s, double free_gap_m);

// Width of a map pixel at a point, of the camera for which it is largest [m].
double footprint_m(const Session& session, const Eigen::Vector3d& p_world_m);

// Maps of the exact silhouettes: a pixel is set if its centre is in one.
std::vector<std::vector<hull::Silhouette>> exact_maps(const Session& session,
                                                      std::span<const double> times_s);
// Maps as capture_node makes them, from images with noise. The times are rounded to frames of
// 30 Hz.
std::vector<std::vector<hull::Silhouette>> segmented_maps(const Session& session,
                                                          std::span<const double> times_s,
                                                          double noise_sigma_levels);

// Times of frames at 30 Hz in the first half of the period: every step-th one, and at most
// `critical` of those in which the part, coming from large spacings, meets a shape within 1 mm of
// the first contact.
std::vector<double> session_times(const Session& session, int step, int critical);

}  // namespace fivepipe::test
