// N_hull's error against the radius of the silhouette's curvature: the closed form, from binary
// maps and from 8-bit coverage, and the paper's four points.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace fivepipe::collision_bench {

// Against the hull of the true silhouettes, of all ways for which the method gives a normal.
struct NormalError {
  double median_deg = 0, p95_deg = 0;
  int given = 0;
};
struct NormalsAt {
  double radius_px;
  int ways = 0;
  NormalError binary = {}, coverage = {}, four_points = {};
  int four_points_defined = 0;  // whose own error estimate stays below kMaxNormalError_rad
};

// Balls seen by six cameras from anywhere: 40 rigs a radius, 15 above 30 px, ten ways each, always
// the same. Maps by pixel centres, and the true coverage of the same. CP_obj 0.8 to 0.9 radii from
// the middle, V_rec up to 30 degrees off the outward normal; the four points as the paper: angle 10
// degrees, height 5 cm, which is the ball's radius, 400 samples a line. Some seconds; quick: three
// radii, few rigs.
std::vector<NormalsAt> measure_normals(bool quick);

void print(const std::vector<NormalsAt>& sweep);
// An entry a radius and method: normals/closed-binary/20px/1.
std::vector<std::string> json_of(const std::vector<NormalsAt>& sweep);
// Error against radius. False where there is no gnuplot.
bool plot(const std::vector<NormalsAt>& sweep, const std::filesystem::path& file);

}  // namespace fivepipe::collision_bench
