// N_hull's error against the silhouette's radius of curvature, for three methods: the closed form
// from binary maps, the closed form from 8-bit coverage, and the paper's four points.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace fivepipe::collision_bench {

// The error against the hull of the true silhouettes, over the queries for which the method returns
// a normal.
struct NormalError {
  double median_deg = 0, p95_deg = 0;
  int given = 0;  // number of those queries
};
struct NormalsAt {
  double radius_px;
  int queries = 0;  // pairs of CP_obj and V_rec
  NormalError binary = {}, coverage = {}, four_points = {};
  int four_points_defined = 0;  // queries whose own error estimate is below kMaxNormalError_rad
};

struct NormalCurve {
  const char *name, *title;
  NormalError NormalsAt::*error;
};
// In the alphabetical order of the titles, in which plots draw them.
inline constexpr NormalCurve kNormalCurves[] = {
    {"closed-binary", "closed form, binary maps", &NormalsAt::binary},
    {"closed-coverage", "closed form, coverage", &NormalsAt::coverage},
    {"four-points", "four points (the paper)", &NormalsAt::four_points}};

// A ball of 5 cm radius at the origin, seen by six cameras in seeded random directions: 40 rigs per
// radius below 30 px, else 15, and ten queries per rig. The binary maps sample pixel centers; the
// coverage is exact. CP_obj is 0.8 to 0.9 radii from the center, V_rec deviates by up to 30
// degrees from the outward normal. The four points use the paper's settings: apex angle 10 degrees,
// height 5 cm, 400 samples per line. Takes some seconds. `quick`: three radii, six rigs each.
std::vector<NormalsAt> measure_normals(bool quick);

void print(const std::vector<NormalsAt>& sweep);  // to stdout
// Plots the error against the radius. File, result and errors as for bench::Plots::draw().
bool plot(const std::vector<NormalsAt>& sweep, const std::filesystem::path& file);

}  // namespace fivepipe::collision_bench
