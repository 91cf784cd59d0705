#include "common/collision/detection/cpu/contact_maps.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "common/hull/image_cone.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// Rounding of float in a form c0 x + c1 y + c2 z + at, relative to
// T = |c0 x| + |c1 y| + |c2 z| + |at| with x, y, z at their largest, in units of e = 2^-24.
// Products and sums are rounded separately (fused, there are fewer roundings). The innermost term
// passes through all sums:
//
//                               from double      product  sums   together
//   a triangle's vertex         c0: 1, x: 1         1       3        6
//   a box's center              c0: 1               1       3        5
//   a part's first corner       c0: 1               1       2        4
//   a part's other corners      c0: 1               1       3        8
//   a part's center             c0: 1, x: 2         1       2        6
//
// A box's center and half sizes are floats that were rounded outward when they were made. Of a
// part, a and b are whole numbers, which are exact, and there is no third term. The step to another
// corner adds 1 + 1 + 1 = 3 of its own term, which is as large again.
//
// So each of U, V, W is off by at most 8 e T. An image is off by at most (dU + |u| dW) / W, because
// U^/W^ - U/W = (dU - u dW) / W^, where ^ marks a computed value. If |u| is at most that of the
// map's farthest border, this is less than kFormError (T_U + |u| T_W) / W. Beyond it, the error
// grows by less than a hundredth of |u|, so an image beside the map stays beside it.
//
// A corner of a box, off the center by d, has the image u + (sum of (c_U - u c_W) d) / W(corner),
// for the true u of the center. With the computed u^ it is
// u^ + (U(m) - u^ W(m) + sum of (c_U - u^ c_W) d) / W(corner). Of this,
//   U(m) - u^ W(m) = -dU + u^ dW - 6.3 e U(m), for the reciprocal and product of u^: at most
//                    11.3 e T_U and 5 e |u^| T_W;
//   c_U - u^ c_W   has 3 e of rounding (from double, product, difference), but |d| is the
//                  difference between the center's coordinates and those of T, so the bound
//                  above already includes it;
//   W(corner)      is at least w - off_w - dW.
// So kBoxError T_U / W is part of eps. slack_w is subtracted from W and multiplied by |u^|, which
// may be far outside the map (classify_boxes()).
constexpr double kFormError = 10 * 0x1p-24, kBoxError = 12 * 0x1p-24;
// Additional relative error of an image: the reciprocal (5.3 e), its product, and the difference
// that forms a rectangle. kBoxError |u| T_W / W includes the second difference of a box.
constexpr double kImageError = 8 * 0x1p-24;
// An image this far beside the object pixels is beside them for any rounding [px].
constexpr double kBeside_px = 1;

// Returns whether a shape in front of the camera with this image is beside the object pixels.
bool beside(const hull::PixelRect& bounds, const Eigen::Array2d& min_px,
            const Eigen::Array2d& max_px) {
  return max_px.x() < bounds.u0_px - kBeside_px || min_px.x() > bounds.u1_px + kBeside_px ||
         max_px.y() < bounds.v0_px - kBeside_px || min_px.y() > bounds.v1_px + kBeside_px;
}

// The map of a camera without object pixels: one pixel that is none.
alignas(4) constexpr std::int8_t kNoObject[4] = {1, 1, 1, 1};
// Beyond every image position that the kernels compare with it [px].
constexpr float kBeyond_px = 1e30f;

