#include "common/hull/coverage/thin_coverage.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace fivepipe::hull {
namespace {

// Maximum width of a thin part along rows or columns [px]: sqrt(2) for a strip of one pixel at 45
// degrees, and a margin.
constexpr double kThin_px = 1.5;

// Relative margin: coverages of at least 0.15 with an error of 0.01 locate a strip with a relative
// error of 10 %.
constexpr double kFractionSlack = 1.1;

// Coverage of the 3 x 3 pixels around a pixel, as fractions; 0 outside the image.
struct Neighbourhood {
  double c[3][3];  // [row][column]
  double row(int v) const { return c[v][0] + c[v][1] + c[v][2]; }
  double column(int u) const { return c[0][u] + c[1][u] + c[2][u]; }
};

Neighbourhood around(const CoverageMap& map, int u, int v) {
  Neighbourhood n;
  for (int dv = -1; dv <= 1; ++dv)
    for (int du = -1; du <= 1; ++du) {
      const bool inside =
          u + du >= 0 && v + dv >= 0 && u + du < map.width_px() && v + dv < map.height_px();
      n.c[dv + 1][du + 1] = inside ? double(map.at(u + du, v + dv)) / kFullCoverage : 0.0;
    }
  return n;
}

double variance(double before, double here, double behind) {
  const double sum = before + here + behind, mean = (behind - before) / sum;
  return (before + behind) / sum - mean * mean;
}

// Returns the coverage of the center pixel for which the strip is `width` wide (see the header).
double raised(double before, double behind, double width) {
  const double a = 0.5 - before, b = 0.5 - behind, p = 2 - width, q = (1 - width) * (a + b),
               r = -width * a * b;
  return 0.5 + (-q + std::sqrt(q * q - 4 * p * r)) / (2 * p);
}

// Returns the coverage of a neighbour of a pixel that becomes 1 (see the header).
double reaching(double beside, double here) {
  const double along_a_row = 2 * beside / (1 + 2 * beside),
               fraction = kFractionSlack * beside / (beside + here);
  return std::max(along_a_row, 2 * fraction * fraction / ((1 + fraction) * (1 + fraction)));
}

enum class Across { rows, columns };
Across min_spread(const Neighbourhood& n) {
  return variance(n.column(0), n.column(1), n.column(2)) >= variance(n.row(0), n.row(1), n.row(2))
             ? Across::rows
             : Across::columns;
}

// Returns the raised coverage of the center pixel of a thin part, or nullopt for other pixels.
std::optional<double> thin_coverage(const Neighbourhood& n, Across across,
                                    const PreserveThin& keep) {
  const bool rows = across == Across::rows;
  const double here = n.c[1][1], before = rows ? n.c[0][1] : n.c[1][0],
               behind = rows ? n.c[2][1] : n.c[1][2];
  if (before >= 0.5 || behind >= 0.5 || here <= before || here < behind) return std::nullopt;
  if ((n.row(0) + n.row(1) + n.row(2)) / 3 >= kThin_px)
    return std::nullopt;  // a gap between two objects
  const double beside = rows ? std::max(n.column(0), n.column(2)) : std::max(n.row(0), n.row(2)),
               sum = before + here + behind;
  if (sum < keep.min_width_px || sum >= kThin_px) return std::nullopt;
  if (keep.rule == ThinRule::contained) return 1.0;
  return raised(before, behind, beside < keep.min_width_px ? std::sqrt(sum) : sum);
}

// Returns true if the pixels at or above one half around (u, v) are not connected without it
// (crossing number above one: Hilditch, 1969).
bool bridges(const CoverageMap& m, int u, int v) {
  static constexpr int kRing[9][2] = {{1, 0},  {1, -1}, {0, -1}, {-1, -1}, {-1, 0},
                                      {-1, 1}, {0, 1},  {1, 1},  {1, 0}};
  bool inside[9];
  for (int i = 0; i < 9; ++i) {
    const int x = u + kRing[i][0], y = v + kRing[i][1];
    inside[i] =
        x >= 0 && y >= 0 && x < m.width_px() && y < m.height_px() && side_of_border(m.at(x, y)) > 0;
  }
  int crossings = 0;
  for (int i = 0; i < 8; i += 2) crossings += !inside[i] && (inside[i + 1] || inside[i + 2]);
  return crossings > 1;
}

std::uint8_t rounded_up(double coverage) {
  return std::uint8_t(std::min(std::ceil(coverage * kFullCoverage), double(kFullCoverage)));
}

// Connects the pair of pixels (u, v), (u + 1, v + 1), or (u + 1, v), (u, v + 1), if both are
// inside, one of them is thin, and the other two are outside.
void join_corner(CoverageMap& kept, const ObjectPixels& thin, const CoverageMap& map, int u, int v,
                 bool falling) {
  const int u1 = falling ? u : u + 1, u2 = falling ? u + 1 : u;  // of the pair, in rows v and v + 1
  const int e1 = side_of_border(kept.at(u1, v)), e2 = side_of_border(kept.at(u2, v + 1));
  if (e1 < 0 || e2 < 0 || !(thin.contains(u1, v) || thin.contains(u2, v + 1))) return;
  const bool upper = map.at(u2, v) >= map.at(u1, v + 1);
  const int ou = upper ? u2 : u1, ov = upper ? v : v + 1;  // the one of the other two to raise
  const int a = -side_of_border(kept.at(ou, ov)),
            b = -side_of_border(upper ? kept.at(u1, v + 1) : kept.at(u2, v));
  if (a < 0 || b < 0 || e1 * e2 > a * b) return;
  const int max_a = (e1 * e2 - 1) / b;  // largest a with e1 e2 > a b
  kept.set(ou, ov, std::uint8_t((kFullCoverage - max_a + 1) / 2));
}

// Returns the indices of the bytes that are neither 0 nor full, in order. Skips eight bytes at a
// time where all are one of the two.
std::vector<std::size_t> partly_covered(std::span<const std::uint8_t> bytes) {
  std::vector<std::size_t> found;
  const auto check = [&](std::size_t i) {
    if (bytes[i] != 0 && bytes[i] != kFullCoverage) found.push_back(i);
  };
  std::size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    std::uint64_t eight;
    std::memcpy(&eight, bytes.data() + i, 8);
    if (eight == 0 || eight == ~std::uint64_t(0)) continue;
    for (std::size_t k = i; k < i + 8; ++k) check(k);
  }
  for (; i < bytes.size(); ++i) check(i);
  return found;
}

}  // namespace

