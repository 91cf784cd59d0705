#include "common/base/result_file.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/base/machine.h"
#include "common/base/timing.h"
#include "common/base/version.h"

namespace fivepipe::base {

using nlohmann::ordered_json;

std::string machine_line(const std::string& gl_renderer) {
  return fmt::format("{}, {} cores, {}build {} {}", cpu_name(), core_count(),
                     gl_renderer.empty() ? "" : gl_renderer + ", ", build_type(), commit());
}

ordered_json suite_json(const std::string& suite, const std::string& gl_renderer,
                        const ordered_json& results) {
  return {{"suite", suite},
          {"commit", commit()},
          {"machine",
           {{"cpu", cpu_name()},
            {"cores", core_count()},
            {"gl_renderer", gl_renderer},
            {"build_type", build_type()}}},
          {"results", results}};
}

ordered_json times_json(const std::vector<double>& time_ms) {
  return {{"best", percentile(time_ms, 0)},
          {"median", percentile(time_ms, 0.5)},
          {"p95", percentile(time_ms, 0.95)},
          {"p99", percentile(time_ms, 0.99)},
          {"runs", time_ms.size()}};
}

void write_json(const std::filesystem::path& file, const ordered_json& json) {
  write_file(file, json.dump(1) + "\n");
}

void write_file(const std::filesystem::path& file, const std::string& text) {
  std::error_code ignored;  // opening the file reports the failure
  std::filesystem::create_directories(file.parent_path(), ignored);
  std::ofstream out(file);
  out << text;
  if (!out.flush()) throw std::runtime_error("cannot write " + file.string());
}

}  // namespace fivepipe::base
