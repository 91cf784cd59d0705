#include "benchmarks/collision/baselines/brute_force.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/collision/detection/box_query.h"

namespace fivepipe::baselines {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kBatchSize = 64;  // triangles per unit of work
// A triangle is outside the object pixels' bounds only if it is so by more than this, which exceeds
// the rounding in double.
constexpr double kBeside_px = 1e-6;

}  // namespace

std::vector<TriangleSample> triangle_samples(const collision::TriangleView& view, int across) {
  std::vector<TriangleSample> samples;
  const float pixel = 1.0f / float(across), apex_x = float(view.apex_x);
  for (int row = 0; row < across; ++row)
    for (int column = 0; column < across; ++column) {
      const float side = (float(row) + 0.5f) * pixel, product = side * apex_x,
                  base = (float(column) + 0.5f) * pixel - product;
      if (base >= 0 && base <= 1 - side) samples.push_back({base, side});
    }
  return samples;
}

Vector3d point_at(const collision::TriangleView& view, const TriangleSample& sample) {
  return view.base0_world_m + double(sample.base) * (view.base1_world_m - view.base0_world_m) +
         double(sample.side) * (view.apex_world_m - view.base0_world_m);
}

struct BruteForce::Thread {
  std::vector<SampledMap> maps;
  std::vector<float> base, side;
  std::vector<hull::InHull> verdicts;
};

BruteForce::BruteForce(int across) : across_(across) {
  if (!(across > 0 && across <= 1024))
    throw std::invalid_argument("BruteForce: `across` must be 1 to 1024");
  const float pixel = 1.0f / float(across);
  for (int row = 0; row < across; ++row)
    for (int column = 0; column < across; ++column) {
      x_.push_back((float(column) + 0.5f) * pixel);
      y_.push_back((float(row) + 0.5f) * pixel);
    }
  x_.resize(x_.size() + kSimdPadding);
  y_.resize(y_.size() + kSimdPadding);
}

void BruteForce::set_silhouettes(std::span<const hull::Silhouette> silhouettes) {
  silhouettes_ = silhouettes;
  maps_.clear();
  empty_ = silhouettes.empty();
  for (const hull::Silhouette& s : silhouettes) {
    maps_.push_back({geometry::pixel_from_camera(s.camera.pinhole) *
                         s.camera.camera_from_world.matrix().topRows<3>(),
                     s.pixels.bounds()});
    empty_ = empty_ || maps_.back().bounds.empty();
  }
}

// Returns false if the triangle is outside the bounds of some camera's object pixels.
bool BruteForce::set_up(const collision::TriangleView& view, Thread& thread) const {
  thread.maps.clear();
  for (std::size_t i = 0; i < maps_.size(); ++i) {
    const Map& map = maps_[i];
    const Vector3d corners[] = {map.pixel_from_world * view.base0_world_m.homogeneous(),
                                map.pixel_from_world * view.base1_world_m.homogeneous(),
                                map.pixel_from_world * view.apex_world_m.homogeneous()};
    // If the homogeneous coordinates of all three corners lie on one side of a line in the image,
    // so does every point of the triangle that is in front of the camera.
    const auto outside = [&](int axis, double sign, double border_px) {
      return std::all_of(corners, corners + 3, [&](const Vector3d& c) {
        return sign * (c[axis] - (border_px + sign * kBeside_px) * c.z()) > 0;
      });
    };
    if (outside(0, -1, map.bounds.u0_px) || outside(0, 1, map.bounds.u1_px) ||
        outside(1, -1, map.bounds.v0_px) || outside(1, 1, map.bounds.v1_px))
      return false;
    // The reference pixel is within the bounds, so its bit is inside the map.
    const auto reference_px = [&](int axis, int low_px, int high_px) {
      return corners[0].z() > 0 ? std::clamp(std::floor(corners[0][axis] / corners[0].z()),
                                             double(low_px), double(high_px))
                                : double(low_px);
    };
    const double u_px = reference_px(0, map.bounds.u0_px, map.bounds.u1_px),
                 v_px = reference_px(1, map.bounds.v0_px, map.bounds.v1_px);
    SampledMap m;
    const auto relative = [&](const Vector3d& c) {
      return Vector3d(c.x() - u_px * c.z(), c.y() - v_px * c.z(), c.z());
    };
    const Vector3d of_1 = relative(corners[0]), of_base = relative(corners[1]) - of_1,
                   of_side = relative(corners[2]) - of_1;
    for (int axis = 0; axis < 3; ++axis) {
      m.of_1[axis] = float(of_1[axis]);
      m.of_base[axis] = float(of_base[axis]);
      m.of_side[axis] = float(of_side[axis]);
      m.size[axis] =
          float(std::abs(of_1[axis]) + std::abs(of_base[axis]) + std::abs(of_side[axis]));
    }
    m.u0_px = float(map.bounds.u0_px - u_px), m.u1_px = float(map.bounds.u1_px - u_px);
    m.v0_px = float(map.bounds.v0_px - v_px), m.v1_px = float(map.bounds.v1_px - v_px);
    const hull::ObjectPixels& pixels = silhouettes_[i].pixels;
    m.row_bits = 64 * pixels.words_per_row();
    m.first_bit = std::int32_t(v_px) * m.row_bits + std::int32_t(u_px);
    m.bits = reinterpret_cast<const std::uint32_t*>(pixels.words().data());  // little-endian hosts
    thread.maps.push_back(m);
  }
  return true;
}

