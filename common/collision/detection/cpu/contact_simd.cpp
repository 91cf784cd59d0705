#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/collision/detection/cpu/contact_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/collision/detection/cpu/contact_simd.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::collision {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, 16>;
using DI = hn::Rebind<std::int32_t, DF>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;
using MF = hn::Mask<DF>;

HWY_INLINE std::uint32_t bits_of(MF mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(DF(), mask, bytes);
  return std::uint32_t(bytes[0]) | std::uint32_t(bytes[1]) << 8;
}

// To 5.3 2^-24 or better: Newton's step on the processor's estimate, which is good to 1.5 2^-12,
// and three roundings.
HWY_INLINE VF reciprocal(VF x) {
  const DF d;
  VF estimate = hn::ApproximateReciprocal(x);
  for (int step = 0; step < (HWY_ARCH_X86 ? 1 : 2); ++step)
    estimate = hn::Mul(estimate, hn::NegMulAdd(x, estimate, hn::Set(d, 2.0f)));
  return estimate;
}

// The skip_map at pixel (fu, fv), which are brought into what is in store.
HWY_INLINE VF extent_at(const ContactMap& c, VF& fu, VF& fv) {
  const DF d;
  const DI di;
  fu = hn::Min(hn::Max(fu, hn::Set(d, c.min_u)), hn::Set(d, c.max_u));
  fv = hn::Min(hn::Max(fv, hn::Set(d, c.min_v)), hn::Set(d, c.max_v));
  const VI place =
      hn::Add(hn::Mul(hn::ConvertTo(di, fv), hn::Set(di, c.stride)), hn::ConvertTo(di, fu));
  const VI word = hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(c.at_base), place);
  return hn::ConvertTo(d, hn::ShiftRight<24>(hn::ShiftLeft<24>(word)));
}

struct RectContents {
  MF free, solid;
};

// The rectangle of images from (low_u, low_v) to (high_u, high_v).
HWY_INLINE RectContents classify_rect(const ContactMap& c, VF low_u, VF high_u, VF low_v,
                                      VF high_v) {
  const DF d;
  const VF eps = hn::Set(d, c.eps_px), zero = hn::Zero(d);
  low_u = hn::Sub(low_u, eps), high_u = hn::Add(high_u, eps), low_v = hn::Sub(low_v, eps),
  high_v = hn::Add(high_v, eps);
  const MF beside =
      hn::Or(hn::Or(hn::Lt(high_u, hn::Set(d, c.begin_u)), hn::Gt(low_u, hn::Set(d, c.end_u))),
             hn::Or(hn::Lt(high_v, hn::Set(d, c.begin_v)), hn::Gt(low_v, hn::Set(d, c.end_v))));
  VF fu = hn::Floor(low_u), fv = hn::Floor(low_v);
  const VF last_u = hn::Floor(high_u), last_v = hn::Floor(high_v), extent = extent_at(c, fu, fv);
  const VF one = hn::Set(d, 1.0f), width = hn::Add(hn::Sub(last_u, fu), one),
           height = hn::Add(hn::Sub(last_v, fv), one);
  // One square, or two along the longer side.
  const VF longer = hn::Max(width, height),
           side = hn::Max(hn::Min(width, height), hn::Ceil(hn::Mul(hn::Set(d, 0.5f), longer)));
  MF alike = hn::Ge(hn::Abs(extent), side);
  const MF object = hn::Lt(extent, zero), two = hn::And(alike, hn::Lt(side, longer));
  if (!hn::AllFalse(d, two)) {
    VF next_u = hn::Add(fu, hn::IfThenElseZero(hn::Gt(width, height), hn::Sub(width, side)));
    VF next_v = hn::Add(fv, hn::IfThenElseZero(hn::Gt(height, width), hn::Sub(height, side)));
    const VF next = extent_at(c, next_u, next_v);
    alike =
        hn::And(alike, hn::Or(hn::Not(two), hn::And(hn::Ge(hn::Abs(next), side),
                                                    hn::Not(hn::Xor(object, hn::Lt(next, zero))))));
  }
  return {hn::Or(beside, hn::AndNot(object, alike)), hn::AndNot(beside, hn::And(object, alike))};
}

HWY_INLINE MF nothing() {
  const DF d;
  return hn::Lt(hn::Zero(d), hn::Zero(d));
}
HWY_INLINE MF everything() {
  const DF d;
  return hn::Eq(hn::Zero(d), hn::Zero(d));
}

// A box's extent in the image, as a fraction more: the roundings of a reciprocal and of at most ten
// operations on it (2^-24 each).
constexpr float kExtentSlack = 1 + 0x1p-18f;

