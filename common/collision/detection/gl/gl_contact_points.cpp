#include "common/collision/detection/gl/gl_contact_points.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace fivepipe::collision {

using namespace gl_contact;
using Eigen::Vector3d;

namespace {

int halvings(double units, int start) { return int(std::lround(std::log2(units / start))); }

int level_of(const Part& part) { return int(part.b >> kLevelShift); }

// Position of a part in the triangle, as fractions of the edges; side < 0 marks an inverted part.
struct PartCoordinates {
  double a, b, side;
};
PartCoordinates place_of(const GlContact& contact, const Part& part) {
  const double unit = std::ldexp(1.0, -level_of(part)) / contact.grid.start;
  return {(part.a & ~kDown) * unit, (part.b & ((1u << kLevelShift) - 1)) * unit,
          part.a & kDown ? -unit : unit};
}

// Appends the centers of the rows * rows cells of a part, in the shader's order; of the first 16,
// those in the mask.
void add_centers(const Triangle& v, const PartCoordinates& place, int rows, std::uint32_t mask,
                 std::vector<Vector3d>& points_world_m) {
  const Vector3d along_a = v[1] - v[0], along_b = v[2] - v[0];
  const double step = place.side / rows;
  std::uint32_t bit = 1;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < 2 * (rows - row) - 1; ++column, bit <<= 1) {
      if (mask != kWholePartInHull && !(mask & bit)) continue;
      const double third = (column % 2 ? 2.0 : 1.0) / 3;
      points_world_m.push_back(v[0] + (place.a + step * (column / 2 + third)) * along_a +
                               (place.b + step * (row + third)) * along_b);
    }
}

// Number of rows of samples in a part that the GPU found.
int rows_of(const GlContact& contact, const Part& part) {
  const int level = level_of(part);
  if (level > contact.sampled()) return 1;
  return part.found == kWholePartInHull ? (contact.grid.divisions / contact.grid.start) >> level
                                        : contact.rows();
}

std::uint32_t mask_of(const Part& part) {
  return part.found == kWholePartInHull ? kWholePartInHull
                                        : (part.found | part.found >> 16) & 0xffff;
}

}  // namespace

// For the verdict alone, the first level is sampled too: most colliding triangles have such a
// sample in the hull.
int GlContact::sampled() const {
  return sampling ? std::max(0, halvings(grid.divisions, grid.start) - kSampledHalvings) : 0;
}
int GlContact::rows() const {
  return 1 << (sampling ? std::min(kSampledHalvings, halvings(grid.divisions, grid.start))
                        : kSampledHalvings);
}
int GlContact::finest() const { return halvings(grid.units, grid.start); }

void add_points(const GlContact& contact, const Part& found,
                std::vector<Vector3d>& points_world_m) {
  add_centers(contact.vertices_world_m, place_of(contact, found), rows_of(contact, found),
              mask_of(found), points_world_m);
}

std::size_t count_points(const GlContact& contact, const Part& found) {
  const std::size_t rows = std::size_t(rows_of(contact, found));
  return found.found == kWholePartInHull ? rows * rows : std::size_t(std::popcount(mask_of(found)));
}

std::array<Vector3d, 3> corners_world_m(const GlContact& contact, const Part& part) {
  const Triangle& v = contact.vertices_world_m;
  const Vector3d along_a = v[1] - v[0], along_b = v[2] - v[0];
  const PartCoordinates p = place_of(contact, part);
  const auto at = [&](double a, double b) -> Vector3d { return v[0] + a * along_a + b * along_b; };
  return {at(p.a, p.b), at(p.a + p.side, p.b), at(p.a, p.b + p.side)};
}

void add_all_points(const GlContact& contact, std::vector<Vector3d>& points_world_m) {
  add_centers(contact.vertices_world_m, {0, 0, 1}, contact.grid.divisions, kWholePartInHull,
              points_world_m);
}

}  // namespace fivepipe::collision
