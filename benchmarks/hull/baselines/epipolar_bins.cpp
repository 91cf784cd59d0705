#include "benchmarks/hull/baselines/epipolar_bins.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace fivepipe::baselines {
namespace {

using Eigen::Vector3d;

// Bins per pixel of the silhouette's width across the lines. With fewer bins, more edges end within
// a ray's bin; with more, filling the lists takes longer than reading them.
constexpr int kBinsPerPixel = 8;
constexpr int kMaxBins = 1 << 13;  // per sector, so that the steps of four sectors fit 32 bits

// One pencil suffices if the epipole is at least this many half sizes of the silhouette away: the
// lines are then at most 1 / (1 - 1/2) times as dense on the near side as at the center.
constexpr double kFar = 2;
// Around a near epipole, edges extend this far over a sector's diagonals. It exceeds the rounding,
// so that no line on a diagonal misses an edge.
constexpr float kOverDiagonal = 1.5f;

// Returns the bits that differ from the previous bit; `carry` is the last bit of the previous word.
std::uint64_t changes_of(std::uint64_t bits, std::uint64_t& carry) {
  const std::uint64_t changes = bits ^ (bits << 1 | carry);
  carry = bits >> 63;
  return changes;
}

}  // namespace

void EpipolarBins::build(const hull::Silhouette& silhouette, const hull::PixelRect& bounds,
                         const hull::MapFromView& map) {
  origin_u_px_ = (bounds.u0_px + bounds.u1_px) / 2;
  origin_v_px_ = (bounds.v0_px + bounds.v1_px) / 2;
  Vector3d epipole = map.at_eye;
  epipole.x() -= origin_u_px_ * epipole.z();
  epipole.y() -= origin_v_px_ * epipole.z();
  choose_sectors(bounds, epipole);
  ends_inside_ = epipole_is_near_ && epipole.z() < 0 &&
                 silhouette.pixels.contains_at(map.at_eye.x() / map.at_eye.z() - 0.5,
                                               map.at_eye.y() / map.at_eye.z() - 0.5);
  collect_edges(silhouette.pixels, bounds);
  fill();
  find_extents();
}

// A far epipole, which may be at infinity, gets one sector, whose lines are numbered by their
// crossing of the silhouette's central axis. A near epipole gets four sectors around it, separated
// by the diagonals, whose lines are numbered by their slope.
void EpipolarBins::choose_sectors(const hull::PixelRect& bounds, const Vector3d& epipole) {
  const double half_u = 0.5 * bounds.width_px() + 1, half_v = 0.5 * bounds.height_px() + 1;
  const bool along_y = std::abs(epipole.y()) * half_u > std::abs(epipole.x()) * half_v;
  const double half_a = along_y ? half_v : half_u, half_b = along_y ? half_u : half_v;
  const double e_a = along_y ? epipole.y() : epipole.x(), e_b = along_y ? epipole.x() : epipole.y();
  sectors_.clear();
  bins_ = 0;
  const auto add = [&](Sector sector, double s_begin, double s_end, double across_px) {
    sector.bins = std::clamp(int(across_px * kBinsPerPixel), 1, kMaxBins);
    sector.first_bin = bins_;
    sector.s_begin = float(s_begin);
    sector.s_end = float(s_end);
    sector.steps_per_s = float(double(sector.bins) * kStepsPerBin / (s_end - s_begin));
    bins_ += sector.bins;
    sectors_.push_back(sector);
  };
  epipole_is_near_ = !(std::abs(e_a) >= kFar * half_a * std::abs(epipole.z()));
  if (!epipole_is_near_) {
    const double w = epipole.z() / e_a, slope = e_b / e_a;
    double s_begin = half_b, s_end = -half_b;
    for (const double a : {-half_a, half_a})
      for (const double b : {-half_b, half_b}) {
        s_begin = std::min(s_begin, (b - slope * a) / (1 - w * a));
        s_end = std::max(s_end, (b - slope * a) / (1 - w * a));
      }
    return add({along_y, 1, float(-w), 0, float(slope), e_a > 0 ? -1.0f : 1.0f, 0, 0, 0, 0, 0},
               s_begin, s_end, 2 * half_b);
  }
  const float u = float(epipole.x() / epipole.z()), v = float(epipole.y() / epipole.z());
  // The images of rays that start behind the camera begin at infinity.
  const float outward = epipole.z() > 0 ? 1.0f : -1.0f;
  for (const bool y : {false, true})
    for (const float side : {1.0f, -1.0f})
      add({y, y ? -side * v : -side * u, side, y ? u : v, 0, side * outward, 0, 0, 0, 0, 0}, -1, 1,
          half_u + half_v);
}