// Sets the members of ContactMap except eps_px, relative to the base pixel.
void set_map(const hull::SkipMap& skip_map, const hull::PixelRect& image, int base_u, int base_v,
             ContactMap& map) {
  map.image_begin_u = float(image.u0_px - base_u), map.image_end_u = float(image.u1_px - base_u);
  map.image_begin_v = float(image.v0_px - base_v), map.image_end_v = float(image.v1_px - base_v);
  if (skip_map.bounds().empty()) {
    map.min_u = map.max_u = map.min_v = map.max_v = 0;
    map.begin_u = map.begin_v = kBeyond_px, map.end_u = map.end_v = -kBeyond_px;
    map.stride = 0, map.at_base = kNoObject;
    return;
  }
  // The kernels index the map with 32 bits.
  assert(skip_map.box_bytes() < std::size_t(std::numeric_limits<std::int32_t>::max()));
  const hull::PixelRect &stored = skip_map.stored(), &bounds = skip_map.bounds();
  map.min_u = float(stored.u0_px - base_u), map.max_u = float(stored.u1_px - 1 - base_u);
  map.min_v = float(stored.v0_px - base_v), map.max_v = float(stored.v1_px - 1 - base_v);
  map.begin_u = float(bounds.u0_px - base_u), map.end_u = float(bounds.u1_px - base_u);
  map.begin_v = float(bounds.v0_px - base_v), map.end_v = float(bounds.v1_px - base_v);
  map.stride = std::int32_t(skip_map.stride());
  map.at_base = skip_map.bytes(hull::Quadrant::right_down) +
                std::ptrdiff_t(base_v - stored.v0_px) * skip_map.stride() + (base_u - stored.u0_px);
}

// Clamps x to [low, high]; NaN becomes low.
int clamp_to_int(double x, int low, int high) {
  return !(x > low) ? low : x >= high ? high : int(x);
}

}  // namespace

std::optional<ObjectMap> object_map(const hull::CpuHull::MapCamera& camera,
                                    const Eigen::Isometry3d& world_from_tree, double radius_m,
                                    hull::Limits limits) {
  const hull::PixelRect &bounds = camera.skip_map.bounds(), image = hull::image_of(camera.camera);
  ObjectMap map;
  const int base_u = (bounds.u0_px + bounds.u1_px) / 2, base_v = (bounds.v0_px + bounds.v1_px) / 2;
  set_map(camera.skip_map, image, base_u, base_v, map);
  Eigen::Matrix3d of = geometry::pixel_from_camera(camera.camera.pinhole);
  of.row(0) -= base_u * of.row(2), of.row(1) -= base_v * of.row(2);
  const Vector3d at = of * (camera.camera.camera_from_world * world_from_tree.translation());
  of = (of * camera.camera.camera_from_world.linear() * world_from_tree.linear()).eval();
  const Vector3d terms = at.cwiseAbs() + radius_m * of.cwiseAbs().rowwise().sum();
  // The kernels compare images with the borders of the object pixels, or with those of the image.
  const double farthest_px = limits == hull::Limits::all
                                 ? 0.5 * std::max(bounds.width_px(), bounds.height_px()) + 1
                                 : 1.0 + std::max({base_u - image.u0_px, image.u1_px - base_u,
                                                   base_v - image.v0_px, image.v1_px - base_v});
  const double room_px = kMaxContactEps_px - kImageError * farthest_px;
  if (!(room_px > 0) || !terms.cast<float>().allFinite()) return std::nullopt;
  // in_hull() projects in the world, where coordinates may be larger than relative to the tree's
  // origin.
  const PixelFromWorld pixel = pixel_from_world(camera.camera);
  const Vector3d world_terms =
      pixel.cwiseAbs().leftCols<3>() *
          (world_from_tree.translation().cwiseAbs() + Vector3d::Constant(radius_m)) +
      pixel.col(3).cwiseAbs();
  const double image_px = std::max(std::abs(base_u), std::abs(base_v)) + farthest_px;
  const double of_projection =
      kProjectionError * (std::max(world_terms.x(), world_terms.y()) + image_px * world_terms.z());
  for (int row = 0; row < 3; ++row) {
    map.at[row] = float(at[row]);
    for (int k = 0; k < 3; ++k) map.of[row][k] = float(of(row, k));
  }
  map.eps_px = float(kMaxContactEps_px);
  map.min_w = float(
      (kBoxError * (std::max(terms.x(), terms.y()) + farthest_px * terms.z()) + of_projection) /
      room_px * (1 + kImageError));
  map.slack_w = float((kBoxError * terms.z() + of_projection) * (1 + kImageError));
  map.max_behind_w = -2 * map.slack_w;
  return map;
}