// --- boxes and triangles of an object
// ----------------------------------------------------------------------------------

HWY_INLINE VF form(const ObjectMap& c, int row, VF x, VF y, VF z) {
  const DF d;
  return hn::MulAdd(hn::Set(d, c.of[row][2]), z,
                    hn::MulAdd(hn::Set(d, c.of[row][1]), y,
                               hn::MulAdd(hn::Set(d, c.of[row][0]), x, hn::Set(d, c.at[row]))));
}

ContactBits classify_boxes(std::span<const ObjectMap> cameras, const Bvh::Boxes& boxes) {
  const DF d;
  const int lanes = int(hn::Lanes(d));
  ContactBits bits{0, 0};
  for (int first = 0; first < Bvh::kArity; first += lanes) {
    VF middle[3], half[3];
    for (std::size_t axis = 0; axis < 3; ++axis)
      middle[axis] = hn::Load(d, boxes.center_m[axis].data() + first),
      half[axis] = hn::Load(d, boxes.half_m[axis].data() + first);
    const MF there = hn::Ge(half[0], hn::Zero(d));
    MF free = hn::Not(there), solid = there;
    for (const ObjectMap& c : cameras) {
      const VF w = form(c, 2, middle[0], middle[1], middle[2]);
      VF off_w = hn::Zero(d);
      for (int k = 0; k < 3; ++k)
        off_w = hn::MulAdd(hn::Abs(hn::Set(d, c.of[2][k])), half[k], off_w);
      const VF slack_w = hn::Set(d, c.slack_w), min_w = hn::Sub(hn::Sub(w, off_w), slack_w),
               per_w = reciprocal(w), per_min_w = reciprocal(min_w);
      const MF sure = hn::Gt(min_w, hn::Set(d, c.min_w));
      const VF u = hn::Mul(form(c, 0, middle[0], middle[1], middle[2]), per_w),
               v = hn::Mul(form(c, 1, middle[0], middle[1], middle[2]), per_w);
      // Away from the middle's image: of U - u W, over W at least. That the middle's W, and so u,
      // is off as well, counts here: where the middle's image lies far outside, it is the larger
      // part (kFormError).
      const auto off = [&](int row, VF at) {
        VF sum = hn::Mul(hn::Abs(at), slack_w);
        for (int k = 0; k < 3; ++k)
          sum = hn::MulAdd(
              hn::Abs(hn::NegMulAdd(at, hn::Set(d, c.of[2][k]), hn::Set(d, c.of[row][k]))), half[k],
              sum);
        return hn::Mul(sum, hn::Mul(per_min_w, hn::Set(d, kExtentSlack)));
      };
      const VF off_u = off(0, u), off_v = off(1, v);
      const RectContents l = classify_rect(c, hn::Sub(u, off_u), hn::Add(u, off_u),
                                           hn::Sub(v, off_v), hn::Add(v, off_v));
      free = hn::Or(free, hn::Or(hn::And(sure, l.free),
                                 hn::Lt(hn::Add(w, off_w), hn::Set(d, c.max_behind_w))));
      solid = hn::And(solid, hn::And(sure, l.solid));
      if (hn::AllTrue(d, free)) break;
    }
    bits.free |= bits_of(free) << first;
    bits.solid |= bits_of(hn::AndNot(free, solid)) << first;
  }
  return bits;
}

ContactBits classify_leaf(std::span<const ObjectMap> cameras, const Bvh::Leaf& leaf,
                          int triangles) {
  const DF d;
  const int lanes = int(hn::Lanes(d));
  ContactBits bits{0, 0};
  for (int first = 0; first < triangles; first += lanes) {
    VF p[3][3];
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t axis = 0; axis < 3; ++axis)
        p[k][axis] = hn::Load(d, leaf.vertices_m[k][axis].data() + first);
    MF free = nothing(), solid = everything();
    for (const ObjectMap& c : cameras) {
      VF low_u, high_u, low_v, high_v, min_w, max_w;
      for (int k = 0; k < 3; ++k) {
        const VF w = form(c, 2, p[k][0], p[k][1], p[k][2]), per_w = reciprocal(w);
        const VF u = hn::Mul(form(c, 0, p[k][0], p[k][1], p[k][2]), per_w),
                 v = hn::Mul(form(c, 1, p[k][0], p[k][1], p[k][2]), per_w);
        low_u = k ? hn::Min(low_u, u) : u, high_u = k ? hn::Max(high_u, u) : u;
        low_v = k ? hn::Min(low_v, v) : v, high_v = k ? hn::Max(high_v, v) : v;
        min_w = k ? hn::Min(min_w, w) : w, max_w = k ? hn::Max(max_w, w) : w;
      }
      const MF sure = hn::Gt(min_w, hn::Set(d, c.min_w));
      const RectContents l = classify_rect(c, low_u, high_u, low_v, high_v);
      free = hn::Or(free, hn::Or(hn::And(sure, l.free), hn::Lt(max_w, hn::Set(d, c.max_behind_w))));
      solid = hn::And(solid, hn::And(sure, l.solid));
      if (hn::AllTrue(d, free)) break;
    }
    bits.free |= bits_of(free) << first;
    bits.solid |= bits_of(hn::AndNot(free, solid)) << first;
  }
  const std::uint32_t there = triangles >= 32 ? ~0u : (1u << triangles) - 1;
  return {bits.free & there, bits.solid & there};
}

