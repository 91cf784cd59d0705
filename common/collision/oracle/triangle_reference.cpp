// Sources: homographies of planes (Hartley and Zisserman, Multiple View Geometry, 13.1); clipping
// of polygons by lines (Sutherland and Hodgman 1974).
//
// The border between two pixels is a plane through the camera's center, hence a line on the
// triangle: homogeneous pixels h are linear in the barycentric weights, and if h_z > 0, a point is
// right of the border b if h_x - b h_z > 0. The line needs no division by h_z, so a triangle seen
// edge-on, whose homography has no inverse, is clipped like any other.
#include "common/collision/oracle/triangle_reference.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <stdexcept>

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;
using Line = Eigen::RowVector3d;  // on the weights; positive on one side

struct Split {
  WeightPolygon below, above;
};

// A polygon wholly on the line counts as above the line, because a pixel contains its left and
// upper border.
Split split(const WeightPolygon& polygon, const Line& line) {
  Split parts;
  bool any_below = false, any_above = false;
  std::vector<double> side;
  for (const Vector3d& w : polygon) {
    side.push_back(line.dot(w.transpose()));
    any_below |= side.back() < 0;
    any_above |= side.back() > 0;
  }
  if (!any_below)
    parts.above = polygon;
  else if (!any_above)
    parts.below = polygon;
  if (!any_below || !any_above) return parts;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const std::size_t next = (i + 1) % polygon.size();
    const double a = side[i], b = side[next];
    if (a <= 0) parts.below.push_back(polygon[i]);
    if (a >= 0) parts.above.push_back(polygon[i]);
    if ((a < 0 && b > 0) || (a > 0 && b < 0)) {
      const Vector3d crossing = polygon[i] + a / (a - b) * (polygon[next] - polygon[i]);
      parts.below.push_back(crossing);
      parts.above.push_back(crossing);
    }
  }
  return parts;
}

struct Run {
  int begin_px, end_px;
  bool operator==(const Run&) const = default;
};

// Returns the runs of object pixels in row v between columns u0 and u1.
std::vector<Run> runs(const hull::ObjectPixels& pixels, int v, int u0, int u1) {
  std::vector<Run> found;
  for (int u = u0; u < u1; ++u) {
    if (!pixels.contains(u, v)) continue;
    if (!found.empty() && found.back().end_px == u)
      ++found.back().end_px;
    else
      found.push_back({u, u + 1});
  }
  return found;
}

// A triangle in a camera's image: the homography from weights to homogeneous pixels.
struct TriangleInImage {
  Eigen::Matrix3d pixel_from_weights;
  const hull::ObjectPixels* pixels;

  TriangleInImage(const hull::Silhouette& s, const Triangle& triangle) : pixels(&s.pixels) {
    const geometry::Pinhole& k = s.camera.pinhole;
    Eigen::Matrix3d intrinsics;
    intrinsics << k.fx_px, 0, k.cx_px, 0, k.fy_px, k.cy_px, 0, 0, 1;
    for (int i = 0; i < 3; ++i)
      pixel_from_weights.col(i) = intrinsics * (s.camera.camera_from_world.linear() * triangle[i] +
                                                s.camera.camera_from_world.translation());
  }

  Line right_of(double u_px) const {
    return pixel_from_weights.row(0) - u_px * pixel_from_weights.row(2);
  }
  Line beneath(double v_px) const {
    return pixel_from_weights.row(1) - v_px * pixel_from_weights.row(2);
  }

  // Returns the part of the polygon in the image. Appends the parts outside it to `outside`.
  WeightPolygon in_image(WeightPolygon polygon, std::vector<WeightPolygon>& outside) const {
    const auto keep = [&](const Line& line, bool above) {
      Split parts = split(polygon, line);
      WeightPolygon& rest = above ? parts.below : parts.above;
      if (!rest.empty()) outside.push_back(std::move(rest));
      polygon = std::move(above ? parts.above : parts.below);
    };
    keep(pixel_from_weights.row(2) - kReferenceNearest_m * Line::Ones(), true);
    keep(right_of(-0.5), true);
    keep(right_of(pixels->width_px() - 0.5), false);
    keep(beneath(-0.5), true);
    keep(beneath(pixels->height_px() - 0.5), false);
    return polygon;
  }

