#include "benchmarks/render/errors/published_latency.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace fivepipe::render_bench {

double published_latency_ms(const std::filesystem::path& result_file) {
  const std::string name = "pipeline_with_capture/paper/latency";
  std::ifstream in(result_file);
  try {
    const nlohmann::json file = nlohmann::json::parse(in);
    for (const nlohmann::json& result : file.at("results"))
      if (result.at("name") == name) return result.at("time_ms").at("median");
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(fmt::format("{}: {}; state the latency by --latency-ms",
                                         result_file.string(), error.what()));
  }
  throw std::runtime_error(fmt::format("{} has no result {}; state the latency by --latency-ms",
                                       result_file.string(), name));
}

}  // namespace fivepipe::render_bench