// A pixel that differs from the one above it has a horizontal edge, and one that differs from the
// pixel to its left a vertical edge. Collinear runs form one edge. Runs continue through a corner
// where two squares meet, which is valid because crossings are counted by parity.
void EpipolarBins::collect_edges(const hull::ObjectPixels& pixels, const hull::PixelRect& bounds) {
  placed_.clear();
  const auto first_word = std::size_t(bounds.u0_px >> 6),
             words = std::size_t((bounds.u1_px - 1) >> 6) - first_word +
                     2;  // includes an empty one at the end
  run_begin_.resize(words * 64);
  above_.assign(words, 0);
  vertical_above_.assign(words, 0);
  const int u_of_bit = int(first_word) * 64 - origin_u_px_;
  for (int v = bounds.v0_px; v <= bounds.v1_px; ++v) {
    const std::uint64_t* row = pixels.words().data() + std::size_t(v) * pixels.words_per_row() +
                               first_word;  // the word after the last is not read
    const int border = v - origin_v_px_;
    std::uint64_t carry = 0, horizontal_carry = 0;
    int begin = 0;
    for (std::size_t w = 0; w < words; ++w) {
      const std::uint64_t bits = v < bounds.v1_px && w + 1 < words ? row[w] : 0,
                          horizontal = bits ^ above_[w], vertical = changes_of(bits, carry);
      for (std::uint64_t changes = changes_of(horizontal, horizontal_carry); changes;
           changes &= changes - 1) {
        const int bit = std::countr_zero(changes), u = u_of_bit + int(w) * 64 + bit;
        if (horizontal >> bit & 1)
          begin = u;
        else
          place(false, border, begin, u);
      }
      for (std::uint64_t changes = vertical ^ vertical_above_[w]; changes; changes &= changes - 1) {
        const int bit = std::countr_zero(changes);
        int& run_begin = run_begin_[w * 64 + std::size_t(bit)];
        if (vertical >> bit & 1)
          run_begin = border;
        else
          place(true, u_of_bit + int(w) * 64 + bit, run_begin, border);
      }
      above_[w] = bits;
      vertical_above_[w] = vertical;
    }
  }
}

void EpipolarBins::place(bool vertical, int border, int begin, int end) {
  for (const Sector& sector : sectors_) place(sector, vertical, border, begin, end);
}

// The lines between those of an edge's two ends cross it, including the first and excluding the
// last. Adjacent edges share their ends, and an end's s is always computed the same way, so every
// line crosses a closed border an even number of times.
void EpipolarBins::place(const Sector& sector, bool vertical, int border, int begin, int end) {
  const bool across = vertical != sector.advances_along_y;
  float s0, s1;
  if (across) {
    const float a = float(border);
    if (!(sector.p0 + sector.p1 * a > 0)) return;
    s0 = sector.s_of(a, float(begin));
    s1 = sector.s_of(a, float(end));
  } else {
    float a0 = float(begin), a1 = float(end);
    if (epipole_is_near_) {
      const float nearest = std::abs(float(border) - sector.q0) / kOverDiagonal,
                  limit = (nearest - sector.p0) * sector.p1;
      (sector.p1 > 0 ? a0 : a1) = sector.p1 > 0 ? std::max(a0, limit) : std::min(a1, limit);
      if (!(nearest > 0 && a0 < a1)) return;
    }
    s0 = sector.s_of(a0, float(border));
    s1 = sector.s_of(a1, float(border));
  }
  if (s0 > s1) std::swap(s0, s1);
  if (!(s0 < s1 && s1 > sector.s_begin && s0 < sector.s_end)) return;
  const std::int32_t first = sector.first_bin * kStepsPerBin, count = sector.bins * kStepsPerBin;
  const auto step = [&](float s) {
    return s <= sector.s_begin ? 0
           : s >= sector.s_end
               ? count
               : std::min(std::int32_t((s - sector.s_begin) * sector.steps_per_s), count);
  };
  const int edge = across ? border * int(sector.towards) * 2 : border * 2 + 1;
  const float a0 = sector.towards * float(across ? border : begin),
              a1 = sector.towards * float(across ? border : end);
  const Placed placed{PackedEdge(edge), first + step(s0), first + step(s1), std::min(a0, a1),
                      std::max(a0, a1)};
  if (placed.begin < placed.end) placed_.push_back(placed);
}