  // The smallest rectangle that contains a polygon of the image.
  hull::PixelRect bounds(const WeightPolygon& polygon) const {
    hull::PixelRect box{pixels->width_px(), pixels->height_px(), 0, 0};
    for (const Vector3d& w : polygon) {
      const Vector3d h = pixel_from_weights * w;
      const int u = int(std::floor(std::clamp(h.x() / h.z() + 0.5, 0.0, pixels->width_px() - 1.0)));
      const int v =
          int(std::floor(std::clamp(h.y() / h.z() + 0.5, 0.0, pixels->height_px() - 1.0)));
      box = {std::min(box.u0_px, u), std::min(box.v0_px, v), std::max(box.u1_px, u + 1),
             std::max(box.v1_px, v + 1)};
    }
    return box;
  }

  // Appends the parts of the polygon on object pixels, and those outside the image. Sweeps down the
  // rows and treats rows with the same runs as one. Does not clip at the rectangle's own borders:
  // rounding decides on which side of a border between pixels a plane seen edge-on falls, and all
  // of the polygon counts.
  void accept_object(const WeightPolygon& polygon, std::vector<WeightPolygon>& accepted,
                     std::vector<WeightPolygon>& outside) const {
    WeightPolygon rest = in_image(polygon, outside);
    const hull::PixelRect box = bounds(rest);
    for (int v = box.v0_px; v < box.v1_px && !rest.empty();) {
      const std::vector<Run> row = runs(*pixels, v, box.u0_px, box.u1_px);
      for (++v; v < box.v1_px && runs(*pixels, v, box.u0_px, box.u1_px) == row;) ++v;
      Split rows = v < box.v1_px ? split(rest, beneath(v - 0.5)) : Split{rest, {}};
      for (const Run& run : row) {
        if (run.begin_px > box.u0_px)
          rows.below = split(rows.below, right_of(run.begin_px - 0.5)).above;
        Split columns = run.end_px < box.u1_px ? split(rows.below, right_of(run.end_px - 0.5))
                                               : Split{rows.below, {}};
        if (!columns.below.empty()) accepted.push_back(std::move(columns.below));
        rows.below = std::move(columns.above);
      }
      rest = std::move(rows.above);
    }
  }
};

// Area as a fraction of the triangle's area in weights.
double area_fraction(const WeightPolygon& polygon) {
  double twice =
      // Twice the area in the plane of the second and third weight, in which the triangle has area
      // 1/2.
      0;
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    const Vector3d a = polygon[i - 1] - polygon[0], b = polygon[i] - polygon[0];
    twice += a.y() * b.z() - a.z() * b.y();
  }
  return twice;
}

Vector3d point(const Triangle& t, const Vector3d& weights) {
  return t[0] + weights.y() * (t[1] - t[0]) + weights.z() * (t[2] - t[0]);
}

// A part of the triangle, with an upper bound of its depth.
struct Cell {
  Triangle triangle;
  double max_m;
  bool operator<(const Cell& other) const { return max_m < other.max_m; }
};

// Halves the triangle at its longest edge.
std::array<Triangle, 2> halves(const Triangle& t) {
  int apex = 0;
  const auto opposite = [&](int i) { return (t[(i + 1) % 3] - t[(i + 2) % 3]).squaredNorm(); };
  for (int i = 1; i < 3; ++i)
    if (opposite(i) > opposite(apex)) apex = i;
  const Vector3d &a = t[apex], &b = t[(apex + 1) % 3], &c = t[(apex + 2) % 3],
                 midpoint = 0.5 * (b + c);
  return {Triangle{a, b, midpoint}, Triangle{a, midpoint, c}};
}

