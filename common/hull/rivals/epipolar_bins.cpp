#include "common/hull/rivals/epipolar_bins.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace fivepipe::rivals {
namespace {

using Eigen::Vector3d;

// Bins per pixel of the silhouette's width across the lines: so fine that few edges end in a ray's bin; finer, and filling
// the lists takes longer than reading them.
constexpr int kBinsPerPixel = 4;
constexpr int kMostBins = 1 << 14;

// One pencil does for an epipole at least this many half sizes of the silhouette away: within it, lines are at most
// 1 / (1 - 1/2) times as dense on the near side as in the middle.
constexpr double kFar = 2;
// About a near epipole, edges are followed this far over a sector's diagonals: more than rounding, so that no line on a diagonal
// misses an edge.
constexpr float kOverDiagonal = 1.5f;

// Half-open runs of set bits in a row of words are handed to `run`.
template <class Row, class Run>
void for_runs(int words, const Row& row, const Run& run) {
  int begin = 0;
  std::uint64_t carry = 0;  // the last bit of the word before
  for (int w = 0; w <= words; ++w) {
    const std::uint64_t bits = w < words ? row(w) : 0;
    for (std::uint64_t changes = bits ^ (bits << 1 | carry); changes; changes &= changes - 1) {
      const int u = w * 64 + std::countr_zero(changes);
      if (bits >> (u & 63) & 1) begin = u;
      else run(begin, u);
    }
    carry = bits >> 63;
  }
}

}  // namespace

void EpipolarBins::build(const Silhouette& silhouette, const PixelRect& bounds, const MapFromView& map) {
  origin_u_px_ = (bounds.u0_px + bounds.u1_px) / 2;
  origin_v_px_ = (bounds.v0_px + bounds.v1_px) / 2;
  Vector3d epipole = map.at_eye;
  epipole.x() -= origin_u_px_ * epipole.z();
  epipole.y() -= origin_v_px_ * epipole.z();
  choose_sectors(bounds, epipole);
  ends_inside_ = epipole_is_near_ && epipole.z() < 0 &&
                 silhouette.pixels.contains_at(map.at_eye.x() / map.at_eye.z() - 0.5, map.at_eye.y() / map.at_eye.z() - 0.5);
  collect_edges(silhouette.pixels, bounds);
  fill();
}

// Far epipoles, those at infinity among them: lines by where they cross the silhouette's middle, on the axis across their way.
// Near ones: four quadrants about the epipole between the diagonals, lines by their slope.
void EpipolarBins::choose_sectors(const PixelRect& bounds, const Vector3d& epipole) {
  const double half_u = 0.5 * bounds.width_px() + 1, half_v = 0.5 * bounds.height_px() + 1;
  const bool along_y = std::abs(epipole.y()) * half_u > std::abs(epipole.x()) * half_v;
  const double half_a = along_y ? half_v : half_u, half_b = along_y ? half_u : half_v;
  const double e_a = along_y ? epipole.y() : epipole.x(), e_b = along_y ? epipole.x() : epipole.y();
  sectors_.clear();
  bins_ = 0;
  const auto add = [&](Sector sector, double s_begin, double s_end, double across_px) {
    sector.bins = std::clamp(int(across_px * kBinsPerPixel), 1, kMostBins);
    sector.first_bin = bins_;
    sector.s_begin = float(s_begin);
    sector.s_end = float(s_end);
    sector.bins_per_s = float(sector.bins / (s_end - s_begin));
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
    return add({along_y, 1, float(-w), 0, float(slope), e_a > 0 ? -1.0f : 1.0f, 0, 0, 0, 0, 0}, s_begin, s_end, 2 * half_b);
  }
  const float u = float(epipole.x() / epipole.z()), v = float(epipole.y() / epipole.z());
  const float outward = epipole.z() > 0 ? 1.0f : -1.0f;  // images of rays that start behind the camera come in from infinity
  for (const bool y : {false, true})
    for (const float side : {1.0f, -1.0f})
      add({y, y ? -side * v : -side * u, side, y ? u : v, 0, side * outward, 0, 0, 0, 0, 0}, -1, 1, half_u + half_v);
}

