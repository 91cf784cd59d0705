#include "capture_node/segmentation/components.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <vector>

namespace fivepipe::capture {
namespace {

struct Run {
  int v, begin, end;  // pixels [begin, end) of row v
  int parent;         // index of a run of the same component; its own index: the root
  int area;           // of the component, if it is the root
  bool kept;          // likewise
};

int root_of(std::vector<Run>& runs, int i) {
  while (runs[i].parent != i) {
    runs[i].parent = runs[runs[i].parent].parent;
    i = runs[i].parent;
  }
  return i;
}

// The smaller index becomes the root.
void unite(std::vector<Run>& runs, int a, int b) {
  a = root_of(runs, a);
  b = root_of(runs, b);
  if (a == b) return;
  if (b < a) std::swap(a, b);
  runs[b].parent = a;
  runs[a].area += runs[b].area;
  runs[a].kept |= runs[b].kept;
}

// Unites the runs [above, here) of one row with those from `here` on, of the row below. `reach` is
// 1 if diagonal neighbours are connected, else 0.
void unite_rows(std::vector<Run>& runs, int above, int here, int reach) {
  const int count = int(runs.size());
  for (int a = above, b = here; a < here && b < count;) {
    if (runs[a].begin < runs[b].end + reach && runs[b].begin < runs[a].end + reach)
      unite(runs, a, b);
    if (runs[a].end < runs[b].end)
      ++a;
    else
      ++b;
  }
}

// Appends the runs of set bits of the row; `of_word(w)` is its word w.
template <class OfWord>
void append_runs(std::vector<Run>& runs, int v, int words, OfWord of_word) {
  int begin = -1;
  for (int w = 0; w < words; ++w) {
    std::uint64_t word = of_word(w);
    // Bits at which a run begins or ends.
    std::uint64_t changes = word ^ (word << 1 | std::uint64_t(begin >= 0));
    for (; changes != 0; changes &= changes - 1) {
      const int u = 64 * w + std::countr_zero(changes);
      if (begin < 0) {
        begin = u;
        continue;
      }
      runs.push_back({v, begin, u, int(runs.size()), u - begin, false});
      begin = -1;
    }
  }
  if (begin >= 0)
    runs.push_back({v, begin, 64 * words, int(runs.size()), 64 * words - begin, false});
}

bool any_set(const std::uint64_t* row, int begin, int end) {
  for (int u = begin; u < end;) {
    const int count = std::min(end, (u | 63) + 1) - u;
    const std::uint64_t bits = row[u >> 6] >> (u & 63) &
                               (count == 64 ? ~std::uint64_t(0) : (std::uint64_t(1) << count) - 1);
    if (bits != 0) return true;
    u += count;
  }
  return false;
}

}  // namespace

hull::ObjectPixels seeded_components(const hull::ObjectPixels& pixels,
                                     const hull::ObjectPixels& seeds, int min_area_px) {
  assert(pixels.width_px() == seeds.width_px() && pixels.height_px() == seeds.height_px());
  const int words = pixels.words_per_row();
  std::vector<Run> runs;
  int above = 0, here = 0;
  for (int v = 0; v < pixels.height_px(); ++v) {
    const std::uint64_t* row = pixels.words().data() + std::size_t(v) * words;
    const std::uint64_t* seed_row = seeds.words().data() + std::size_t(v) * words;
    append_runs(runs, v, words, [&](int w) { return row[w]; });
    for (std::size_t i = std::size_t(here); i < runs.size(); ++i)
      runs[i].kept = any_set(seed_row, runs[i].begin, runs[i].end);
    unite_rows(runs, above, here, 1);
    above = here;
    here = int(runs.size());
  }
  hull::ObjectPixels result(pixels.width_px(), pixels.height_px());
  for (int i = 0; i < int(runs.size()); ++i) {
    const Run& root = runs[std::size_t(root_of(runs, i))];
    const Run& run = runs[std::size_t(i)];
    if (root.kept && root.area >= min_area_px) result.set_run(run.begin, run.end, run.v);
  }
  return result;
}

hull::ObjectPixels with_holes_filled(const hull::ObjectPixels& pixels, int max_area_px) {
  hull::ObjectPixels result = pixels;
  if (max_area_px <= 0) return result;
  const int words = pixels.words_per_row(), width = pixels.width_px(), height = pixels.height_px();
  // A hole is between the first and the last object pixel of its rows, so only the gaps between
  // runs count. A gap that reaches an end of its row is open; it needs no run, because what touches
  // it is marked as open.
  std::vector<Run> gaps;
  int above = 0, here = 0;
  std::vector<Run> row_runs;
  int first_above = 0, last_above = 0;  // the span of object pixels in the row above
  for (int v = 0; v < height; ++v) {
    row_runs.clear();
    const std::uint64_t* row = pixels.words().data() + std::size_t(v) * words;
    append_runs(row_runs, v, words, [&](int w) { return row[w]; });
    const int first = row_runs.empty() ? width : row_runs.front().begin,
              last = row_runs.empty() ? 0 : row_runs.back().end;
    for (std::size_t i = 1; i < row_runs.size(); ++i) {
      const int begin = row_runs[i - 1].end, end = row_runs[i].begin, index = int(gaps.size());
      // `kept` means open: at the border of the image, or beside the outer part of the row above.
      const bool is_open = v == 0 || v + 1 == height || begin < first_above || end > last_above;
      gaps.push_back({v, begin, end, index, end - begin, is_open});
    }
    unite_rows(gaps, above, here, 0);
    // The outer parts of this row open the gaps above that they touch.
    for (int i = above; i < here; ++i)
      if (gaps[std::size_t(i)].begin < first || gaps[std::size_t(i)].end > last)
        gaps[std::size_t(root_of(gaps, i))].kept = true;
    above = here;
    here = int(gaps.size());
    first_above = first;
    last_above = last;
  }
  for (int i = 0; i < int(gaps.size()); ++i) {
    const Run& root = gaps[std::size_t(root_of(gaps, i))];
    const Run& gap = gaps[std::size_t(i)];
    if (!root.kept && root.area <= max_area_px) result.set_run(gap.begin, gap.end, gap.v);
  }
  return result;
}

}  // namespace fivepipe::capture