// Branch and bound: a signed distance changes by at most the distance between two points.
void find_deepest(const HullDistance& hull, const Triangle& triangle, TriangleTruth& truth) {
  std::priority_queue<Cell> cells;
  truth.deepest_world_m = triangle[0];
  const auto add = [&](const Triangle& t) {
    const Vector3d center = (t[0] + t[1] + t[2]) / 3;
    const double here_m = hull.signed_m(center);
    double radius_m = 0;
    for (const Vector3d& vertex : t) radius_m = std::max(radius_m, (vertex - center).norm());
    if (here_m > truth.deepest_m) {
      truth.deepest_m = here_m;
      truth.deepest_world_m = center;
    }
    cells.push({t, here_m + radius_m});
  };
  add(triangle);
  const auto converged = [&](double max_m) {
    return !(max_m > truth.deepest_m * (1 + kDepthToleranceFraction) + kDepthTolerance_m);
  };
  for (int cell_count = 0; cell_count < kMaxDepthCells && !converged(cells.top().max_m);
       ++cell_count) {
    const Cell cell = cells.top();
    cells.pop();
    for (const Triangle& half : halves(cell.triangle)) add(half);
  }
  truth.deepest_at_most_m = std::max(truth.deepest_m, cells.top().max_m);
}

}  // namespace

Triangle sorted(const Triangle& triangle) {
  Triangle t = triangle;
  std::sort(t.begin(), t.end(), [](const Vector3d& a, const Vector3d& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  });
  return t;
}

std::vector<WeightPolygon> weights_in_hull(std::span<const hull::Silhouette> silhouettes,
                                           const Triangle& triangle, const hull::HullRule& rule) {
  for (const Vector3d& vertex : triangle)
    if (!vertex.allFinite()) throw std::invalid_argument("a vertex of the triangle is not finite");
  if (silhouettes.empty()) return {};
  const Triangle t = sorted(triangle);
  const bool seen = rule.limits == hull::Limits::seen;
  WeightPolygon in_box{Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
  for (int axis = 0; axis < 3; ++axis) {
    const Line at(t[0][axis], t[1][axis], t[2][axis]);
    if (const double low_m = rule.within_world_m.min()[axis]; std::isfinite(low_m))
      in_box = split(in_box, at - low_m * Line::Ones()).above;
    if (const double high_m = rule.within_world_m.max()[axis]; std::isfinite(high_m))
      in_box = split(in_box, high_m * Line::Ones() - at).above;
  }
  if (in_box.empty()) return {};
  // Polygons that no camera removes, by the number of cameras that see them.
  std::vector<std::vector<WeightPolygon>> seen_by{{in_box}};
  for (const hull::Silhouette& s : silhouettes) {
    if (geometry::why_unusable(s.camera)) return {};
    const TriangleInImage in_image(s, t);
    std::vector<std::vector<WeightPolygon>> kept(seen_by.size() + 1);
    for (std::size_t count = 0; count < seen_by.size(); ++count)
      for (const WeightPolygon& polygon : seen_by[count]) {
        std::vector<WeightPolygon> outside;
        in_image.accept_object(polygon, kept[count + 1], outside);
        if (seen) kept[count].insert(kept[count].end(), outside.begin(), outside.end());
      }
    seen_by = std::move(kept);
  }
  std::vector<WeightPolygon> inside;
  for (std::size_t count = 0; count < seen_by.size(); ++count)
    if (!seen || int(count) >= rule.min_seen)
      inside.insert(inside.end(), seen_by[count].begin(), seen_by[count].end());
  return inside;
}

std::vector<std::vector<Vector3d>> hull_on_triangle(std::span<const hull::Silhouette> silhouettes,
                                                    const Triangle& triangle,
                                                    const hull::HullRule& rule) {
  const Triangle t = sorted(triangle);
  std::vector<std::vector<Vector3d>> polygons;
  for (const WeightPolygon& weights : weights_in_hull(silhouettes, triangle, rule)) {
    polygons.emplace_back();
    for (const Vector3d& w : weights) polygons.back().push_back(point(t, w));
  }
  return polygons;
}

TriangleTruth triangle_truth(const HullDistance& hull, const Triangle& triangle) {
  TriangleTruth truth;
  const Triangle t = sorted(triangle);
  for (const WeightPolygon& polygon : weights_in_hull(hull.silhouettes(), triangle)) {
    truth.crosses = true;
    truth.fraction_in_hull += area_fraction(polygon);
  }
  truth.inside = truth.fraction_in_hull >= 1 - kRoundingOfArea;
  truth.area_m2 = 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).norm();
  truth.area_in_hull_m2 = truth.fraction_in_hull * truth.area_m2;
  find_deepest(hull, t, truth);
  return truth;
}

}  // namespace fivepipe::collision
