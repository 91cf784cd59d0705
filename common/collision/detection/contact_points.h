// The collision points of triangles as a walk finds them: by themselves, or as all samples of a
// part, which take room only when they are written out, once, where they belong.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/collision/detection/detection.h"

namespace fivepipe::collision {

// The samples of a part that is divided evenly, n n of them: the middles of its cells.
//
//     /\            row r = 0 ... n - 1, from below, begins at origin + (b + (r + 1/3) step) per_b
//     and has n - r middles of cells that stand,
//    /__\           to_next apart, and between each two the middle of one that hangs.
//   /\  /\          .
//  /__\/__\         .
struct SampledPart {
  Eigen::Vector3d origin_world_m, per_b_m;
  double b, step;
  Eigen::Vector3d to_next_m, between_m;
  int n;
};

class ContactPoints {
 public:
  void clear();
  // What is found from now on is another triangle's.
  void begin_triangle() { first_run_ = runs_.size(); }
  std::size_t first_run() const { return first_run_; }  // of that triangle
  std::span<Eigen::Vector3d> add(
      std::size_t count);  // to be filled in [world, m], before more is added
  void add(const Eigen::Vector3d& p_world_m) { add(1)[0] = p_world_m; }
  void add(const SampledPart& part);
  std::size_t size() const { return size_; }  // points of all triangles
  Eigen::Vector3d back() const;               // there is one

  // The triangle's points, from its first run on, in the order found; `points` is of their number.
  void write(std::size_t first_run, std::uint32_t triangle, CollisionPoint* points,
             std::size_t count) const;

 private:
  struct Run {  // single points, or those of a part
    std::size_t first, count;
    bool sampled;
  };
  std::vector<Run> runs_;
  std::vector<Eigen::Vector3d> single_world_m_;
  std::vector<SampledPart> parts_;
  std::size_t first_run_ = 0, size_ = 0;
};

}  // namespace fivepipe::collision
