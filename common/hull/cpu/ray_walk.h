// Walks one ray through the maps of all cameras in double: the exact part of every query along a
// ray.
//
// Between two pixel borders a camera's verdict on the ray's points does not change. A walk through
// one map returns the verdict just after a parameter t and the end of its span. It crosses a box of
// equal pixels in one step, to where the ray's image leaves the box; that parameter follows from
// the projection in closed form.
#pragma once
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "common/hull/cpu/skip_map.h"
#include "common/hull/hull.h"
#include "common/hull/map_from_view.h"

namespace fivepipe::hull {

inline constexpr double kNever = std::numeric_limits<double>::infinity();

// The direction of a ray's image is a difference of two terms. It is certain if the difference is
// larger than this fraction of the terms, which is far above the rounding of float.
inline constexpr double kUncertainDirection = 1e-4;

// Ray parameters [begin, end).
struct RayRange {
  double begin, end;
  bool empty() const { return !(begin < end); }
};

// Parameter at which a ray's image crosses a pixel border of one axis. All backends use this
// formula, so that their bits agree.
inline double border_crossing(double offset, double slope, double w_offset, double w_slope,
                              double border) {
  return (border * w_offset - offset) / (slope - border * w_slope);
}

// The image of one ray in one map: (U, V, W)(t) = offset + t * slope. Pixel p covers [p, p + 1) of
// U / W.
struct ImageLine {
  double u_offset, u_slope, v_offset, v_slope, w_offset, w_slope;
};
inline ImageLine image_line(const MapFromView& map, double u_px, double v_px) {
  const auto slope = [&](int row) {
    return map.at_infinity(row, 0) * u_px +
           (map.at_infinity(row, 1) * v_px + map.at_infinity(row, 2));
  };
  return {map.at_eye.x(), slope(0), map.at_eye.y(), slope(1), map.at_eye.z(), slope(2)};
}

// Returns the image of any ray in a camera's map.
ImageLine image_line(const geometry::Camera& camera, const geometry::Ray& ray);

// Returns the part of the range in which the ray is in front of the camera and its image in the
// window; empty if the window is.
RayRange range_in_window(const ImageLine& line, const PixelRect& window, const RayRange& range);

// Returns the part of the range in which the ray is in the box.
RayRange range_in_box(const Eigen::AlignedBox3d& box_world_m, const geometry::Ray& ray,
                      RayRange range);

// Relative slack of a range to which rays are clipped: far above the rounding of clipping, but too
// small to add steps.
inline constexpr double kRangeSlack = 1e-9;
// Returns the part of `all`, slightly widened, from the first to the last parameter at which at
// least `count` of the ranges overlap; empty if that is nowhere. The ranges are parts of `all`.
RayRange overlap_range(std::span<const RayRange> ranges, int count, const RayRange& all);

enum class Verdict { empty, object, unseen };
struct VerdictSpan {
  Verdict verdict;
  double end;  // ray parameter; kNever: to the end of the ray
};

// Returns the part of a camera's map in which rays are walked.
PixelRect walk_window(const geometry::Camera& camera, const SkipMap& skip_map,
                      const HullRule& rule);
// Returns a camera's verdict on a ray outside walk_window().
inline Verdict beyond_window(const HullRule& rule) {
  return rule.limits == Limits::seen ? Verdict::unseen : Verdict::empty;
}

class MapWalk {
 public:
  // The verdict is `beyond` while the ray is outside `window` of the map or not in front of its
  // camera. The window holds all object pixels. The skip map must outlive the walk and have the
  // quadrant into which the ray's image moves.
  MapWalk(const ImageLine& line, const SkipMap& skip_map, const PixelRect& window, Verdict beyond,
          const RayRange& range);

  // Returns the verdict just after t. t must be in the range and not decrease from call to call.
  VerdictSpan verdict_at(double t) {
    if (!(t < verdict_span_.end)) walk_to(t);
    return verdict_span_;
  }

 private:
  void walk_to(double t);
  void enter(double t);
  double position(double offset, double slope, double t) const;

  ImageLine line_;
  const SkipMap* skip_map_;
  PixelRect window_;
  Verdict beyond_;
  RayRange inside_window_;
  bool right_, down_;
  bool in_box_ = false;  // the ray leaves box_ at verdict_span_.end
  bool leaves_by_u_ = false;
  PixelRect box_;  // of equal pixels
  int u_ = 0, v_ = 0;
  VerdictSpan verdict_span_;
};

// The walks of all cameras, combined by the rule. `walks` and `rule` must outlive it.
class RayWalk {
 public:
  RayWalk(std::vector<MapWalk>& walks, const HullRule& rule) : walks_(walks), rule_(rule) {}

  // Returns the first parameter in [t, end) just after which the ray is in the hull, or kNever.
  // The conditions of MapWalk::verdict_at() apply to t.
  double next_entry(double t, double end);
  // Returns the first parameter in (t, end) at which the ray leaves the hull, or end. The ray must
  // be in the hull just after t.
  double next_exit(double t, double end);

 private:
  std::optional<double> empty_until(double t);

  std::vector<MapWalk>& walks_;
  const HullRule& rule_;
};

}  // namespace fivepipe::hull