PixelFromWorld pixel_from_world(const geometry::Camera& camera) {
  return geometry::pixel_from_camera(camera.pinhole) *
         camera.camera_from_world.matrix().topRows<3>();
}

ProjectionStatus triangle_map(const PixelFromWorld& pixel, const hull::SkipMap& skip_map,
                              const std::array<Vector3d, 3>& vertices_world_m, double units,
                              TriangleMap& map, const hull::PixelRect* seen_image) {
  std::array<Vector3d, 3> images;
  double min_w = std::numeric_limits<double>::infinity(), max_w = -min_w;
  for (std::size_t k = 0; k < 3; ++k) {
    images[k] = pixel.leftCols<3>() * vertices_world_m[k] + pixel.col(3);
    min_w = std::min(min_w, images[k].z()), max_w = std::max(max_w, images[k].z());
  }
  Vector3d world_terms = Vector3d::Zero();
  for (const Vector3d& v : vertices_world_m)
    world_terms = world_terms.cwiseMax(pixel.cwiseAbs().leftCols<3>() * v.cwiseAbs() +
                                       pixel.col(3).cwiseAbs());
  if (max_w < -kProjectionError * world_terms.z()) return ProjectionStatus::culled;
  if (!(min_w > 0)) return ProjectionStatus::uncertain;
  Eigen::Array2d min_px = Eigen::Array2d::Constant(std::numeric_limits<double>::infinity()),
                 max_px = -min_px;
  for (const Vector3d& image : images) {
    const Eigen::Array2d px = image.head<2>().array() / image.z();
    min_px = min_px.min(px), max_px = max_px.max(px);
  }
  // This limit is far above rounding, so the images are meaningful.
  const bool w_is_certain = min_w > kMaxContactEps_px * kMaxContactEps_px * world_terms.z();
  if (w_is_certain && beside(seen_image ? *seen_image : skip_map.bounds(), min_px, max_px))
    return ProjectionStatus::culled;
  const Vector3d image_sum_px =
      images[0] / images[0].z() + images[1] / images[1].z() + images[2] / images[2].z();
  const hull::PixelRect& stored = skip_map.stored().empty() ? *seen_image : skip_map.stored();
  const int base_u = clamp_to_int(image_sum_px.x() / 3, stored.u0_px, stored.u1_px - 1),
            base_v = clamp_to_int(image_sum_px.y() / 3, stored.v0_px, stored.v1_px - 1);
  double farthest_px = 1;  // at least 1, so that eps_px always includes the error of W
  for (Vector3d& image : images) {
    image.head<2>() -= Eigen::Vector2d(base_u, base_v) * image.z();
    farthest_px = std::max(farthest_px, image.head<2>().cwiseAbs().maxCoeff() / image.z());
  }
  const double per_unit = 1 / units;
  const Vector3d by_a = images[1] - images[0], by_b = images[2] - images[0],
                 terms = images[0].cwiseAbs() + by_a.cwiseAbs() + by_b.cwiseAbs();
  const double of_projection =
      kProjectionError *
      (std::max(world_terms.x(), world_terms.y()) +
       std::max(min_px.abs().maxCoeff(), max_px.abs().maxCoeff()) * world_terms.z());
  const double eps_px =
      (kFormError * (std::max(terms.x(), terms.y()) + farthest_px * terms.z()) + of_projection) /
          min_w +
      kImageError * farthest_px;
  if (!(eps_px < kMaxContactEps_px)) return ProjectionStatus::uncertain;
  set_map(skip_map, seen_image ? *seen_image : hull::PixelRect{}, base_u, base_v, map);
  map.eps_px = float(eps_px * (1 + kImageError));
  for (int row = 0; row < 3; ++row)
    map.at[row] = float(images[0][row]), map.by_a[row] = float(by_a[row] * per_unit),
    map.by_b[row] = float(by_b[row] * per_unit);
  return ProjectionStatus::in_front;
}

}  // namespace fivepipe::collision
