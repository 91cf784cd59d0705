#include "common/hull/silhouette/contour.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace fivepipe::hull {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;

// Determinant below which there is no parabola: edge centers at only two positions along the
// tangent give 0; three positions a quarter of a pixel apart give more than this.
constexpr double kMinDeterminant_px6 = 1e-3;
// A parabola that is steeper than this against its chord follows single edges; the chord is then
// the better estimate.
constexpr double kMaxSlope = 1;

// Variance of an edge center's distance from the true contour, which is uniform within half a pixel
// [px^2]. The residuals can give a smaller value, for example if all edges of a window are on one
// line.
constexpr double kStaircaseVariance_px2 = 1.0 / 12;

// Returns the next edge of the contour in the direction `along`, which is perpendicular to
// edge.outward. Kept pixels that share only a corner are connected.
//
//   A B    p: the edge's pixel, o: its neighbour that is not kept, up: `along`.
//   p o    B kept: its edge towards p's row. Else A kept: straight on. Else p's edge towards A.
ContourEdge next(const ContourMap& map, const ContourEdge& edge, const Vector2i& along) {
  const Vector2i a = edge.pixel + along, b = a + edge.outward;
  if (map.keeps(b.x(), b.y())) return {b, -along};
  if (map.keeps(a.x(), a.y())) return {a, edge.outward};
  return {edge.pixel, along};
}

// Returns `along` after the step from one edge to the next: it turns with the contour, so that
// outward stays on the same side.
Vector2i turned(const ContourEdge& from, const Vector2i& along, const ContourEdge& to) {
  if (to.outward == from.outward) return along;
  return to.outward == along ? Vector2i(-from.outward) : from.outward;
}

// Centers of edges relative to uv: the starting edge at index kContourEdges, with kContourEdges
// before and after it.
using EdgeCenters = std::array<Vector2d, 2 * kContourEdges + 1>;

// Sets `edges` to the number of edges of the closed contour, at most 2 kContourEdges + 1.
EdgeCenters edge_centers_around(const ContourMap& map, const ContourEdge& start,
                                const Vector2d& uv_px, int& edges) {
  EdgeCenters centers;
  edges = 2 * kContourEdges + 1;
  centers[kContourEdges] = start.center_px() - uv_px;
  std::array<ContourEdge, 2> edge{start, start};  // backward, forward
  std::array<Vector2i, 2> along{Vector2i(start.outward.y(), -start.outward.x()),
                                Vector2i(-start.outward.y(), start.outward.x())};
  for (int n = 1; n <= kContourEdges; ++n)
    for (const std::size_t side : {0u, 1u}) {
      const ContourEdge after = next(map, edge[side], along[side]);
      along[side] = turned(edge[side], along[side], after);
      edge[side] = after;
      centers[std::size_t(kContourEdges + (side == 0 ? -n : n))] = after.center_px() - uv_px;
      if (edge[0] == edge[1]) edges = std::min(edges, side == 0 ? 2 * n - 1 : 2 * n);  // they meet
    }
  return centers;
}

// The window shrinks by four edges above this size, then by one.
constexpr int kFineWindow = 8;

// Returns the angle by which the contour turns between the two sides of the start, each n edges
// long.
double turn_rad(const EdgeCenters& m, int n) {
  const Vector2d to = m[kContourEdges] - m[std::size_t(kContourEdges - n)],
                 from = m[std::size_t(kContourEdges + n)] - m[kContourEdges];
  return std::abs(std::atan2(to.x() * from.y() - to.y() * from.x(), to.dot(from)));
}

// Returns the largest window in which the contour turns by at most kMaxTurn_rad, or the smallest
// window. It has at most half of the contour's edges, because a longer one runs around a small
// object.
int window(const EdgeCenters& m, int edges) {
  int n = edges > 2 * kContourEdges ? kContourEdges
                                    : std::clamp(edges / 4, kMinContourEdges, kContourEdges);
  while (n > kMinContourEdges && !(turn_rad(m, n) <= kMaxTurn_rad)) n -= n > kFineWindow ? 4 : 1;
  return n;
}

// Of the contour at x = 0.
struct Slope {
  double at_uv, error, offset_px;
};

// Returns the slope at x = 0 of the parabola y = a + b x + c x^2 through the centers, with x along
// `tangent`, or that of the chord if there is no parabola.
Slope slope_at_uv(const EdgeCenters& m, int n, const Vector2d& tangent, double chord_px) {
  const Vector2d normal(-tangent.y(), tangent.x());
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double sum_yy = 0;
  for (int i = kContourEdges - n; i <= kContourEdges + n; ++i) {
    const double x = m[std::size_t(i)].dot(tangent), y = m[std::size_t(i)].dot(normal);
    const Eigen::Vector3d row(1, x, x * x);
    a += row * row.transpose();
    b += y * row;
    sum_yy += y * y;
  }
  const Slope of_chord{0, 2 / chord_px, 0};
  if (!(a.determinant() > kMinDeterminant_px6)) return of_chord;
  const Eigen::Matrix3d inverse = a.inverse();
  const Eigen::Vector3d fit = inverse * b;
  if (!(std::abs(fit.y()) <= kMaxSlope)) return of_chord;
  const int freedom = 2 * n + 1 - 3;
  const double variance_px2 = std::max(kStaircaseVariance_px2, (sum_yy - fit.dot(b)) / freedom);
  return {fit.y(), std::sqrt(variance_px2 * inverse(1, 1)), fit.x()};
}

}  // namespace

ContourFit contour_fit(const ContourMap& map, const ContourEdge& start, const Vector2d& uv_px) {
  int edges = 0;
  const EdgeCenters centers = edge_centers_around(map, start, uv_px, edges);
  const int n = window(centers, edges);
  const Vector2d chord =
      centers[std::size_t(kContourEdges + n)] - centers[std::size_t(kContourEdges - n)];
  if (!(chord.squaredNorm() > 0))
    return {start.outward.cast<double>(), std::numbers::pi, uv_px};  // that of a single pixel
  const Vector2d tangent = chord.normalized();
  const Slope slope = slope_at_uv(centers, n, tangent, chord.norm());
  const Vector2d fitted =
      (tangent + slope.at_uv * Vector2d(-tangent.y(), tangent.x())).normalized();
  // At a corner, or on an object of a few pixels, any tangent between those of the sides is
  // possible.
  const double turn = turn_rad(centers, n), between_rad = turn <= kMaxTurn_rad ? 0 : 0.5 * turn;
  return {{fitted.y(), -fitted.x()},
          // The tangent is the normal rotated by 90 degrees from x to y.
          std::max(std::atan(slope.error), between_rad),
          uv_px + slope.offset_px * Vector2d(-tangent.y(), tangent.x())};
}

}  // namespace fivepipe::hull
