#include "common/study/report/layouts_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "common/base/text_table.h"
#include "common/study/report/document.h"
#include "common/study/report/escape.h"
#include "common/study/report/html_sections.h"
#include "common/study/report/page_data.h"

namespace fivepipe::study::report {
namespace {

using nlohmann::ordered_json;

// Rows of the table of the worst layouts.
constexpr std::size_t kWorstLayouts = 10;

bool collides(const PlacedLayout& layout) { return layout.result.colliding_frames > 0; }
bool is_free(const PlacedLayout& layout) {
  return !collides(layout) && layout.result.undecided_frames == 0;
}

void check_layouts(const LayoutsPage& page) {
  for (const PlacedLayout& layout : page.layouts)
    if (layout.places_m.size() != page.places.size() || !std::isfinite(layout.result.collision_s) ||
        !std::ranges::all_of(layout.places_m, [](double m) { return std::isfinite(m); }))
      throw std::invalid_argument("layouts: a layout has a place that is missing or not finite");
}

// The longest collision first, then those that are undecided, then the free ones.
std::vector<PlacedLayout> sorted(std::vector<PlacedLayout> layouts) {
  std::ranges::stable_sort(layouts, std::greater<>(), [](const PlacedLayout& layout) {
    return std::tuple(layout.result.collision_s, collides(layout), !is_free(layout));
  });
  return layouts;
}

// Returns whether the layouts of two places are all combinations of at least two values of each.
// The values are those of the page, which rounds them.
bool is_grid(const std::vector<PlacedLayout>& layouts) {
  std::set<double> first_cm, second_cm;
  std::set<std::pair<double, double>> different_cm;
  for (const PlacedLayout& layout : layouts) {
    if (layout.places_m.size() != 2) return false;
    const double a_cm = json_cm(layout.places_m[0]), b_cm = json_cm(layout.places_m[1]);
    first_cm.insert(a_cm);
    second_cm.insert(b_cm);
    different_cm.emplace(a_cm, b_cm);
  }
  return first_cm.size() > 1 && second_cm.size() > 1 && layouts.size() == different_cm.size() &&
         layouts.size() == first_cm.size() * second_cm.size();
}

// At equal distances in their order, with both ends.
std::vector<PlacedLayout> drawn(const std::vector<PlacedLayout>& layouts) {
  if (layouts.size() <= kMaxDrawnLayouts) return layouts;
  std::vector<PlacedLayout> some;
  for (std::size_t i = 0; i < kMaxDrawnLayouts; ++i)
    some.push_back(layouts[i * (layouts.size() - 1) / (kMaxDrawnLayouts - 1)]);
  return some;
}

ordered_json layouts_json(const LayoutsPage& page, const std::vector<PlacedLayout>& layouts) {
  ordered_json json{{"places", page.places},
                    {"with_distances", page.with_distances},
                    {"layouts", ordered_json::array()}};
  for (const PlacedLayout& layout : layouts) {
    const LayoutResult& result = layout.result;
    ordered_json& added = json["layouts"].emplace_back();
    added["name"] = layout.name;
    added["places_cm"] = ordered_json::array();
    for (const double place_m : layout.places_m) added["places_cm"].push_back(json_cm(place_m));
    added["verdict"] = collides(layout) ? "colliding" : is_free(layout) ? "free" : "undecided";
    added["collision_s"] = json_s(result.collision_s);
    added["parts"] = layout.colliding_parts;
    if (!page.with_distances) continue;
    added["penetration"] = bracket_text(result.penetration);
    added["clearance"] = bracket_text(result.clearance);
    added["penetration_cm"] = {json_cm(result.penetration.min_m),
                               json_cm(result.penetration.max_m)};
    added["clearance_cm"] = {json_cm(result.clearance.min_m), json_cm(result.clearance.max_m)};
  }
  return json;
}

std::string title_of(const LayoutsPage& page) {
  std::string text = fmt::format(
      "<header>\n{}<p class=\"kind\">What if the parts were elsewhere</p>\n<h1>{}</h1>\n"
      "<dl class=\"meta\">\n",
      kTools, html_name(page.recording));
  for (const auto& [name, value] : std::vector<std::pair<std::string, std::string>>{
           {"Scene", page.scene},
           {"Recorded", fmt::format("{} frames, {:.1f} s", page.frames, page.duration_s)},
           {"fivepipe", page.version}})
    text += fmt::format("<div><dt>{}</dt><dd>{}</dd></div>\n", name, html_name(value));
  return text + "</dl>\n</header>\n";
}

std::string counts_of(const std::vector<PlacedLayout>& layouts) {
  const auto colliding = std::ranges::count_if(layouts, collides),
             free = std::ranges::count_if(layouts, is_free);
  return fmt::format(
      "{} of {} layouts are certified free in all frames, {} collide, {} are undecided.", free,
      layouts.size(), colliding, std::ptrdiff_t(layouts.size()) - colliding - free);
}

std::string figure_of(const std::string& chart, const std::string& quantity,
                      const std::string& caption, const std::string& summary) {
  return fmt::format(
      "<figure class=\"chart{}\" data-chart=\"{}\" data-quantity=\"{}\" data-summary=\"{}\">"
      "<figcaption>{}</figcaption></figure>\n",
      chart == "layout-map" ? "" : " wide", chart, quantity, html_text(summary), caption);
}

std::string worst_table(const LayoutsPage& page, const std::vector<PlacedLayout>& layouts) {
  std::vector<std::string> heads{"layout"};
  for (const std::string& place : page.places) heads.push_back(html_name(place) + ", cm");
  heads.push_back("collision, s");
  if (page.with_distances) {
    heads.push_back("deepest penetration");
    heads.push_back("minimum clearance");
  }
  heads.push_back("colliding parts");
  std::string text =
      "<div class=\"scroll\"><table>\n<caption>Layouts with the longest collisions</caption>\n" +
      table_head(heads) + "<tbody>\n";
  for (std::size_t i = 0; i < std::min(layouts.size(), kWorstLayouts); ++i) {
    const PlacedLayout& layout = layouts[i];
    std::vector<std::string> cells{layout.name.empty() ? std::to_string(i + 1)
                                                       : html_name(layout.name)};
    for (const double place_m : layout.places_m)
      cells.push_back(fmt::format("{:.2f}", 100 * place_m));
    cells.push_back(collides(layout)  ? fmt::format("{:.2f}", layout.result.collision_s)
                    : is_free(layout) ? "free"
                                      : "undecided");
    if (page.with_distances) {
      cells.push_back(collides(layout) ? bracket_text(layout.result.penetration) : "–");
      cells.push_back(bracket_text(layout.result.clearance));
    }
    cells.push_back(html_name(base::joined(layout.colliding_parts, ", ")));
    text += table_row(cells);
  }
  return text + "</tbody></table></div>\n";
}

std::string layouts_section(const LayoutsPage& page, const std::vector<PlacedLayout>& layouts,
                            bool has_map) {
  if (layouts.empty()) return "";
  const std::string counts = counts_of(layouts);
  std::string text =
      "<section id=\"layouts\">\n<h2>Layouts of all parts</h2>\n<p>" + counts + "</p>\n";
  if (layouts.size() > kMaxDrawnLayouts)
    text += fmt::format("<p class=\"note\">The charts show {} of them.</p>\n", kMaxDrawnLayouts);
  if (has_map) {
    text += "<div class=\"charts\">\n" +
            figure_of("layout-map", "collision", "Collision time by layout", counts);
    if (page.with_distances)
      text += figure_of("layout-map", "penetration", "Deepest penetration by layout", counts) +
              figure_of("layout-map", "clearance", "Minimum clearance by layout", counts);
    text += "</div>\n";
  }
  text += figure_of("layout-bars", "collision", "Collision time of each layout, the longest first",
                    counts);
  if (page.with_distances)
    text += figure_of("layout-bars", "distance",
                      "Penetration and clearance of each layout, in the same order", counts);
  return text + worst_table(page, layouts) + "</section>\n";
}

}  // namespace

std::string layouts_page(const LayoutsPage& page) {
  check_layouts(page);
  const std::vector<PlacedLayout> layouts = sorted(page.layouts);
  const bool has_map = layouts.size() <= kMaxDrawnLayouts && is_grid(layouts);
  ordered_json data{{"trials", {{{"what_if", ordered_json::array()}}}},
                    {"joint", layouts_json(page, drawn(layouts))}};
  for (const WhatIfCurve& curve : page.curves)
    data["trials"][0]["what_if"].push_back(curve_json(curve));
  std::string body = title_of(page) + "<main>\n" + layouts_section(page, layouts, has_map);
  if (!page.curves.empty())
    body += "<section id=\"parts\">\n<h2>Each part over its range</h2>\n" +
            what_if_charts(page.curves, 0) + "</section>\n";
  body += "<section id=\"limits\">\n<h2>What limits the results</h2>\n<p>" +
          html_text(page.limits) +
          "</p>\n</section>\n</main>\n<footer><p>Written by fivepipe. All data are in this file, "
          "which loads nothing from elsewhere. Charts: uPlot, under the MIT licence, which is in "
          "the source of this page.</p></footer>\n";
  return html_of({"What if: " + page.recording, page.version, body}, data);
}

}  // namespace fivepipe::study::report
