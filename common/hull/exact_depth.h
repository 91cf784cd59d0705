// Backend `exact`: the first hull point of every ray of a view, on the CPU, exact to rounding in double.
// Source: the exact step of the design's "Rays": a point outside one camera's silhouette stays outside until the ray's image
// leaves the empty region around it, at a parameter that follows from the projection in closed form; the first parameter at
// which all cameras see the ray inside is the hull's first point.
#pragma once
#include <span>
#include <vector>

#include "common/hull/empty_space.h"
#include "common/hull/hull.h"

namespace fivepipe {

// One frame set made ready for any number of views and tiles. Immutable: threads may share it.
class ExactHull {
 public:
  explicit ExactHull(std::span<const Silhouette> silhouettes);  // copies what it needs

  // rect in the view's pixels, inside its image or not. The result does not depend on the order of the silhouettes, nor on
  // how a view is divided into rects. Silhouettes or views that are not finite have no hull.
  DepthTile depth(const View& view, const PixelRect& rect) const;

 private:
  struct MapCamera {
    Camera camera;
    EmptySpace space;
  };
  std::vector<MapCamera> cameras_;
  bool empty_ = false;  // no camera, one without an object pixel, or one that is not finite
};

DepthTile exact_depth(std::span<const Silhouette> silhouettes, const View& view, const PixelRect& rect);

}  // namespace fivepipe
