#include "benchmarks/capture/coverage_report.h"

#include <fmt/format.h>

#include <filesystem>
#include <iostream>

#include "benchmarks/capture/coverage_accuracy.h"
#include "common/base/result_file.h"
#include "common/base/text_table.h"
#include "common/base/timing.h"
#include "common/config/read_files.h"

namespace fivepipe::capture_bench {

nlohmann::ordered_json report_coverage(bool quick) {
  nlohmann::ordered_json results = nlohmann::ordered_json::array();
  for (const char* name : {"table4", "table6"}) {
    const std::filesystem::path rigs = FIVEPIPE_SOURCE_DIR "/scenes/rigs";
    config::Problems problems;
    const config::Rig rig = config::read_rig(rigs / (std::string(name) + ".yaml"), problems);
    problems.throw_if_any();
    const CoverageAccuracy all = measure_coverage(rig, quick ? 1 : 3, quick ? 1 : 15);
    base::TextTable table({{fmt::format("depth of the hull, {}, {} rays", name, all.rays)},
                           {"median, mm", true},
                           {"p95, mm", true},
                           {"missed", true},
                           {"extra", true},
                           {"median ms", true},
                           {"to binary", true}});
    const double binary_ms = base::percentile(all.rows[0].time_ms, 0.5);
    for (const CoverageRow& row : all.rows) {
      const double median_mm = base::percentile(row.error_mm, 0.5),
                   p95_mm = base::percentile(row.error_mm, 0.95),
                   median_ms = base::percentile(row.time_ms, 0.5);
      table.add({name_of(row.maps), base::with_decimals(median_mm, 3),
                 base::with_decimals(p95_mm, 2), std::to_string(row.missed),
                 std::to_string(row.extra), base::with_decimals(median_ms, 2),
                 base::with_decimals(median_ms / binary_ms, 1)});
      results.push_back({{"name", fmt::format("capture/hull/{}/{}", name, name_of(row.maps))},
                         {"time_ms", base::times_json(row.time_ms)},
                         {"error",
                          {{"depth_median_mm", median_mm},
                           {"depth_p95_mm", p95_mm},
                           {"missed", double(row.missed) / double(all.rays)},
                           {"extra", double(row.extra) / double(all.rays)}}}});
    }
    std::cout << table.text() << '\n';
  }
  return results;
}

}  // namespace fivepipe::capture_bench
