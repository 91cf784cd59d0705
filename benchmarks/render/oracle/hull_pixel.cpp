#include "benchmarks/render/oracle/hull_pixel.h"

#include <algorithm>
#include <cmath>

namespace fivepipe::render {
namespace {

// Two texels are one surface if it is tilted by less than 80 degrees, whose tangent this is, and
// their depths differ by less than a half.
constexpr double kMaxTiltTangent = 5.7, kMaxJump = 0.5;

}  // namespace

std::size_t HullTexels::index(int u_px, int v_px) const {
  const geometry::Pinhole& k = hull_.recon;
  return std::size_t(std::clamp(v_px, 0, k.height_px - 1) * k.width_px +
                     std::clamp(u_px, 0, k.width_px - 1));
}

double HullTexels::depth_m(int u_px, int v_px) const { return hull_.depth_m[index(u_px, v_px)]; }

Eigen::Vector3d HullTexels::rgb(int u_px, int v_px) const {
  const std::uint8_t* bgr = &hull_.bgr[3 * index(u_px, v_px)];
  return {double(bgr[2]), double(bgr[1]), double(bgr[0])};
}

bool HullTexels::one_surface(double z_m, double other_m) const {
  return std::abs(other_m - z_m) < std::min(kMaxTiltTangent / hull_.recon.fx_px, kMaxJump) * z_m;
}

double HullTexels::slope(int u_px, int v_px, int du_px, int dv_px) const {
  const double before_m = depth_m(u_px - du_px, v_px - dv_px), here_m = depth_m(u_px, v_px),
               after_m = depth_m(u_px + du_px, v_px + dv_px);
  const bool b = one_surface(here_m, before_m), a = one_surface(here_m, after_m);
  const double last = a ? 1 / after_m : 1 / here_m, first = b ? 1 / before_m : 1 / here_m;
  return a || b ? (last - first) / (a + b) : 0;
}

std::optional<HullPixel> hull_pixel(const HullTexels& texels, const geometry::Pinhole& image,
                                    int u_px, int v_px) {
  const geometry::Pinhole& recon = texels.hull().recon;
  const double x = (u_px + 0.5) * recon.width_px / image.width_px - 0.5,
               y = (v_px + 0.5) * recon.height_px / image.height_px - 0.5;
  const int u0 = int(std::floor(x)), v0 = int(std::floor(y));
  HullPixel pixel{0, Eigen::Vector3d::Zero(), int(std::lround(x)), int(std::lround(y))};
  const double fx = x - u0, fy = y - v0,
               z_m = texels.depth_m(pixel.nearest_u_px, pixel.nearest_v_px);
  if (z_m == hull::kNoHull) return std::nullopt;
  const bool has_colour = !texels.hull().bgr.empty();
  bool one_surface = true;
  double inverse_z = 0;
  for (int i = 0; i < 4; ++i) {
    const int u = u0 + i % 2, v = v0 + i / 2;
    const double weight = (i % 2 ? fx : 1 - fx) * (i / 2 ? fy : 1 - fy);
    one_surface &= texels.one_surface(z_m, texels.depth_m(u, v));
    inverse_z += weight / texels.depth_m(u, v);
    if (has_colour) pixel.rgb += weight * texels.rgb(u, v);
  }
  pixel.depth_m = one_surface ? 1 / inverse_z : z_m;
  if (has_colour && !one_surface) pixel.rgb = texels.rgb(pixel.nearest_u_px, pixel.nearest_v_px);
  return pixel;
}

HullFrame frame_of_depths(const geometry::Camera& view, std::vector<float> depth_m) {
  HullFrame hull;
  hull.eye_from_world = view.camera_from_world;
  hull.recon = view.pinhole;
  hull.depth_m = std::move(depth_m);
  const int width = hull.recon.width_px, height = hull.recon.height_px;
  hull.covered = {width, height, 0, 0};
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u)
      if (hull.depth_m[std::size_t(v * width + u)] != hull::kNoHull)
        hull.covered = {std::min(hull.covered.u0_px, u), std::min(hull.covered.v0_px, v),
                        std::max(hull.covered.u1_px, u + 1), std::max(hull.covered.v1_px, v + 1)};
  return hull;
}

}  // namespace fivepipe::render