void BruteForce::query(std::span<const collision::Triangle> triangles, Piece& piece,
                       Thread& thread) const {
  const std::size_t pixels = std::size_t(across_) * std::size_t(across_);
  thread.base.resize(pixels + 2 * kSimdPadding);
  thread.side.resize(pixels + 2 * kSimdPadding);
  thread.verdicts.resize(pixels);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const collision::TriangleView view = collision::view_of(triangles[i]);
    if (!set_up(view, thread)) continue;
    const std::size_t count = covered_samples(x_.data(), y_.data(), pixels, float(view.apex_x),
                                              thread.base.data(), thread.side.data());
    samples_in_hull(thread.maps, thread.base.data(), thread.side.data(), count,
                    thread.verdicts.data());
    piece.samples += count;
    for (std::size_t n = 0; n < count; ++n) {
      if (thread.verdicts[n] == hull::InHull::no) continue;
      const TriangleSample sample{thread.base[n], thread.side[n]};
      if (thread.verdicts[n] == hull::InHull::yes ||
          hull::in_hull(silhouettes_, point_at(view, sample)))
        piece.hits.push_back({sample, std::uint32_t(piece.first + i)});
    }
  }
}

// Divides the triangles into units of work, without objects that are certified free. Returns the
// number of units.
std::size_t BruteForce::cut(std::span<const std::vector<collision::Triangle>> objects_world_m) {
  std::size_t pieces = 0;
  for (std::size_t o = 0; o < objects_world_m.size(); ++o) {
    Eigen::AlignedBox3d box_world_m;
    for (const collision::Triangle& t : objects_world_m[o])
      for (const Vector3d& v : t) box_world_m.extend(v);
    if (objects_world_m[o].empty() || collision::is_certainly_free(silhouettes_, box_world_m))
      continue;
    for (std::size_t first = 0; first < objects_world_m[o].size(); first += kBatchSize) {
      if (pieces == pieces_.size()) pieces_.emplace_back();
      Piece& piece = pieces_[pieces++];
      piece.object = o, piece.first = first,
      piece.count = std::min(kBatchSize, objects_world_m[o].size() - first), piece.samples = 0;
      piece.hits.clear();
    }
  }
  return pieces;
}

std::vector<collision::ObjectCollision> BruteForce::detect(
    std::span<const std::vector<collision::Triangle>> objects_world_m, base::WorkerPool& pool) {
  std::vector<collision::ObjectCollision> objects(objects_world_m.size());
  samples_tested_ = 0;
  if (empty_) return objects;
  const std::size_t pieces = cut(objects_world_m);
  std::vector<Thread> threads(std::size_t(pool.threads()));
  pool.run(int(pieces), [&](int i, int thread) {
    Piece& piece = pieces_[std::size_t(i)];
    query(std::span(objects_world_m[piece.object]).subspan(piece.first, piece.count), piece,
          threads[std::size_t(thread)]);
  });
  std::vector<std::size_t> points(objects.size());
  for (const Piece& piece : std::span(pieces_).first(pieces))
    points[piece.object] += piece.hits.size();
  for (const Piece& piece : std::span(pieces_).first(pieces)) {
    collision::ObjectCollision& object = objects[piece.object];
    object.points.reserve(points[piece.object]);
    samples_tested_ += piece.samples;
    collision::TriangleView view;
    for (const Hit& hit : piece.hits) {
      if (object.triangles.empty() || object.triangles.back() != hit.triangle) {
        object.triangles.push_back(hit.triangle);
        view = collision::view_of(objects_world_m[piece.object][hit.triangle]);
      }
      object.points.push_back({point_at(view, hit.sample), hit.triangle});
    }
    if (!object.points.empty()) object.verdict = collision::CollisionVerdict::colliding;
  }
  return objects;
}

}  // namespace fivepipe::baselines
