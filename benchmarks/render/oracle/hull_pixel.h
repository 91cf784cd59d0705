// What a pixel of the image shows of the hull, in double, by the definition in
// render_node/shaders/hull.frag: the nearest texel decides whether the pixel shows the hull; within
// one surface, colour and 1 / z are interpolated between the four nearest texels.
#pragma once
#include <optional>

#include "render_node/views/tile_assembler.h"

namespace fivepipe::render {

// The texels of a hull. Positions outside its image count as the nearest texel. The hull must
// outlive it.
class HullTexels {
 public:
  explicit HullTexels(const HullFrame& hull) : hull_(hull) {}
  const HullFrame& hull() const { return hull_; }

  double depth_m(int u_px, int v_px) const;       // kNoHull if the texel shows no hull
  Eigen::Vector3d rgb(int u_px, int v_px) const;  // grey levels of 255; only with colour
  bool one_surface(double z_m, double other_m) const;
  // The gradient of 1 / z in this direction, from the neighbours on the same surface.
  double slope(int u_px, int v_px, int du_px, int dv_px) const;

 private:
  std::size_t index(int u_px, int v_px) const;
  const HullFrame& hull_;
};

struct HullPixel {
  double depth_m;
  Eigen::Vector3d rgb;             // grey levels of 255; 0 without colour
  int nearest_u_px, nearest_v_px;  // the texel that decides
};

// Returns what pixel (u, v) of the image shows of the hull, or nullopt if it shows none. The image
// has the field of view of the hull's.
std::optional<HullPixel> hull_pixel(const HullTexels& texels, const geometry::Pinhole& image,
                                    int u_px, int v_px);

// Returns the hull with these depths of the view's pixels, row-major, kNoHull where there is none.
HullFrame frame_of_depths(const geometry::Camera& view, std::vector<float> depth_m);

}  // namespace fivepipe::render
