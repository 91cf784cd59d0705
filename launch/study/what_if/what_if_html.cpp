// The results of what-if as a page with charts.
#include "common/base/version.h"
#include "common/study/report/layouts_page.h"
#include "launch/study/what_if/what_if.h"

namespace fivepipe::study {

namespace {

// How the page names a part, as the 3D view of a study's report does.
std::string name_of(const WhatIf& found, const std::string& part, const std::string& place) {
  for (const WhatIfPart& given : found.options.parts)
    if (given.name == part && given.added) return place + " (only what-if)";
  return place;
}

}  // namespace

std::string html_of(const WhatIf& found) {
  const WhatIfOptions& options = found.options;
  std::string recorded;
  for (const PartResult& of : found.parts) recorded += recorded_text(of);
  report::LayoutsPage page{.recording = options.recording.filename().string(),
                           .scene = found.scene,
                           .version = base::version(),
                           .frames = found.frames,
                           .duration_s = found.duration_s,
                           .limits = recorded + limits_of(found),
                           .with_distances = options.with_distances};
  for (const PartResult& of : found.parts)
    if (of.part.range.low_m < of.part.range.high_m)
      page.curves.push_back({name_of(found, of.part.name, of.part.name), of.part.range, of.result,
                             options.with_distances});
  const auto add = [&](const std::string& name, const std::vector<double>& places_m,
                       const RowResult& row) {
    page.layouts.push_back({name, places_m, row.layout, row.colliding_parts});
  };
  if (options.table) {
    for (const LayoutTable::Column& column : options.table->columns)
      page.places.push_back(name_of(found, column.part, column.name()));
    for (std::size_t i = 0; i < found.rows.size(); ++i) {
      const LayoutTable::Row& row = options.table->rows[i];
      add("line " + std::to_string(row.line), row.cell_m, found.rows[i]);
    }
  } else {
    for (const PartResult& of : found.parts)
      page.places.push_back(name_of(found, of.part.name, of.part.name));
    for (const RowResult& row : found.combinations) add("", row.spacings_m, row);
  }
  return report::layouts_page(page);
}

}  // namespace fivepipe::study