void EpipolarBins::fill() {
  // The range of bins that an edge spans completely. The bins just before and after may hold a
  // part.
  const auto whole_begin = [](const Placed& p) {
    return (p.begin + kStepsPerBin - 1) >> kStepBits;
  };
  const auto whole_end = [](const Placed& p) { return p.end >> kStepBits; };
  whole_next_.assign(std::size_t(bins_) + 2, 0);
  part_next_.assign(std::size_t(bins_) + 2, 0);
  for (const Placed& p : placed_) {
    const int from = p.begin >> kStepBits, begin = whole_begin(p), end = whole_end(p);
    if (begin < end) {
      ++whole_next_[std::size_t(begin)];
      --whole_next_[std::size_t(end)];
    }
    if (from < begin) ++part_next_[std::size_t(from)];
    if (end >= begin && (p.end & (kStepsPerBin - 1))) ++part_next_[std::size_t(end)];
  }
  // Turns the counts into the begin of each list.
  whole_first_.resize(whole_next_.size());
  part_first_.resize(part_next_.size());
  int crossing = 0, pairs = 0, parts = 0, longest_pairs = 0, longest_part = 0;
  for (std::size_t k = 0; k < whole_next_.size(); ++k) {
    crossing += whole_next_[k];
    const int pair_count = (crossing + 1) / 2, part_count = part_next_[k];
    whole_first_[k] = pairs;
    whole_next_[k] = 2 * pairs;
    part_first_[k] = part_next_[k] = parts;
    pairs += pair_count;
    parts += part_count;
    longest_pairs = std::max(longest_pairs, pair_count);
    longest_part = std::max(longest_part, part_count);
  }
  whole_.assign(2 * std::size_t(pairs + longest_pairs), kNoEdge);
  part_.resize(std::size_t(parts + longest_part));
  part_steps_.resize(part_.size());
  const auto add_part = [&](PackedEdge edge, int bin, std::int32_t begin, std::int32_t end) {
    const auto at = std::size_t(part_next_[std::size_t(bin)]++);
    part_[at] = edge;
    part_steps_[at] = std::uint32_t(begin) | std::uint32_t(end) << 16;
  };
  for (const Placed& p : placed_) {
    const int from = p.begin >> kStepBits, begin = whole_begin(p), end = whole_end(p);
    for (int k = begin; k < end; ++k) whole_[std::size_t(whole_next_[std::size_t(k)]++)] = p.edge;
    if (from < begin)
      add_part(p.edge, from, p.begin & (kStepsPerBin - 1),
               end >= begin ? kStepsPerBin : p.end & (kStepsPerBin - 1));
    if (end >= begin && (p.end & (kStepsPerBin - 1)))
      add_part(p.edge, end, 0, p.end & (kStepsPerBin - 1));
  }
}

// Builds a sparse table: the extremes over any range of groups follow from two of its entries.
void EpipolarBins::find_extents() {
  groups_ = epipole_is_near_ ? 0 : (bins_ + kGroupBins - 1) / kGroupBins;
  const auto groups = std::size_t(groups_), levels = std::size_t(std::bit_width(groups));
  nearest_.assign(groups * levels, std::numeric_limits<float>::infinity());
  farthest_.assign(groups * levels, -std::numeric_limits<float>::infinity());
  if (groups == 0) return;
  for (const Placed& p : placed_)
    for (int group = p.begin >> (kStepBits + kGroupBits),
             last = (p.end - 1) >> (kStepBits + kGroupBits);
         group <= last; ++group) {
      nearest_[std::size_t(group)] = std::min(nearest_[std::size_t(group)], p.nearest);
      farthest_[std::size_t(group)] = std::max(farthest_[std::size_t(group)], p.farthest);
    }
  for (std::size_t level = 1; level < levels; ++level) {
    const std::size_t half = std::size_t(1) << (level - 1), below = (level - 1) * groups,
                      here = level * groups;
    for (std::size_t g = 0; g < groups; ++g) {
      const std::size_t other = std::min(g + half, groups - 1);
      nearest_[here + g] = std::min(nearest_[below + g], nearest_[below + other]);
      farthest_[here + g] = std::max(farthest_[below + g], farthest_[below + other]);
    }
  }
}

}  // namespace fivepipe::baselines
