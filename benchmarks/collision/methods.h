// The methods that the collision benchmark times: each collides one frame's maps with a scene's
// virtual objects.
#pragma once
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "benchmarks/collision/scenes.h"
#include "common/collision/detection/detection.h"

namespace fivepipe::collision_bench {

// The times of one frame.
struct Times {
  double maps_ms = 0;   // preparation of the maps that other queries of the frame share
  double build_ms = 0;  // structures that the method builds from the maps for itself
  double query_ms = 0;  // the rest, including the refit of deformed objects
  double own_ms() const { return build_ms + query_ms; }
};

struct Answer {
  std::vector<collision::ObjectCollision> objects;  // in the scene's order
  Times times;
  std::map<std::string, double> counts;  // further counts for the JSON, for example "samples"
};

// To add a method, write a function that returns it and a line in methods_for() in
// bench_collision.cpp.
struct Method {
  std::string name, setting;  // "paper10", "400": result paper10/curtain720/400/1
  int threads;
  // Computes one frame. May keep buffers, and trees over objects in their own frames, from call to
  // call, but no results. The next call may have another scene.
  std::function<Answer(const CollisionScene&)> run;
};

// Backend cpu (cpu_detection.h). Returns verdicts within eps and, with `points`, CP_i at most eps
// apart.
Method cpu_method(double eps_mm, bool points, int threads);
// Backend gl (gl_detection.h), the same in compute shaders. Needs a current OpenGL context.
// `threads` applies to llvmpipe and to the part left to the CPU. The upload of the maps, and of the
// trees that moved, counts as its own time.
Method gl_method(double eps_mm, bool points, int threads);
// The paper's backend on OpenGL (paper_detection.h). Needs a current OpenGL context; llvmpipe uses
// `threads`.
Method paper_method(int viewport_px, int window_px, int threads);
// Baselines.
Method brute_method(int across, int threads);
// Each frame polygonises the hull near the objects and builds its tree. Rigid objects do not move,
// so their trees are built once. Throws std::logic_error unless why_no_fcl() is empty.
Method fcl_method(double cell_mm, int threads);
std::string why_no_fcl();  // why fcl_method is missing from this build; empty if it is not

// Returns the duration of `work` in milliseconds.
double timed_ms(const std::function<void()>& work);

}  // namespace fivepipe::collision_bench