// --- parts of a triangle
// -------------------------------------------------------------------------------------------------

HWY_INLINE VF form(const TriangleMap& c, int row, VF a, VF b) {
  const DF d;
  return hn::MulAdd(hn::Set(d, c.by_b[row]), b,
                    hn::MulAdd(hn::Set(d, c.by_a[row]), a, hn::Set(d, c.at[row])));
}

// Appends the cells of a mask.
HWY_INLINE void append(Cells& to, MF which, VF a, VF b, VF sigma) {
  const DF d;
  hn::CompressStore(a, which, d, to.a.data() + to.count);
  hn::CompressStore(b, which, d, to.b.data() + to.count);
  to.count += hn::CompressStore(sigma, which, d, to.sigma.data() + to.count);
}

void classify_cells(std::span<const TriangleMap> cameras, const Cells& cells, float h, Cells& mixed,
                    Cells& solid) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  mixed.make_room(cells.count), solid.make_room(cells.count);
  for (std::size_t first = 0; first < cells.count; first += lanes) {
    const VF a = hn::LoadU(d, cells.a.data() + first), b = hn::LoadU(d, cells.b.data() + first),
             sigma = hn::LoadU(d, cells.sigma.data() + first);
    const VF step = hn::Mul(sigma, hn::Set(d, h));
    const MF there = hn::FirstN(d, cells.count - first);
    MF free = hn::Not(there), all = there;
    for (const TriangleMap& c : cameras) {
      VF corner[3][3];  // U, V, W of the three
      for (int row = 0; row < 3; ++row) {
        corner[row][0] = form(c, row, a, b);
        corner[row][1] = hn::MulAdd(step, hn::Set(d, c.by_a[row]), corner[row][0]);
        corner[row][2] = hn::MulAdd(step, hn::Set(d, c.by_b[row]), corner[row][0]);
      }
      VF u[3], v[3];
      for (int k = 0; k < 3; ++k) {
        const VF per_w = reciprocal(corner[2][k]);
        u[k] = hn::Mul(corner[0][k], per_w), v[k] = hn::Mul(corner[1][k], per_w);
      }
      const RectContents l =
          classify_rect(c, hn::Min(u[0], hn::Min(u[1], u[2])), hn::Max(u[0], hn::Max(u[1], u[2])),
                        hn::Min(v[0], hn::Min(v[1], v[2])), hn::Max(v[0], hn::Max(v[1], v[2])));
      free = hn::Or(free, l.free);
      all = hn::And(all, l.solid);
      if (hn::AllTrue(d, free)) break;
    }
    all = hn::AndNot(free, all);
    append(solid, all, a, b, sigma);
    append(mixed, hn::Not(hn::Or(free, all)), a, b, sigma);
  }
}

