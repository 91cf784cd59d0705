// The collision benchmark's results as tables and plots.
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/collision/responses.h"
#include "benchmarks/collision/truth.h"

namespace fivepipe::collision_bench {

struct Result {
  std::string method, scene, setting;
  int threads = 0, cameras = 0, objects = 0;
  // Per run. own: build and query. total: own, maps and response.
  std::vector<double> maps_ms, build_ms, query_ms, own_ms, total_ms;
  std::vector<double> response_ms;  // empty if the method has no separate response
  std::optional<double> refit_ms;   // part of query_ms
  std::optional<ResponseErrors> response;
  TruthCounts truth;
  VerdictErrors wrong;
  std::size_t colliding = 0, points = 0;  // triangles and points that the method returned
  std::map<std::string, double> counts;   // the method's own
  std::string name() const;               // "paper10/curtain720/400/1"
  double triangles_per_s() const;         // all triangles of the scene, by the median own time
  double contacting_per_s() const;        // only the triangles that cross the hull
};

void print(const std::vector<Result>& results);  // to stdout
// Prints, for methods with a response, the time of each stage, and the response's errors for the
// same CP_obj and V_rec.
void print_responses(const std::vector<Result>& results);
// Prints the throughput relative to the paper's 10x10 viewports in this run, and to the rate in the
// paper.
void print_ratios(const std::vector<Result>& results);
// Section 4.4.2: 720 triangles at 6 frames/s. Counted once per camera (three) it is 13,000.
inline constexpr double kPaperTriangles_per_s = 4320;

// Plots time against the deepest missed contact. File, result and errors as for
// bench::Plots::draw().
bool plot(const std::vector<Result>& results, const std::filesystem::path& file);

}  // namespace fivepipe::collision_bench
