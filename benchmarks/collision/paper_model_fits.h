// The paper's cost model and accuracy law (sections 4.4.2 and 4.4.3), fitted to what its backend
// takes and misses here.
//
// Cost of n cameras, m triangles, viewports of u x u in a window of x x y: n m transformations, n m
// u u / 2 pixels filled, x y pixels read back and compared; a response fills x y n. Accuracy: what
// is as large as extent / u is found.
#pragma once
#include <string>
#include <vector>

namespace fivepipe::collision_bench {

struct CostFit {
  double ns_per_transform = 0, ns_per_fill = 0, ns_per_read = 0;  // none below 0
  double ns_per_point = 0,
         fixed_ms = 0;  // terms that the paper has not: points confirmed in double; of each query
  double median_off = 0, worst_off = 0;  // residual, relative to the measurement
  int measurements = 0;
};
struct ResponseFit {  // ms = fixed + per_pixel * x y n; and by lines, as our response samples:
                      // fixed + per_sample * x n
  double fixed_ms = 0, ns_per_unit = 0, worst_off = 0;
};
struct AccuracyFit {
  // A section of the hull by a triangle that is `found_from` as wide as the samples' spacing sqrt(x
  // y) / u is found as often as not; width: of a disc of its area. One figure for all viewports if
  // the law holds; of each viewport beside, and the widest section missed at all.
  double found_from = 0, worst_off = 0;
  struct Viewport {
    int px;
    double found_from, widest_missed;
    int missed, found;
  };
  std::vector<Viewport> viewports;
};
struct PaperModelFits {
  CostFit cost, extended_cost;  // by the paper's terms; with ours
  ResponseFit response_by_area, response_by_lines;
  AccuracyFit accuracy;
};

// Needs a current OpenGL context. Some seconds; quick: a second, and coarser.
PaperModelFits fit_paper_models(bool quick);
void print(const PaperModelFits& laws);
std::string json_of(const PaperModelFits& laws);

}  // namespace fivepipe::collision_bench