// Where rows differ from the row above, horizontal edges; where a pixel differs from the one to its left, vertical ones. Runs
// in a line are one edge; where two squares meet at a corner the runs pass through, which crossings counted by parity allow.
void EpipolarBins::collect_edges(const ObjectPixels& pixels, const PixelRect& bounds) {
  placed_.clear();
  const int words = pixels.words_per_row();
  const int first_word = bounds.u0_px >> 6, count = ((bounds.u1_px - 1) >> 6) - first_word + 1;
  run_begin_.resize(std::size_t(count) * 64 + 1);
  const std::uint64_t* all = pixels.words().data();
  const auto bits = [&](int v, int w) { return v >= bounds.v0_px && v < bounds.v1_px && w < count ? all[std::size_t(v) * words + first_word + w] : 0; };
  const int u_of_bit = first_word * 64 - origin_u_px_;
  for (int v = bounds.v0_px; v <= bounds.v1_px; ++v) {
    const int border_v = v - origin_v_px_;
    for_runs(count, [&](int w) { return bits(v, w) ^ bits(v - 1, w); }, [&](int begin, int end) { place(false, border_v, u_of_bit + begin, u_of_bit + end); });
    for (int w = 0; w <= count; ++w) {
      const auto borders = [&](int row) { return bits(row, w) ^ (bits(row, w) << 1 | (w > 0 ? bits(row, w - 1) >> 63 : 0)); };
      const std::uint64_t here = borders(v), above = borders(v - 1);
      for (std::uint64_t changes = here ^ above; changes; changes &= changes - 1) {
        const int u = w * 64 + std::countr_zero(changes);
        if (here >> (u & 63) & 1) run_begin_[std::size_t(u)] = border_v;
        else place(true, u_of_bit + u, run_begin_[std::size_t(u)], border_v);
      }
    }
  }
}

void EpipolarBins::place(bool vertical, int border, int begin, int end) {
  for (const Sector& sector : sectors_) place(sector, vertical, border, begin, end);
}

// The lines that cross an edge are those between its ends', the first counted, the last not: as ends are shared by the edges
// that meet there, and each end's s is computed in one way, every line crosses a closed border an even number of times.
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
      const float nearest = std::abs(float(border) - sector.q0) / kOverDiagonal, limit = (nearest - sector.p0) * sector.p1;
      (sector.p1 > 0 ? a0 : a1) = sector.p1 > 0 ? std::max(a0, limit) : std::min(a1, limit);
      if (!(nearest > 0 && a0 < a1)) return;
    }
    s0 = sector.s_of(a0, float(border));
    s1 = sector.s_of(a1, float(border));
  }
  if (s0 > s1) std::swap(s0, s1);
  if (!(s0 < s1 && s1 > sector.s_begin && s0 < sector.s_end)) return;
  const int least = sector.first_bin, behind = least + sector.bins;
  const auto bin = [&](float s) {
    return s < sector.s_begin ? least - 1 : s >= sector.s_end ? behind : least + std::min(int((s - sector.s_begin) * sector.bins_per_s), sector.bins - 1);
  };
  const PackedEdge edge = across ? border * int(sector.towards) * 2 : border * 2 + 1;
  placed_.push_back({edge, s0, s1, bin(s0), bin(s1), least, behind});
}

void EpipolarBins::fill() {
  // Counted two bins ahead, so that filling, one bin ahead, turns each list's begin into its end, the next one's begin.
  whole_next_.assign(std::size_t(bins_) + 3, 0);
  part_next_.assign(std::size_t(bins_) + 3, 0);
  for (const Placed& p : placed_) {
    const int whole_begin = p.bin_begin + 1;
    if (whole_begin < p.bin_end) {
      ++whole_next_[std::size_t(whole_begin) + 2];
      --whole_next_[std::size_t(p.bin_end) + 2];
    }
    if (p.bin_begin >= p.least_bin) ++part_next_[std::size_t(p.bin_begin) + 2];
    if (p.bin_end < p.end_bin && p.bin_end != p.bin_begin) ++part_next_[std::size_t(p.bin_end) + 2];
  }
  for (int crossing = 0, whole = 0, part = 0, k = 2; k < bins_ + 3; ++k) {
    crossing += whole_next_[std::size_t(k)];
    whole_next_[std::size_t(k)] = whole += crossing;
    part_next_[std::size_t(k)] = part += part_next_[std::size_t(k)];
  }
  whole_.resize(std::size_t(whole_next_.back()) + 1);  // one more: idle lanes read the first
  part_.resize(std::size_t(part_next_.back()) + 1);
  part_begin_.resize(part_.size());
  part_end_.resize(part_.size());
  const auto add_part = [&](const Placed& p, int bin) {
    const auto at = std::size_t(part_next_[std::size_t(bin) + 1]++);
    part_[at] = p.edge;
    part_begin_[at] = p.s_begin;
    part_end_[at] = p.s_end;
  };
  for (const Placed& p : placed_) {
    for (int k = p.bin_begin + 1; k < p.bin_end; ++k) whole_[std::size_t(whole_next_[std::size_t(k) + 1]++)] = p.edge;
    if (p.bin_begin >= p.least_bin) add_part(p, p.bin_begin);
    if (p.bin_end < p.end_bin && p.bin_end != p.bin_begin) add_part(p, p.bin_end);
  }
  whole_first_.swap(whole_next_);
  part_first_.swap(part_next_);
}

}  // namespace fivepipe::rivals
