#include "common/collision/tracking/component_outlines.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

struct PixelRun {  // pixels [u0, u1) of row v
  int u0, u1, v;
  std::size_t piece;
};

std::size_t root_of(std::vector<PixelRun>& runs, std::size_t i) {
  while (runs[i].piece != i) i = runs[i].piece = runs[runs[i].piece].piece;
  return i;
}

// The runs of object pixels of an image, row by row, labelled by 8-connected piece: PixelRun::piece
// is the index of the piece's first run.
class Pieces {
 public:
  explicit Pieces(const hull::SkipMap& skip_map) : bounds_(skip_map.bounds()) {
    std::size_t above = 0;
    for (int v = bounds_.v0_px; v < bounds_.v1_px; ++v) {
      const std::size_t here = runs_.size();
      first_of_row_.push_back(here);
      add_row(skip_map, v);
      for (std::size_t a = above, b = here; a < here && b < runs_.size();) {
        if (runs_[a].u0 <= runs_[b].u1 && runs_[b].u0 <= runs_[a].u1) {
          const std::size_t ra = root_of(runs_, a), rb = root_of(runs_, b);
          runs_[std::max(ra, rb)].piece = std::min(ra, rb);
        }
        if (runs_[a].u1 < runs_[b].u1)
          ++a;
        else
          ++b;
      }
      above = here;
    }
    first_of_row_.push_back(runs_.size());
    for (std::size_t i = 0; i < runs_.size(); ++i) runs_[i].piece = root_of(runs_, i);
  }

  const std::vector<PixelRun>& runs() const { return runs_; }
  std::optional<std::size_t> piece_at(int u, int v) const {
    if (v < bounds_.v0_px || v >= bounds_.v1_px) return std::nullopt;
    const auto begin =
        runs_.begin() + std::ptrdiff_t(first_of_row_[std::size_t(v - bounds_.v0_px)]);
    const auto end =
        runs_.begin() + std::ptrdiff_t(first_of_row_[std::size_t(v - bounds_.v0_px) + 1]);
    const auto run =
        std::find_if(begin, end, [&](const PixelRun& r) { return u >= r.u0 && u < r.u1; });
    return run == end ? std::nullopt : std::optional(run->piece);
  }

 private:
  void add_row(const hull::SkipMap& skip_map, int v) {
    int begin = bounds_.u1_px;
    for (int u = bounds_.u0_px; u < bounds_.u1_px;) {
      const int r = skip_map.at(hull::Quadrant::right_down, u, v);
      if (r < 0) begin = std::min(begin, u);
      if (r > 0 && begin < u) runs_.push_back({begin, u, v, runs_.size()}), begin = bounds_.u1_px;
      u += std::abs(r);
    }
    if (begin < bounds_.u1_px) runs_.push_back({begin, bounds_.u1_px, v, runs_.size()});
  }

  hull::PixelRect bounds_;
  std::vector<PixelRun> runs_;
  std::vector<std::size_t> first_of_row_;
};

using Pixel = Eigen::Vector2i;
long turn(const Pixel& a, const Pixel& b, const Pixel& c) {
  return long(b.x() - a.x()) * (c.y() - a.y()) - long(b.y() - a.y()) * (c.x() - a.x());
}

// Returns the corners of the convex hull (monotone chain: Andrew, 1979). Requires pixels sorted by
// row, then column. Returns an empty vector if the pixels are collinear.
std::vector<Pixel> convex_hull(const std::vector<Pixel>& pixels) {
  std::vector<Pixel> corners;
  const auto chain = [&](auto first, auto last) {
    const std::size_t begin = corners.size();
    for (; first != last; ++first) {
      while (corners.size() >= begin + 2 &&
             turn(corners[corners.size() - 2], corners.back(), *first) >= 0)
        corners.pop_back();
      corners.push_back(*first);
    }
    corners.pop_back();
  };
  if (pixels.size() < 3) return {};
  chain(pixels.begin(), pixels.end());
  chain(pixels.rbegin(), pixels.rend());
  return corners.size() < 3 ? std::vector<Pixel>{} : corners;
}

constexpr std::size_t kNoComponent = std::size_t(-1), kSharedPiece = kNoComponent - 1;

struct Owners {
  std::vector<std::size_t> of_piece;  // component index, kNoComponent or kSharedPiece
  std::vector<bool> clear;            // per component: it shares no piece with another one
};

Owners owners_of(const Pieces& pieces, const geometry::Camera& camera,
                 std::span<const std::vector<Vector3d>> points_world_m) {
  Owners owners{std::vector<std::size_t>(pieces.runs().size(), kNoComponent),
                std::vector<bool>(points_world_m.size(), true)};
  std::vector<std::pair<std::size_t, std::size_t>> claims;  // component, piece
  for (std::size_t component = 0; component < points_world_m.size(); ++component)
    for (const Vector3d& p : points_world_m[component]) {
      const auto uv_px = geometry::project(camera, p);
      const auto piece = uv_px ? pieces.piece_at(int(std::floor(uv_px->x() + 0.5)),
                                                 int(std::floor(uv_px->y() + 0.5)))
                               : std::nullopt;
      if (!piece) continue;
      std::size_t& owner = owners.of_piece[*piece];
      if (owner != component)
        claims.emplace_back(component, *piece),
            owner = owner == kNoComponent ? component : kSharedPiece;
    }
  for (const auto& [component, piece] : claims)
    if (owners.of_piece[piece] == kSharedPiece) owners.clear[component] = false;
  return owners;
}

}  // namespace

std::vector<std::vector<ComponentOutline>> component_outlines(
    const hull::HullQuery& query, std::span<const std::vector<Vector3d>> points_world_m) {
  std::vector<std::vector<ComponentOutline>> outlines(points_world_m.size());
  std::vector<std::vector<Pixel>> pixels(points_world_m.size());
  for (const hull::CpuHull::MapCamera& camera : query.hull().cameras()) {
    const Pieces pieces(camera.skip_map);
    Owners owners = owners_of(pieces, camera.camera, points_world_m);
    for (std::vector<Pixel>& p : pixels) p.clear();
    const hull::PixelRect image = hull::image_of(camera.camera);
    for (const PixelRun& run : pieces.runs()) {
      const std::size_t component = owners.of_piece[run.piece];
      if (component == kNoComponent || component == kSharedPiece) continue;
      if (run.u0 == image.u0_px || run.u1 == image.u1_px || run.v == image.v0_px ||
          run.v + 1 == image.v1_px)
        owners.clear[component] = false;
      pixels[component].emplace_back(run.u0, run.v);
      if (run.u1 - 1 > run.u0) pixels[component].emplace_back(run.u1 - 1, run.v);
    }
    for (std::size_t component = 0; component < outlines.size(); ++component) {
      if (!owners.clear[component]) continue;
      ComponentOutline outline{geometry::camera_center_world_m(camera.camera), {}};
      for (const Pixel& corner : convex_hull(pixels[component]))
        outline.corners_world.push_back(
            geometry::ray_through(camera.camera, corner.cast<double>()).direction_world);
      if (!outline.corners_world.empty()) outlines[component].push_back(std::move(outline));
    }
  }
  return outlines;
}

}  // namespace fivepipe::collision
