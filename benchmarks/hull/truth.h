// How wrong a method's depths are: against the exact hull of the same maps, by the independent
// reference, and against the object.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "benchmarks/hull/scenes.h"
#include "common/hull/oracle/reference.h"

namespace fivepipe::hull_bench {

struct Errors {
  std::vector<double> depth_mm;  // of rays that both hit; without those that hit another piece
  std::vector<double> all_mm;    // with them
  int wrong_hits = 0, wrong_misses = 0,
      wrong_pieces = 0;  // wrong_pieces: passed through the first piece, hit one further than the
                         // spacing behind
  int rays = 0, reference_hits = 0;
  std::vector<double> surface_mm;  // against the hull of the true silhouettes
  // Exact methods alone, over every pixel of the view against backend cpu: another verdict; the
  // largest relative difference.
  int other_pixels = 0;
  double other_depth = 0;
};

// The exact answer on seeded rays of one view: half of them anywhere, half where the hull is seen;
// of the latter, some against the object itself.
class Truth {
 public:
  // cpu_depth_m: of the whole view, by backend cpu: where rays are drawn, and what exact methods
  // are compared with.
  Truth(const HullScene& scene, const hull::View& view, std::vector<float> cpu_depth_m, int rays,
        int surface_rays);
  Errors errors_of(std::span<const float> depth_m, double spacing_mm, bool exact) const;

 private:
  struct TrueRay {
    std::size_t pixel;
    std::optional<hull::Interval> first;  // piece of the hull
    std::optional<double> surface_m;      // of the hull of the true silhouettes, where asked
  };
  std::vector<TrueRay> rays_;
  std::vector<float> cpu_depth_m_;
};

}  // namespace fivepipe::hull_bench
