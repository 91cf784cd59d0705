// The collision benchmark's results: as a table, as JSON, as plots.
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "benchmarks/collision/responses.h"
#include "benchmarks/collision/truth.h"

namespace fivepipe::collision_bench {

struct Result {
  std::string method, scene, setting;
  int threads = 0, cameras = 0, objects = 0;
  std::vector<double> maps_ms, build_ms, query_ms, own_ms,
      total_ms;  // of each run; own: build and query; total: maps and response too
  std::vector<double> response_ms;  // empty: none, or not told
  std::optional<double> refit_ms;   // of query_ms
  std::optional<ResponseErrors> response;
  TruthCounts truth;
  VerdictErrors wrong;
  std::size_t colliding = 0, points = 0;  // said
  std::map<std::string, double> counts;   // the method's own
  std::string name() const;               // "paper10/curtain720/400/1"
  double triangles_per_s() const;         // of the scene, by the best own time
  double contacting_per_s() const;        // of those that truly cross alone
};

void print(const std::vector<Result>& results);
// Stage by stage, for methods that have a response, and its error for the same CP_obj and V_rec.
void print_responses(const std::vector<Result>& results);
// What the others take as long as, and gain over, the paper's 10x10 in the same run and over its
// own 4,320 triangles a second.
void print_ratios(const std::vector<Result>& results);
inline constexpr double kPaperTriangles_per_s =
    4320;  // section 4.4.2: 720 triangles, 6 frames a second; 13,000 with its three cameras counted

std::string json_of(const Result& result);

// Time against the deepest missed contact, and against missed triangles. False where there is no
// gnuplot.
bool plot(const std::vector<Result>& results, const std::filesystem::path& file);

}  // namespace fivepipe::collision_bench
