// The paper's cost model and accuracy law (sections 4.4.2 and 4.4.3), fitted to the times and the
// misses of the paper's backend on this machine.
//
// Cost, for n cameras, m triangles and viewports of u x u in a window of x x y pixels: n m
// transformations, n m u u / 2 filled pixels, x y pixels read back and compared; a response fills
// x y n pixels. Accuracy: a section of the hull is found if it is as large as extent / u.
#pragma once
#include <vector>

namespace fivepipe::collision_bench {

struct CostFit {
  double ns_per_transform = 0, ns_per_fill = 0, ns_per_read = 0;  // >= 0
  // Terms that the paper's model lacks: points confirmed in double, and a constant per query.
  double ns_per_point = 0, fixed_ms = 0;
  double median_off = 0, worst_off = 0;  // residuals relative to the measurement
  int measurements = 0;
};
// ms = fixed_ms + 1e-6 * ns_per_unit * units. A unit is a pixel (x y n in the paper's model), or a
// sample on a line (x n, as our response samples).
struct ResponseFit {
  double fixed_ms = 0, ns_per_unit = 0, worst_off = 0;
};
// The width of a section of the hull by a triangle is the diameter of a disc of the same area, in
// units of the sample spacing sqrt(x y) / u. A section of width `found_from` is found as often as
// it is missed. If the law holds, one value serves all viewports.
struct AccuracyFit {
  double found_from = 0, worst_off = 0;
  struct Viewport {
    int px;
    double found_from, widest_missed;
    int missed, found;
  };
  std::vector<Viewport> viewports;
};
struct PaperModelFits {
  CostFit cost, extended_cost;  // with the paper's terms; with the two additional ones
  ResponseFit response_by_area, response_by_lines;
  AccuracyFit accuracy;
};

// Needs a current OpenGL context. Takes some seconds; `quick`: one second, with fewer measurements.
PaperModelFits fit_paper_models(bool quick);
void print(const PaperModelFits& fits);  // to stdout

}  // namespace fivepipe::collision_bench
