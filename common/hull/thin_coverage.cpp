#include "common/hull/thin_coverage.h"

#include <algorithm>
#include <cmath>

namespace fivepipe {
namespace {

// What is wider than this along rows or columns is not thin [px]: a strip of one pixel at 45 degrees, and a little.
constexpr double kThin_px = 1.5;

// Coverage as fractions of the 3 x 3 pixels around one; outside the image nothing is covered.
struct Neighbourhood {
  double c[3][3];  // [row][column]
  double row(int v) const { return c[v][0] + c[v][1] + c[v][2]; }
  double column(int u) const { return c[0][u] + c[1][u] + c[2][u]; }
};

Neighbourhood around(const CoverageMap& map, int u, int v) {
  Neighbourhood n;
  for (int dv = -1; dv <= 1; ++dv)
    for (int du = -1; du <= 1; ++du) {
      const bool inside = u + du >= 0 && v + dv >= 0 && u + du < map.width_px() && v + dv < map.height_px();
      n.c[dv + 1][du + 1] = inside ? double(map.at(u + du, v + dv)) / kWholeCoverage : 0.0;
    }
  return n;
}

double variance(double before, double here, double behind) {
  const double sum = before + here + behind, mean = (behind - before) / sum;
  return (before + behind) / sum - mean * mean;
}

// What the middle is raised to for a strip as wide as `width` across it.
double raised(double before, double behind, double width) {
  const double a = 0.5 - before, b = 0.5 - behind, p = 2 - width, q = (1 - width) * (a + b), r = -width * a * b;
  return 0.5 + (-q + std::sqrt(q * q - 4 * p * r)) / (2 * p);
}

// The coverage of a pixel in the middle of something thin; 0 elsewhere.
double thin_coverage(const Neighbourhood& n, double least_width_px) {
  const bool along_rows = variance(n.column(0), n.column(1), n.column(2)) >= variance(n.row(0), n.row(1), n.row(2));
  const double here = n.c[1][1], before = along_rows ? n.c[0][1] : n.c[1][0], behind = along_rows ? n.c[2][1] : n.c[1][2];
  if (before >= 0.5 || behind >= 0.5 || here <= before || here < behind) return 0;
  double width = before + here + behind;
  const double beside = along_rows ? std::max(n.column(0), n.column(2)) : std::max(n.row(0), n.row(2));
  if (beside < least_width_px) width = std::sqrt(width);
  if (width < least_width_px || width >= kThin_px) return 0;
  return raised(before, behind, width);
}

// Joins the pair of pixels (u, v), (u + 1, v + 1), or (u + 1, v), (u, v + 1), where both are inside, one of them thin, and the others outside.
void join_corner(CoverageMap& kept, const ObjectPixels& thin, const CoverageMap& map, int u, int v, bool falling) {
  const int u1 = falling ? u : u + 1, u2 = falling ? u + 1 : u;  // of the pair, in rows v and v + 1
  const int e1 = side_of_border(kept.at(u1, v)), e2 = side_of_border(kept.at(u2, v + 1));
  if (e1 < 0 || e2 < 0 || !(thin.contains(u1, v) || thin.contains(u2, v + 1))) return;
  const bool upper = map.at(u2, v) >= map.at(u1, v + 1);
  const int ou = upper ? u2 : u1, ov = upper ? v : v + 1;  // of the others, the one to raise
  const int a = -side_of_border(kept.at(ou, ov)), b = -side_of_border(upper ? kept.at(u1, v + 1) : kept.at(u2, v));
  if (a < 0 || b < 0 || e1 * e2 > a * b) return;
  const int most = (e1 * e2 - 1) / b;  // of a, so that e1 e2 > a b
  kept.set(ou, ov, std::uint8_t((kWholeCoverage - most + 1) / 2));
}

}  // namespace

CoverageMap keep_thin(const CoverageMap& map, double least_width_px) {
  CoverageMap kept = map;
  ObjectPixels thin(map.width_px(), map.height_px());
  for (int v = 0; v < map.height_px(); ++v)
    for (int u = 0; u < map.width_px(); ++u) {
      if (map.at(u, v) == 0 || map.at(u, v) == kWholeCoverage) continue;
      const double coverage = thin_coverage(around(map, u, v), least_width_px);
      if (coverage == 0) continue;
      kept.set(u, v, std::max(map.at(u, v), std::uint8_t(std::min(std::ceil(coverage * kWholeCoverage), double(kWholeCoverage)))));
      thin.set(u, v);
    }
  for (int v = 0; v + 1 < map.height_px(); ++v)
    for (int u = 0; u + 1 < map.width_px(); ++u)
      for (const bool falling : {true, false}) join_corner(kept, thin, map, u, v, falling);
  return kept;
}

}  // namespace fivepipe
