// Tables of the hull's depth, from hull.json. Results are named method/scene/view/threads.
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "benchmarks/figures/documents.h"
#include "benchmarks/figures/numbers.h"

namespace fivepipe::figures {
namespace {

constexpr const char *kHull = "hull", *kEveryPixel = "hull_every_pixel";
// A baseline counts as an alternative to the exact methods up to this mean error.
constexpr double kFairError_mm = 2;

struct HullName {
  std::string method, scene, view;
  int threads = 0;
};
HullName parsed(const json& result) {
  const std::string name = result.at("name");
  const std::size_t a = name.find('/'), b = name.find('/', a + 1), c = name.rfind('/');
  if (b == std::string::npos || c <= b) throw std::runtime_error("unexpected name " + name);
  return {name.substr(0, a), name.substr(a + 1, b - a - 1), name.substr(b + 1, c - b - 1),
          std::stoi(name.substr(c + 1))};
}

// The results of one scene, view and number of threads.
struct ViewResults {
  std::string scene, view;
  std::map<std::string, const json*> by_method;
  double median_ms(const std::string& method) const { return time_ms(*by_method.at(method)); }
};

int hull_threads(const Results& results) {
  int threads = 1;
  for (const json& r : results.all(kHull)) threads = std::max(threads, parsed(r).threads);
  return threads;
}

// All views, in the order of the file, on the largest number of threads.
std::vector<ViewResults> views(const Results& results) {
  const int threads = hull_threads(results);
  std::vector<ViewResults> views;
  for (const json& r : results.all(kHull)) {
    const HullName name = parsed(r);
    if (name.threads != threads) continue;
    auto view = std::find_if(views.begin(), views.end(), [&](const ViewResults& v) {
      return v.scene == name.scene && v.view == name.view;
    });
    if (view == views.end()) view = views.insert(views.end(), {name.scene, name.view, {}});
    view->by_method[name.method] = &r;
  }
  return views;
}

bool is_exact(const std::string& method) {
  return method == "cpu" || method == "gl" || method == "ibvh";
}

// The fastest method that is not exact, with a mean error of at most kFairError_mm.
const json* fastest_inexact(const ViewResults& view) {
  const json* fastest = nullptr;
  for (const auto& [method, result] : view.by_method)
    if (!is_exact(method) && error_of(*result, "depth_mean_mm") <= kFairError_mm &&
        (!fastest || time_ms(*result) < time_ms(*fastest)))
      fastest = result;
  return fastest;
}

std::string maps_text(const json& result) {
  return fmt::format("{:.0f} of {:.0f}x{:.0f}, {:.0f} %", count_of(result, "cameras"),
                     count_of(result, "map_width_px"), count_of(result, "map_height_px"),
                     count_of(result, "maps_covered_percent"));
}

// "plane sweep, 160 planes, 1.6 mm". The methods are those of benchmarks/hull/.
std::string inexact_text(const json& result) {
  static const std::pair<std::string, std::string> kNames[] = {
      {"glsweep", "the paper's stencil sweep, {} planes"},
      {"cpusweepmid", "plane sweep, {} planes"},
      {"plainsweep", "plane sweep without empty-space skipping, {} planes"},
      {"cpusweep", "plane sweep with the depth of the plane, {} planes"},
      {"carve", "voxel carving, {}"}};
  const std::string method = parsed(result).method;
  for (const auto& [prefix, text] : kNames) {
    if (!method.starts_with(prefix)) continue;
    std::string setting = method.substr(prefix.size());
    if (setting.ends_with("mm")) setting.insert(setting.size() - 2, " ");
    return fmt::format(fmt::runtime(text), setting) + ", " +
           error_mm(error_of(result, "depth_mean_mm"));
  }
  throw std::runtime_error("no name for method " + method);
}

// The time of a method, in bold if it is shorter than that of backend cpu.
std::string time_cell(double ms, double cpu_ms, const std::string& more = "") {
  const std::string text = short_number(ms) + more;
  return ms < cpu_ms ? "**" + text + "**" : text;
}

std::string scenes_table(const Results& results, const std::function<bool(const ViewResults&)>& in,
                         bool with_view) {
  std::vector<std::string> head = {
      "scene",
      "maps, object pixels",
      "cpu",
      "gl",
      "image-based visual hulls",
      fmt::format("fastest inexact method with a mean error up to {:g} mm", kFairError_mm)};
  if (with_view) head.insert(head.begin() + 1, "view");
  MarkdownTable table(head);
  for (const ViewResults& view : views(results)) {
    if (!in(view)) continue;
    const double cpu_ms = view.median_ms("cpu");
    const auto cell = [&](const std::string& method) {
      return view.by_method.contains(method) ? time_cell(view.median_ms(method), cpu_ms)
                                             : std::string(kNotMeasured);
    };
    std::vector<std::string> cells = {view.scene, maps_text(*view.by_method.at("cpu")),
                                      short_number(cpu_ms), cell("gl"), cell("ibvh")};
    const json* inexact = fastest_inexact(view);
    const bool has_inexact = std::any_of(view.by_method.begin(), view.by_method.end(),
                                         [](const auto& m) { return !is_exact(m.first); });
    cells.push_back(inexact
                        ? time_cell(time_ms(*inexact), cpu_ms, " (" + inexact_text(*inexact) + ")")
                    : has_inexact ? "none"
                                  : kNotMeasured);
    if (with_view) cells.insert(cells.begin() + 1, view.view);
    table.add(cells);
  }
  return table.text();
}

std::string all_scenes(const Results& results) {
  return scenes_table(
      results, [](const ViewResults& view) { return view.view == "640x480"; }, false);
}
std::string other_views(const Results& results) {
  return scenes_table(
      results, [](const ViewResults& view) { return view.view != "640x480"; }, true);
}

struct HullRow {
  std::string text, method;
};
std::vector<HullRow> summary_rows(const std::string& gl) {
  return {{"exact, CPU (`cpu`)", "cpu"},
          {"exact, OpenGL compute on " + gl + " (`gl`)", "gl"},
          {"image-based visual hulls, SIMD", "ibvh"},
          {"plane sweep, SIMD, 160 planes", "cpusweepmid160"},
          {"the same without empty-space skipping", "plainsweep160"},
          {"voxel carving, 4.5 mm", "carve4.5mm"},
          {"voxel carving, 2 mm", "carve2mm"},
          {"the paper's stencil sweep on " + gl + ", 64 planes", "glsweep64"}};
}

std::string wrong_text(const json& result) {
  return of_text(count_of(result, "wrong_hits") + count_of(result, "wrong_misses") +
                     count_of(result, "wrong_pieces"),
                 count_of(result, "reference_rays"));
}

std::string hull_summary(const Results& results) {
  MarkdownTable table(
      {"method", "320x240, ms", "640x480, ms", "mean error at 640x480", "wrong rays at 640x480"});
  const int threads = hull_threads(results);
  const auto result = [&](const std::string& method, const char* view) -> const json& {
    return results.at(kHull, fmt::format("{}/hand4-near/{}/{}", method, view, threads));
  };
  for (const HullRow& row : summary_rows(results.gl_name())) {
    const json& large = result(row.method, "640x480");
    table.add({row.text, short_number(time_ms(result(row.method, "320x240"))),
               short_number(time_ms(large)), error_mm(error_of(large, "depth_mean_mm")),
               wrong_text(large)});
  }
  return table.text();
}

std::string hull_facts(const Results& results) {
  double measurements = 0, wrong = 0, rays = 0, other = 0, largest_mm = 0;
  for (const json& r : results.all(kHull)) {
    const std::string method = parsed(r).method;
    if (method != "cpu" && method != "gl") continue;
    ++measurements;
    wrong += count_of(r, "wrong_hits") + count_of(r, "wrong_misses") + count_of(r, "wrong_pieces");
    rays += count_of(r, "reference_rays");
    other += count_of(r, "other_pixels");
    largest_mm = std::max(largest_mm, error_of(r, "depth_max_mm"));
  }
  return wrapped(fmt::format(
      "In {} measurements (method, scene, view, threads), cpu and gl are wrong on {} seeded rays "
      "by the exact reference, and their largest error of depth is {} mm. Half of these rays pass "
      "pixels in which cpu finds the hull, so only the other half can show a hull that cpu misses. "
      "gl differs from cpu in {}.",
      count_text(measurements), of_text(wrong, rays), tiny_number(largest_mm),
      other == 0 ? "no pixel" : count_text(other) + " pixels"));
}

// Results are named scene/view/backend.
std::string every_pixel(const Results& results) {
  MarkdownTable table({"scene", "view", "pixels", "with hull", "wrong, cpu and gl",
                       "largest relative difference of the depth, cpu and gl"});
  double pixels = 0, wrong = 0, largest = 0;
  for (const json& cpu : results.all(kEveryPixel)) {
    const std::string name = cpu.at("name"), view_of = name.substr(0, name.rfind('/'));
    if (!name.ends_with("/cpu")) continue;
    const json* const gl = results.find(kEveryPixel, view_of + "/gl");
    const auto cell = [&](const auto& value) {
      return value(cpu) + " and " + (gl ? value(*gl) : kNotMeasured);
    };
    table.add({view_of.substr(0, view_of.find('/')), view_of.substr(view_of.find('/') + 1),
               count_text(count_of(cpu, "pixels")), count_text(count_of(cpu, "hits")),
               cell([](const json& r) { return count_text(count_of(r, "wrong")); }),
               cell([](const json& r) {
                 return fmt::format("{:.1e}", error_of(r, "max_depth_relative"));
               })});
    for (const json* result : {&cpu, gl})
      if (result) {
        pixels += count_of(*result, "pixels");
        wrong += count_of(*result, "wrong");
        largest = std::max(largest, error_of(*result, "max_depth_relative"));
      }
  }
  return table.text() + "\n" +
         wrapped(fmt::format("cpu and gl are wrong in {} pixels. Where they and the reference hit "
                             "the hull, the depths differ by at most {:.1e} of themselves.",
                             of_text(wrong, pixels), largest));
}

// "0.65 to 1.2 times", over the views of which both methods are measured.
std::string ratio_text(const std::vector<ViewResults>& all, const std::string& method) {
  double smallest = 0, largest = 0;
  std::string at_smallest, at_largest;
  for (const ViewResults& view : all) {
    if (!view.by_method.contains(method)) continue;
    const double ratio = view.median_ms(method) / view.median_ms("cpu");
    const std::string at = view.scene + " at " + view.view;
    if (at_smallest.empty() || ratio < smallest) smallest = ratio, at_smallest = at;
    if (at_largest.empty() || ratio > largest) largest = ratio, at_largest = at;
  }
  return fmt::format("{} ({}) to {} ({}) times", short_number(smallest), at_smallest,
                     short_number(largest), at_largest);
}

// "From ring4 to ring64, .., cpu takes 9.1 times as long."
std::string growth_text(const std::vector<ViewResults>& all, const std::string& from,
                        const std::string& to, const std::string& what) {
  double from_ms = 0, to_ms = 0;
  for (const ViewResults& view : all) {
    if (view.scene == from) from_ms = view.median_ms("cpu");
    if (view.scene == to) to_ms = view.median_ms("cpu");
  }
  if (!(from_ms > 0)) throw std::runtime_error("no scene " + from);
  return fmt::format("From {} to {}, {}, cpu takes {} times as long.", from, to, what,
                     short_number(to_ms / from_ms));
}

std::string ratios(const Results& results) {
  const auto all = views(results);
  return wrapped(fmt::format("Over all views of both tables, image-based visual hulls take {} the "
                             "time of cpu, a plane "
                             "sweep with 160 planes {}, and gl on {} {}.",
                             ratio_text(all, "ibvh"), ratio_text(all, "cpusweepmid160"),
                             results.gl_name(), ratio_text(all, "gl")) +
                 " " + growth_text(all, "ring4", "ring64", "with sixteen times the cameras"));
}

}  // namespace

std::map<std::string, Block> hull_blocks() {
  return {{"hull summary", hull_summary}, {"hull scenes", all_scenes},
          {"hull views", other_views},    {"hull ratios", ratios},
          {"hull facts", hull_facts},     {"hull every pixel", every_pixel}};
}

}  // namespace fivepipe::figures
