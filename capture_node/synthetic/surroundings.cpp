#include "capture_node/synthetic/surroundings.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "capture_node/synthetic/noise/noise.h"

namespace fivepipe::capture {
namespace {

using Eigen::Vector3f;

const Vector3f kRoomMin_m(-2.9f, -2.7f, kFloor_z_m), kRoomMax_m(2.9f, 2.7f, 2.3f);
const Vector3f kTableMin_m(-0.85f, -0.68f, -0.04f), kTableMax_m(0.85f, 0.68f, kTableTop_z_m);
const Vector3f kCeiling_bgr(205, 206, 204), kTableEdge_bgr(96, 92, 84);

// Returns an image of `colour(u, v)`. All surfaces have neutral or cool colours, so that skin and
// pipe differ from them in colour, also in the shade.
template <class Colour>
cv::Mat painted(int width_px, int height_px, Colour colour) {
  cv::Mat texture(height_px, width_px, CV_8UC3);
  for (int v = 0; v < height_px; ++v)
    for (int u = 0; u < width_px; ++u) {
      const Vector3f bgr = colour(u, v);
      for (int c = 0; c < 3; ++c)
        texture.at<cv::Vec3b>(v, u)[c] = std::uint8_t(std::clamp(bgr[c], 0.0f, 255.0f));
    }
  return texture;
}

bool within(float x, float low, float high) { return x >= low && x < high; }

// Planks of grey ash with a cutting mat, two printed sheets and a strip of markers. One texel is
// 2 mm.
cv::Mat table_texture(std::uint64_t seed) {
  constexpr float kTexel_m = 0.002f;
  const int width = int((kTableMax_m.x() - kTableMin_m.x()) / kTexel_m),
            height = int((kTableMax_m.y() - kTableMin_m.y()) / kTexel_m);
  return painted(width, height, [&](int iu, int iv) -> Vector3f {
    const float x = kTableMin_m.x() + kTexel_m * iu, y = kTableMin_m.y() + kTexel_m * iv;
    const auto plank = std::int64_t(std::floor((y + 10) / 0.17f));
    const float shift = 20 * lattice(seed, plank, 1, 0);
    const float warp = fractal_noise(seed + 11, 3 * x + shift, 9 * y);
    const float grain = std::sin(2 * float(std::numbers::pi) * (55 * y + 5 * warp)) * 0.5f +
                        fractal_noise(seed + 5, 6 * x + shift, 160 * y);
    Vector3f bgr = Vector3f(172, 167, 154) + Vector3f(15, 16, 17) * (grain - 0.5f) +
                   Vector3f::Constant(16 * (lattice(seed, plank, 2, 0) - 0.5f));
    if (within(x, -0.62f, -0.14f) && within(y, -0.28f, 0.12f)) {  // mat
      const bool line = std::fmod(x + 1, 0.05f) < 0.0024f || std::fmod(y + 1, 0.05f) < 0.0024f;
      bgr = line ? Vector3f(150, 160, 120)
                 : Vector3f(92, 104, 52) +
                       Vector3f::Constant(14 * (fractal_noise(seed + 3, 40 * x, 40 * y) - 0.5f));
    }
    for (const float left : {0.05f, 0.42f}) {  // sheets with printed lines
      const float sx = x - left - 0.25f * (y + 0.4f) * (left - 0.2f), sy = y + 0.25f;
      if (!within(sx, 0, 0.21f) || !within(sy, 0, 0.297f)) continue;
      const auto line = std::int64_t(sy / 0.012f), word = std::int64_t(sx / 0.014f);
      const bool ink = within(sx, 0.02f, 0.19f) && within(sy, 0.02f, 0.28f) &&
                       std::fmod(sy, 0.012f) < 0.006f && lattice(seed + 7, line, word, 3) > 0.3f;
      bgr = ink ? Vector3f(88, 84, 80) : Vector3f(226, 226, 222);
    }
    if (within(y, 0.34f, 0.40f) && within(x, -0.5f, 0.5f)) {  // markers
      const bool dark = lattice(seed + 9, std::int64_t(std::floor(x / 0.02f)),
                                std::int64_t(std::floor(y / 0.02f)), 4) > 0.5f;
      bgr = Vector3f::Constant(dark ? 52 : 208);
    }
    return bgr;
  });
}

cv::Mat floor_texture(std::uint64_t seed) {
  return painted(512, 512, [&](int u, int v) -> Vector3f {
    const float carpet = fractal_noise(seed + 21, u * 0.5f, v * 0.5f),
                stain = fractal_noise(seed + 22, u * 0.02f, v * 0.02f);
    const bool seam = u % 64 == 0 || v % 64 == 0;
    return Vector3f(104, 98, 84) +
           Vector3f::Constant(44 * (carpet - 0.5f) + 30 * (stain - 0.5f) - (seam ? 18 : 0));
  });
}

// Plaster with pictures in the upper half and shelves of boxes in the lower half.
cv::Mat wall_texture(std::uint64_t seed) {
  return painted(512, 256, [&](int column, int row) -> Vector3f {
    const int u = 2 * column, v = 2 * row;
    const float shade = fractal_noise(seed, u * 0.01f, v * 0.01f),
                rough = value_noise(seed + 1, u * 0.4f, v * 0.4f);
    Vector3f bgr =
        Vector3f(206, 204, 196) + Vector3f::Constant(26 * (shade - 0.5f) + 12 * (rough - 0.5f));
    const auto box =
                   std::int64_t(std::floor((u + 9 * value_noise(seed + 2, u * 0.03f, 0)) / 37.0f)),
               shelf = std::int64_t(v / 64);
    const float pick = lattice(seed + 4, box, shelf, 0);
    if (v >= 256 && pick > 0.35f && v % 64 > 10 + 30 * lattice(seed + 5, box, shelf, 1))
      bgr =
          Vector3f(60 + 150 * lattice(seed, box, shelf, 2), 70 + 110 * lattice(seed, box, shelf, 3),
                   40 + 70 * lattice(seed, box, shelf, 4));
    if (v >= 256 && v % 64 < 4) bgr = Vector3f(120, 118, 110);
    const auto picture = std::int64_t(u / 170);
    if (within(v, 60, 200) && u % 170 > 60 && lattice(seed + 6, picture, 0, 0) > 0.4f) {
      const float wave = fractal_noise(seed + 8, u * 0.05f, v * 0.05f);
      bgr = Vector3f(210, 180, 60) * wave + Vector3f(70, 110, 40) * (1 - wave);
    }
    return bgr;
  });
}

// Bilinear interpolation at s, t in [0, 1] over the texture, clamped at its border.
Vector3f sample(const cv::Mat& texture, float s, float t) {
  const float x = std::clamp(s * texture.cols - 0.5f, 0.0f, float(texture.cols - 1)),
              y = std::clamp(t * texture.rows - 0.5f, 0.0f, float(texture.rows - 1));
  const int u = std::min(int(x), texture.cols - 2), v = std::min(int(y), texture.rows - 2);
  const float a = x - u, b = y - v;
  const std::uint8_t *upper = texture.ptr(v) + 3 * u, *lower = texture.ptr(v + 1) + 3 * u;
  Vector3f bgr;
  for (int c = 0; c < 3; ++c)
    bgr[c] = (upper[c] * (1 - a) + upper[c + 3] * a) * (1 - b) +
             (lower[c] * (1 - a) + lower[c + 3] * a) * b;
  return bgr;
}

struct BoxHit {
  float enter, leave;
  int enter_axis, leave_axis;
};

BoxHit through_box(const Vector3f& low, const Vector3f& high, const Vector3f& origin,
                   const Vector3f& direction) {
  BoxHit hit{-std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(), 0, 0};
  for (int axis = 0; axis < 3; ++axis) {
    // Infinite if the ray is parallel to the faces; the comparisons below remain correct.
    const float inverse = 1 / direction[axis];
    float near = (low[axis] - origin[axis]) * inverse, far = (high[axis] - origin[axis]) * inverse;
    if (near > far) std::swap(near, far);
    if (near > hit.enter) hit = {near, hit.leave, axis, hit.leave_axis};
    if (far < hit.leave) hit = {hit.enter, far, hit.enter_axis, axis};
  }
  return hit;
}

}  // namespace

float brightness(const Vector3f& p_world_m, const Vector3f& normal_world, float visibility) {
  const Vector3f to_lamp = lamp::kPosition_world_m - p_world_m;
  const float cosine = std::max(0.0f, normal_world.dot(to_lamp) / to_lamp.norm());
  const float from_above = 0.85f + 0.15f * normal_world.z();
  return lamp::kAmbient * from_above + lamp::kDirect * visibility * cosine;
}

Surroundings::Surroundings(std::uint64_t seed)
    : table_(table_texture(splitmix64(seed))), floor_(floor_texture(splitmix64(seed))) {
  for (std::size_t i = 0; i < walls_.size(); ++i) walls_[i] = wall_texture(splitmix64(seed, i + 1));
}

Surroundings::RayHit Surroundings::trace_ray(const Vector3f& origin,
                                             const Vector3f& direction) const {
  const BoxHit table = through_box(kTableMin_m, kTableMax_m, origin, direction);
  if (table.enter > 0 && table.enter < table.leave) {
    const Vector3f p = origin + table.enter * direction;
    if (table.enter_axis == 2 && direction.z() < 0) {
      const float light = brightness(p, Vector3f::UnitZ(), 1);
      return {
          Surface::table_top,
          light * sample(table_, (p.x() - kTableMin_m.x()) / (kTableMax_m.x() - kTableMin_m.x()),
                         (p.y() - kTableMin_m.y()) / (kTableMax_m.y() - kTableMin_m.y()))};
    }
    return {Surface::other, kTableEdge_bgr};
  }
  const BoxHit room = through_box(kRoomMin_m, kRoomMax_m, origin, direction);
  if (!(room.leave > 0 && std::isfinite(room.leave))) return {Surface::other, kTableEdge_bgr};
  const Vector3f p = origin + room.leave * direction;
  const Vector3f fraction = (p - kRoomMin_m).cwiseQuotient(kRoomMax_m - kRoomMin_m);
  Vector3f normal = Vector3f::Zero();
  normal[room.leave_axis] = direction[room.leave_axis] > 0 ? -1.0f : 1.0f;
  const float light = brightness(p, normal, 1);
  if (room.leave_axis == 2 && direction.z() < 0)
    return {Surface::floor, light * sample(floor_, fraction.x(), fraction.y())};
  if (room.leave_axis == 2) return {Surface::other, kCeiling_bgr};
  const std::size_t wall =
      std::size_t(2 * room.leave_axis + (direction[room.leave_axis] > 0 ? 1 : 0));
  return {Surface::other,
          light * sample(walls_[wall], room.leave_axis == 0 ? fraction.y() : fraction.x(),
                         1 - fraction.z())};
}

}  // namespace fivepipe::capture
