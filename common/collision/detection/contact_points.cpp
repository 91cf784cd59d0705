#include "common/collision/detection/contact_points.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

Vector3d first_of_row(const SampledPart& part, int row) {
  return part.origin_world_m + (part.b + (row + 1.0 / 3) * part.step) * part.per_b_m;
}

// `part` is a copy, so that registers hold it.
CollisionPoint* write_part(const SampledPart part, std::uint32_t triangle, CollisionPoint* to) {
  for (int row = 0; row < part.n; ++row) {
    const Vector3d first = first_of_row(part, row);
    const int last = part.n - 1 - row;
    for (int column = 0; column <= last; ++column) {
      const Vector3d p = first + column * part.to_next_m;
      to->p_world_m = p, to->triangle = triangle, ++to;
      if (column < last) to->p_world_m = p + part.between_m, to->triangle = triangle, ++to;
    }
  }
  return to;
}

}  // namespace

void ContactPoints::clear() {
  runs_.clear(), single_world_m_.clear(), parts_.clear();
  first_run_ = size_ = 0;
}

std::span<Vector3d> ContactPoints::add(std::size_t count) {
  if (runs_.size() == first_run_ || runs_.back().sampled)
    runs_.push_back({single_world_m_.size(), 0, false});
  single_world_m_.resize(single_world_m_.size() + count);
  runs_.back().count += count, size_ += count;
  return std::span(single_world_m_).last(count);
}

void ContactPoints::add(const SampledPart& part) {
  const std::size_t count = std::size_t(part.n) * std::size_t(part.n);
  runs_.push_back({parts_.size(), count, true});
  parts_.push_back(part);
  size_ += count;
}

Vector3d ContactPoints::back() const {
  if (!runs_.back().sampled) return single_world_m_.back();
  return first_of_row(parts_.back(), parts_.back().n - 1);
}

void ContactPoints::write(std::size_t first_run, std::uint32_t triangle, CollisionPoint* points,
                          std::size_t count) const {
  const CollisionPoint* end = points + count;
  for (std::size_t i = first_run; points < end; ++i) {
    const Run& run = runs_[i];
    if (run.sampled) {
      points = write_part(parts_[run.first], triangle, points);
    } else {
      for (std::size_t k = run.first; k < run.first + run.count; ++k)
        points->p_world_m = single_world_m_[k], points->triangle = triangle, ++points;
    }
  }
}

}  // namespace fivepipe::collision
