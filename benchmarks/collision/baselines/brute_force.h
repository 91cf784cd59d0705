// Baseline: tests uniform samples of every triangle on the CPU; the paper's volume query (section
// 4.2.4) without OpenGL.
//
// Optimised for a fair comparison:
// - Objects whose box the silhouettes certify free are skipped, and so are triangles whose image
//   in a camera is outside the bounds of its object pixels.
// - SIMD projects a triangle's samples by the homography of its plane into each map, relative to
//   the triangle's first pixel, in float with certified margins. Samples that the margins leave
//   uncertain are tested again in double.
// - Maps are read as packed bits. The first camera that sees all samples of a vector outside its
//   object pixels ends the vector.
// - The maps need no preparation except their bounds.
#pragma once
#include <span>
#include <vector>

#include "benchmarks/collision/baselines/brute_force_simd.h"
#include "common/base/worker_pool.h"
#include "common/collision/detection/detection.h"
#include "common/collision/detection/triangle.h"
#include "common/hull/hull.h"

namespace fivepipe::baselines {

// A sample is the point base0 + base * (base1 - base0) + side * (apex - base0) of a TriangleView.
// The coordinates are float, taken as exact, so that all machines get the same samples.
struct TriangleSample {
  float base, side;
};
// Returns the centers of those of `across` x `across` viewport pixels that the triangle covers
// (half of them, see TriangleView), row by row.
std::vector<TriangleSample> triangle_samples(const collision::TriangleView& view, int across);
// The sample in the world frame, in m.
Eigen::Vector3d point_at(const collision::TriangleView& view, const TriangleSample& sample);

class BruteForce {
 public:
  explicit BruteForce(int across);  // 1 to 1024

  // The hull rule is `limits: all`. Borrows the maps, which must outlive the next detect().
  void set_silhouettes(std::span<const hull::Silhouette> silhouettes);

  // A triangle collides if one of its samples is in_hull(); its points are all such samples, in
  // their order. No triangle is undecided. The result does not depend on the pool's threads.
  // Vertices must be finite.
  std::vector<collision::ObjectCollision> detect(
      std::span<const std::vector<collision::Triangle>> objects_world_m, base::WorkerPool& pool);

  std::size_t samples_tested() const { return samples_tested_; }  // by the last detect()

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
  std::vector<float> x_, y_;  // pixel centers, padded
  std::span<const hull::Silhouette> silhouettes_;
  struct Map {
    Eigen::Matrix<double, 3, 4> pixel_from_world;  // homogeneous; pixel p covers [p, p + 1)
    hull::PixelRect bounds;
  };
  std::vector<Map> maps_;
  bool empty_ = true;
  std::vector<Piece> pieces_;  // keeps its buffers
  std::size_t samples_tested_ = 0;
};

}  // namespace fivepipe::baselines