void classify_centers(std::span<const TriangleMap> cameras, const Cells& cells, float h,
                      Cells& inside, Cells& uncertain) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  const VF third = hn::Set(d, h / 3), zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  inside.make_room(cells.count), uncertain.make_room(cells.count);
  for (std::size_t first = 0; first < cells.count; first += lanes) {
    const VF a = hn::LoadU(d, cells.a.data() + first), b = hn::LoadU(d, cells.b.data() + first),
             sigma = hn::LoadU(d, cells.sigma.data() + first);
    const VF center_a = hn::MulAdd(sigma, third, a), center_b = hn::MulAdd(sigma, third, b);
    MF in = hn::FirstN(d, cells.count - first), doubtful = nothing();
    for (const TriangleMap& c : cameras) {
      const VF eps = hn::Set(d, c.eps_px), per_w = reciprocal(form(c, 2, center_a, center_b));
      const VF u = hn::Mul(form(c, 0, center_a, center_b), per_w),
               v = hn::Mul(form(c, 1, center_a, center_b), per_w);
      VF fu = hn::Floor(u), fv = hn::Floor(v);
      const VF off_u = hn::Sub(u, fu), off_v = hn::Sub(v, fv);
      const MF near = hn::Or(hn::Lt(hn::Min(off_u, off_v), eps),
                             hn::Gt(hn::Max(off_u, off_v), hn::Sub(one, eps)));
      const VF inside_by = extent_at(c, fu, fv);
      // Near a border the pixel beyond it may be another.
      doubtful = hn::Or(doubtful, hn::And(in, near));
      in = hn::And(in, hn::Or(near, hn::Lt(inside_by, zero)));
      if (hn::AllFalse(d, in)) break;
    }
    doubtful = hn::And(doubtful, in);
    append(inside, hn::AndNot(doubtful, in), a, b, sigma);
    append(uncertain, doubtful, a, b, sigma);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe::collision
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace fivepipe::collision {
namespace {
HWY_EXPORT(classify_boxes);
HWY_EXPORT(classify_leaf);
HWY_EXPORT(classify_cells);
HWY_EXPORT(classify_centers);

using Eigen::Vector3d;

// Roundings of float in a form c0 x + c1 y + c2 z + at, as a part of T = |c0 x| + |c1 y| + |c2 z| +
// |at|, where x, y, z are as large as they get. In units of e = 2^-24, products and sums rounded by
// themselves (fused, there are fewer), the innermost term, which goes through all sums:
//
//                                from double     product   sums     together
//   a triangle's vertex          c0: 1, x: 1        1        3          6
//   a box's middle               c0: 1              1        3          5      its numbers are
//   floats, rounded outward when they were made a part's corner, first       c0: 1              1
//   2          4      a and b are whole numbers, exact; no third term the same, others c0: 1 1 3 5
//   and 1 + 1 + 1 = 3 of the step's own term, as large again: 8 a part's middle              c0: 1,
//   x: 2        1        2          6
//
// So each of U, V, W is off by at most 8 e T. An image is off by at most (dU + |u| dW) / W, as U /
// W is: Û/Ŵ - U/W = (dU - u dW) / Ŵ. Where |u| is at most that of the map's farthest border, that
// is less than kFormError (T_U + |u| T_W) / W; beyond, the error grows by less than a hundredth of
// |u|, so that what is beside stays beside.
//
// A box's corner, off the middle by d, has u + (sum of (c_U - u c_W) d) / W(corner), for the true u
// of the middle. With û instead this is û + (U(m) - û W(m) + sum of (c_U - û c_W) d) / W(corner).
// Of it
//   U(m) - û W(m) = -dU + û dW - 6.3 e U(m), for û's reciprocal and product: at most 11.3 e T_U and
//   5 e |û| T_W; c_U - û c_W has 3 e of rounding (from double, product, difference), but |d| is
//   what the middle's coordinates fall short of T's: no more; W(corner) is at least w - off_w - dW.
// So kBoxError T_U / W is in eps, and slack_w is taken off W and multiplied by |û|, which may be
// far beyond the map: classify_boxes.
constexpr double kFormError = 10 * 0x1p-24, kBoxError = 12 * 0x1p-24;
// Of an image, beside, as a part of it: the reciprocal (5.3 e), its product, and a difference that
// makes a rectangle of it; of a box's second, there is room in kBoxError |u| T_W / W.
constexpr double kImageError = 8 * 0x1p-24;
// Images this far beside the object pixels are so for every rounding [px].
constexpr double kBeside_px = 1;

// All of what is in front of the camera, with these corners, lies beside the object pixels.
bool beside(const hull::PixelRect& bounds, const Eigen::Array2d& min_px,
            const Eigen::Array2d& max_px) {
  return max_px.x() < bounds.u0_px - kBeside_px || min_px.x() > bounds.u1_px + kBeside_px ||
         max_px.y() < bounds.v0_px - kBeside_px || min_px.y() > bounds.v1_px + kBeside_px;
}

// (U, V, W) of a point in the camera's frame: pixel p covers [p, p + 1).
Eigen::Matrix3d pixel_from_camera(const geometry::Pinhole& k) {
  Eigen::Matrix3d m;
  m << k.fx_px, 0, k.cx_px + 0.5, 0, k.fy_px, k.cy_px + 0.5, 0, 0, 1;
  return m;
}

void set_map(const hull::SkipMap& skip_map, int base_u, int base_v, ContactMap& map) {
  assert(skip_map.box_bytes() <
         std::size_t(std::numeric_limits<std::int32_t>::max()));  // places are counted in 32 bits
  const hull::PixelRect &stored = skip_map.stored(), &bounds = skip_map.bounds();
  map.min_u = float(stored.u0_px - base_u), map.max_u = float(stored.u1_px - 1 - base_u);
  map.min_v = float(stored.v0_px - base_v), map.max_v = float(stored.v1_px - 1 - base_v);
  map.begin_u = float(bounds.u0_px - base_u), map.end_u = float(bounds.u1_px - base_u);
  map.begin_v = float(bounds.v0_px - base_v), map.end_v = float(bounds.v1_px - base_v);
  map.stride = std::int32_t(skip_map.stride());
  map.at_base = skip_map.bytes(hull::Quadrant::right_down) +
                std::ptrdiff_t(base_v - stored.v0_px) * skip_map.stride() + (base_u - stored.u0_px);
}

int within(double x, int least, int most) {
  return !(x > least) ? least : x >= most ? most : int(x);
}

}  // namespace

std::optional<ObjectMap> object_map(const hull::CpuHull::MapCamera& camera,
                                    const Eigen::Isometry3d& world_from_tree, double radius_m) {
  const hull::PixelRect& bounds = camera.skip_map.bounds();
  ObjectMap map;
  const int base_u = (bounds.u0_px + bounds.u1_px) / 2, base_v = (bounds.v0_px + bounds.v1_px) / 2;
  set_map(camera.skip_map, base_u, base_v, map);
  Eigen::Matrix3d of = pixel_from_camera(camera.camera.pinhole);
  of.row(0) -= base_u * of.row(2), of.row(1) -= base_v * of.row(2);
  const Vector3d at = of * (camera.camera.camera_from_world * world_from_tree.translation());
  of = (of * camera.camera.camera_from_world.linear() * world_from_tree.linear()).eval();
  const Vector3d terms = at.cwiseAbs() + radius_m * of.cwiseAbs().rowwise().sum();
  const double farthest_px = 0.5 * std::max(bounds.width_px(), bounds.height_px()) + 1;
  const double room_px = kMaxContactEps_px - kImageError * farthest_px;
  if (!(room_px > 0) || !terms.cast<float>().allFinite()) return std::nullopt;
  // In the world, where in_hull() projects, numbers may be larger than about the tree's origin.
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
  return pixel_from_camera(camera.pinhole) * camera.camera_from_world.matrix().topRows<3>();
}

ProjectionStatus triangle_map(const PixelFromWorld& pixel, const hull::SkipMap& skip_map,
                              const std::array<Vector3d, 3>& vertices_world_m, double units,
                              TriangleMap& map) {
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
  const bool sure_of_w =
      min_w > kMaxContactEps_px * kMaxContactEps_px * world_terms.z();  // far above rounding
  if (sure_of_w && beside(skip_map.bounds(), min_px, max_px)) return ProjectionStatus::culled;
  const Vector3d middle =
      images[0] / images[0].z() + images[1] / images[1].z() + images[2] / images[2].z();
  const hull::PixelRect& stored = skip_map.stored();
  const int base_u = within(middle.x() / 3, stored.u0_px, stored.u1_px - 1),
            base_v = within(middle.y() / 3, stored.v0_px, stored.v1_px - 1);
  double farthest_px = 1;  // so that an error of W by itself is an error of the image
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
  set_map(skip_map, base_u, base_v, map);
  map.eps_px = float(eps_px * (1 + kImageError));
  for (int row = 0; row < 3; ++row)
    map.at[row] = float(images[0][row]), map.by_a[row] = float(by_a[row] * per_unit),
    map.by_b[row] = float(by_b[row] * per_unit);
  return ProjectionStatus::in_front;
}

ContactBits classify_boxes(std::span<const ObjectMap> cameras, const Bvh::Boxes& boxes) {
  return HWY_DYNAMIC_DISPATCH(classify_boxes)(cameras, boxes);
}
ContactBits classify_leaf(std::span<const ObjectMap> cameras, const Bvh::Leaf& leaf,
                          int triangles) {
  return HWY_DYNAMIC_DISPATCH(classify_leaf)(cameras, leaf, triangles);
}
void classify_cells(std::span<const TriangleMap> cameras, const Cells& cells, float h, Cells& mixed,
                    Cells& solid) {
  HWY_DYNAMIC_DISPATCH(classify_cells)(cameras, cells, h, mixed, solid);
}
void classify_centers(std::span<const TriangleMap> cameras, const Cells& cells, float h,
                      Cells& inside, Cells& uncertain) {
  HWY_DYNAMIC_DISPATCH(classify_centers)(cameras, cells, h, inside, uncertain);
}

}  // namespace fivepipe::collision
#endif
