// Rival: every triangle sampled evenly, all samples asked, on the CPU: the paper's volume query
// (section 4.2.4) without OpenGL.
//
// Done to be fair. Objects whose box the silhouettes alone certify free are left out; so are
// triangles that lie beside a camera's object pixels in its image. A triangle's samples are
// projected together: its plane's homography into each map, relative to its own first pixel, in
// vector lanes of float with certified margins; maps are read as packed bits; the first camera that
// has all of a vector's samples off its object ends them. What margins leave open is asked in
// double. No preparation of the maps but their bounds.
#pragma once
#include <span>
#include <vector>

#include "benchmarks/collision/baselines/brute_force_simd.h"
#include "common/base/worker_pool.h"
#include "common/collision/detection/detection.h"
#include "common/collision/detection/triangle.h"
#include "common/hull/hull.h"

namespace fivepipe::baselines {

// The centres of `across` x `across` viewport pixels that the triangle covers, half of them
// (TriangleView), in rows: a point of the triangle is base0 + base * (base1 - base0) + side * (apex
// - base0). In float, so that the same ones come out everywhere; each float is taken as exact.
struct TriangleSample {
  float base, side;
};
std::vector<TriangleSample> triangle_samples(const collision::TriangleView& view, int across);
Eigen::Vector3d point_at(const collision::TriangleView& view, const TriangleSample& sample);

class BruteForce {
 public:
  explicit BruteForce(int across);  // 1 to 1024

  // `limits: all`. Maps are borrowed and must outlive the next detect.
  void set_silhouettes(std::span<const hull::Silhouette> silhouettes);

  // Of each object: a triangle collides where one of its samples is in_hull(), which are all its
  // points, in the samples' order; no other is said to touch. Does not depend on the pool's
  // threads. Vertices must be finite.
  std::vector<collision::ObjectCollision> detect(
      std::span<const std::vector<collision::Triangle>> objects_world_m, base::WorkerPool& pool);

  std::size_t samples_tested() const { return samples_tested_; }  // by the last detect

 private:
  struct Thread;
  struct Hit {
    TriangleSample sample;
    std::uint32_t triangle;
  };
  struct Piece {
    std::size_t object, first, count, samples;
    std::vector<Hit> hits;
  };
  std::size_t cut(std::span<const std::vector<collision::Triangle>> objects_world_m);
  bool set_up(const collision::TriangleView& view, Thread& thread) const;
  void query(std::span<const collision::Triangle> triangles, Piece& piece, Thread& thread) const;

  int across_;
  std::vector<float> x_, y_;  // pixel centres, padded
  std::span<const hull::Silhouette> silhouettes_;
  struct Map {
    Eigen::Matrix<double, 3, 4> pixel_from_world;  // homogeneous; pixel p covers [p, p + 1)
    hull::PixelRect bounds;
  };
  std::vector<Map> maps_;
  bool empty_ = true;
  std::vector<Piece> pieces_;  // kept for their buffers
  std::size_t samples_tested_ = 0;
};

}  // namespace fivepipe::baselines
