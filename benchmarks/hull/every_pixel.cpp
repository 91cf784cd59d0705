#include "benchmarks/hull/every_pixel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>

#include "common/base/text_table.h"
#include "common/hull/oracle/reference.h"

namespace fivepipe::hull_bench {

std::vector<double> reference_depths_m(const HullScene& scene, const hull::View& view,
                                       base::WorkerPool& pool) {
  const int width = view.camera.pinhole.width_px, height = view.camera.pinhole.height_px;
  std::vector<double> depths_m(std::size_t(width) * std::size_t(height));
  pool.run(height, [&](int v, int) {
    for (int u = 0; u < width; ++u)
      depths_m[std::size_t(v) * std::size_t(width) + std::size_t(u)] =
          hull::reference_depth_m(scene.silhouettes, view, u, v).value_or(0);
  });
  return depths_m;
}

PixelErrors compare_every_pixel(std::span<const float> depth_m,
                                std::span<const double> reference_m) {
  assert(depth_m.size() == reference_m.size());
  PixelErrors errors{.pixels = depth_m.size()};
  for (std::size_t i = 0; i < depth_m.size(); ++i) {
    const bool hit = depth_m[i] != hull::kNoHull, expected = reference_m[i] > 0;
    errors.hits += expected;
    if (!hit && !expected) continue;
    const double error = std::abs(double(depth_m[i]) / reference_m[i] - 1);
    if (hit && expected) errors.max_depth_error = std::max(errors.max_depth_error, error);
    if (!(hit && expected && error <= kMaxDepthError)) ++errors.wrong;
  }
  return errors;
}

std::vector<Views> all_views() {
  return {{synthetic_scenes(), {{320, 240}, {640, 480}, {1920, 1080}}},
          {series_scenes(), {{640, 480}}},
          {{hand_scene("hand4", 0.68, 1.0)}, {{160, 120}, {1280, 960}}}};
}

std::string every_pixel_table(std::span<const PixelRow> rows) {
  base::TextTable table({{"scene"},
                         {"view"},
                         {"backend"},
                         {"pixels", true},
                         {"with hull", true},
                         {"wrong", true},
                         {"max depth error", true}});
  const auto add = [&](const std::string& scene, const std::string& view,
                       const std::string& backend, const PixelErrors& e) {
    table.add({scene, view, backend, std::to_string(e.pixels), std::to_string(e.hits),
               std::to_string(e.wrong), fmt::format("{:.1e}", e.max_depth_error)});
  };
  std::map<std::string, PixelErrors> totals;
  for (const PixelRow& row : rows) {
    add(row.scene, fmt::format("{}x{}", row.width_px, row.height_px), row.backend, row.errors);
    PixelErrors& total = totals[row.backend];
    total.pixels += row.errors.pixels, total.hits += row.errors.hits;
    total.wrong += row.errors.wrong;
    total.max_depth_error = std::max(total.max_depth_error, row.errors.max_depth_error);
  }
  for (const auto& [backend, total] : totals) add("all", "", backend, total);
  return table.text() +
         fmt::format(
             "Every pixel of the view against the independent reference.\n"
             "wrong: the verdict differs, or the depth by more than {:.0e} of itself.\n",
             kMaxDepthError);
}

}  // namespace fivepipe::hull_bench
