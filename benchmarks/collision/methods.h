// Everything that the collision benchmark times: one frame's maps against a scene's virtual
// objects.
#pragma once
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "benchmarks/collision/scenes.h"
#include "common/collision/detection/detection.h"

namespace fivepipe::collision_bench {

// Of one frame. maps: what is made of the maps alone and serves every other query of the frame too.
// build: what the method makes of it for itself. query: the rest, refit of deformed objects
// included.
struct Times {
  double maps_ms = 0, build_ms = 0, query_ms = 0;
  double own_ms() const { return build_ms + query_ms; }
};

struct Answer {
  std::vector<collision::ObjectCollision> objects;  // as the scene's
  Times times;
  std::map<std::string, double> counts;  // what else the method did, into the JSON: "samples"
};

// To add one: a function that makes it, and a line in methods_for() of bench_collision.cpp.
struct Method {
  std::string name, setting;  // "paper10", "400": paper10/curtain720/400/1
  int threads;
  // One frame. Buffers, and trees over objects in their own frames, may be kept from call to call;
  // results may not. The next call may be of another scene.
  std::function<Answer(const CollisionScene&)> run;
};

// Ours (cpu_detection.h): verdicts within eps, with CP_i no farther apart than eps, or the verdict
// alone.
Method cpu_method(double eps_mm, bool points, int threads);
// The same by compute shaders (gl_detection.h): needs a current OpenGL context; threads are
// llvmpipe's, and of what is left to the CPU. Its maps and, where they moved, trees are written to
// the GPU in its own time.
Method gl_method(double eps_mm, bool points, int threads);
// The paper's (TriangleVolumeQuery and detect), on OpenGL: needs a current context; threads are
// llvmpipe's.
Method paper_method(int viewport_px, int window_px, int threads);
// Baselines.
Method brute_method(int across, int threads);
Method fcl_method(
    double cell_mm,
    int threads);  // the hull, where there are objects, polygonised and its tree built each frame;
                   // rigid objects stand still, so that their trees stay as they are
// What is missing here for fcl_method; empty: nothing.
std::string why_no_fcl();

// Milliseconds that work took.
double timed_ms(const std::function<void()>& work);

}  // namespace fivepipe::collision_bench
