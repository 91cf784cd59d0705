// Collision points as the triangle walk finds them: single points, or all samples of a part. The
// samples of a part are computed only when write() puts them into their final array, once.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/collision/detection/detection.h"

namespace fivepipe::collision {

// The n * n samples of a part of a triangle: the centers of its cells. All vectors are in the world
// frame.
//
//        /\          Row r = 0 ... n - 1, from the bottom, starts at
//       /__\         origin_world_m + (b + (r + 1/3) step) per_b_m.
//      /\  /\        It has n - r centers of upright cells, to_next_m apart, and between
//     /__\/__\       each two of them, between_m further, the center of an inverted cell.
struct SampledPart {
  Eigen::Vector3d origin_world_m, per_b_m;
  double b, step;
  Eigen::Vector3d to_next_m, between_m;
  int n;
};

class ContactPoints {
 public:
  void clear();
  // Starts the next triangle: the points of later add() calls belong to it.
  void begin_triangle() { first_run_ = runs_.size(); }
  // The current triangle's first run, for write().
  std::size_t first_run() const { return first_run_; }
  // Adds `count` points, which the caller fills in [world, m] before it adds more.
  std::span<Eigen::Vector3d> add(std::size_t count);
  void add(const Eigen::Vector3d& p_world_m) { add(1)[0] = p_world_m; }
  void add(const SampledPart& part);
  // Number of points of all triangles.
  std::size_t size() const { return size_; }
  // The last point [world, m]; requires size() > 0.
  Eigen::Vector3d back() const;

  // Writes the `count` points of the triangle that starts at `first_run` to `points`, in the order
  // of their addition.
  void write(std::size_t first_run, std::uint32_t triangle, CollisionPoint* points,
             std::size_t count) const;

 private:
  // Consecutive single points, or the samples of one part.
  struct Run {
    std::size_t first, count;
    bool sampled;
  };
  std::vector<Run> runs_;
  std::vector<Eigen::Vector3d> single_world_m_;
  std::vector<SampledPart> parts_;
  std::size_t first_run_ = 0, size_ = 0;
};

}  // namespace fivepipe::collision
