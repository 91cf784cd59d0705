// The errors of a method's depths: against the exact hull of the same maps, by the independent
// reference, and against the object.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "benchmarks/hull/scenes.h"
#include "common/hull/oracle/reference.h"

namespace fivepipe::hull_bench {

struct Errors {
  std::vector<double> all_mm;    // of rays for which the method and the reference hit the hull
  std::vector<double> depth_mm;  // of these, without the wrong pieces
  // wrong_pieces: rays that pass through the hull's first piece and hit a later one, more than the
  // method's spacing behind.
  int wrong_hits = 0, wrong_misses = 0, wrong_pieces = 0;
  int rays = 0, reference_hits = 0;
  std::vector<double> surface_mm;  // against the hull of the true silhouettes
  // For exact methods, over every pixel of the view against backend cpu: the number of pixels with
  // another verdict, and the largest relative difference in depth.
  int other_pixels = 0;
  double other_depth = 0;
};

// The exact depths of seeded rays of one view. Half of the rays are anywhere, half hit the hull;
// some of the latter are also compared with the hull of the true silhouettes.
class Truth {
 public:
  // cpu_depth_m is the depth of the whole view by backend cpu. It selects the rays, and exact
  // methods are compared with it.
  Truth(const HullScene& scene, const hull::View& view, std::vector<float> cpu_depth_m, int rays,
        int surface_rays);
  Errors errors_of(std::span<const float> depth_m, double spacing_mm, bool exact) const;

 private:
  struct TrueRay {
    std::size_t pixel;
    std::optional<hull::Interval> first;  // first piece of the hull
    std::optional<double> surface_m;      // depth of the hull of the true silhouettes, if computed
  };
  std::vector<TrueRay> rays_;
  std::vector<float> cpu_depth_m_;
};

}  // namespace fivepipe::hull_bench
