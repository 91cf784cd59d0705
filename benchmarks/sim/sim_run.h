// Runs of a simulation against maps at 30 Hz, with the time of each frame's steps.
#pragma once
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "sim_node/simulation/simulation.h"

namespace fivepipe::sim_bench {

inline constexpr double kFrame_s = 1.0 / 30, kStep_s = 1.0 / 240;
inline constexpr int kStepsPerFrame = 8;

// Cameras in a horizontal circle around the origin, with pixels of 2 mm there.
std::vector<geometry::Camera> cameras_at(int count, double height_m);

struct Result {
  std::string name;              // "bodies/10"
  std::vector<double> step_ms;   // one per frame: frame_ms divided by the number of steps
  std::vector<double> frame_ms;  // all steps of a frame, with the preparation of its hull
  nlohmann::ordered_json error, counts;
  std::string errors;  // of the table
};

// Advances by a frame and records the time.
void advance(sim::Simulation& simulation, int frame, std::span<const hull::Silhouette> silhouettes,
             Result& result);

}  // namespace fivepipe::sim_bench