CoverageMap preserve_thin(const CoverageMap& map, const PreserveThin& keep) {
  CoverageMap kept = map;
  ObjectPixels thin(map.width_px(), map.height_px());
  const auto raise_pixel = [&](int u, int v, double coverage) {
    kept.set(u, v, std::max(kept.at(u, v), rounded_up(coverage)));
  };
  const auto raise = [&](int u, int v, const Neighbourhood& n, Across across) {
    const auto coverage = thin_coverage(n, across, keep);
    if (!coverage) return;
    raise_pixel(u, v, *coverage);
    thin.set(u, v);
    if (keep.rule == ThinRule::contained)
      for (const auto& [du, dv] : {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}})
        if (const double beside = n.c[1 + dv][1 + du]; beside > 0)
          raise_pixel(u + du, v + dv, reaching(beside, n.c[1][1]));
  };
  const std::vector<std::size_t> partly = partly_covered(map.bytes());
  const auto for_partly_covered = [&](const auto& work) {
    for (const std::size_t at : partly) {
      const int u = int(at % std::size_t(map.width_px())),
                v = int(at / std::size_t(map.width_px()));
      work(u, v, around(map, u, v));
    }
  };
  for_partly_covered([&](int u, int v, const Neighbourhood& n) { raise(u, v, n, min_spread(n)); });
  for_partly_covered([&](int u, int v, const Neighbourhood& n) {
    if (side_of_border(kept.at(u, v)) < 0 && bridges(kept, u, v))
      raise(u, v, n, min_spread(n) == Across::rows ? Across::columns : Across::rows);
  });
  const PixelRect near = thin.bounds();
  for (int v = std::max(near.v0_px - 1, 0); v < std::min(near.v1_px, map.height_px() - 1); ++v)
    for (int u = std::max(near.u0_px - 1, 0); u < std::min(near.u1_px, map.width_px() - 1); ++u)
      for (const bool falling : {true, false}) join_corner(kept, thin, map, u, v, falling);
  return kept;
}

}  // namespace fivepipe::hull
