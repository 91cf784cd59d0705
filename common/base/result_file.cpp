#include "common/base/result_file.h"

#include <cstdint>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "common/base/machine.h"
#include "common/base/timing.h"
#include "common/base/version.h"

namespace fivepipe::base {
std::string quoted(const std::string& text) {
  std::string json = "\"";
  for (const char c : text)
    if (c == '"' || c == '\\')
      (json += '\\') += c;
    else if (std::uint8_t(c) >= 0x20)
      json += c;
  return json + "\"";
}

std::string machine_line(const std::string& renderer) {
  return cpu_name() + ", " + std::to_string(std::thread::hardware_concurrency()) + " cores, " +
         renderer + ", build " + build_type() + " " + commit();
}

std::string suite_json(const std::string& suite, const std::string& renderer,
                       const std::vector<std::string>& results, const std::string& more) {
  std::ostringstream out;
  out << "{\"suite\": " << quoted(suite) << ", \"commit\": " << quoted(commit())
      << ",\n \"machine\": {\"cpu\": " << quoted(cpu_name())
      << ", \"cores\": " << std::thread::hardware_concurrency()
      << ", \"gl_renderer\": " << quoted(renderer) << ", \"build_type\": " << quoted(build_type())
      << "},\n \"results\": [";
  for (const std::string& result : results)
    out << (&result == results.data() ? "\n" : ",\n") << result;
  out << "\n ]" << more << "}\n";
  return out.str();
}

std::string times_json(const std::vector<double>& time_ms) {
  std::ostringstream out;
  out << "{\"best\": " << percentile(time_ms, 0) << ", \"median\": " << percentile(time_ms, 0.5)
      << ", \"p95\": " << percentile(time_ms, 0.95) << ", \"p99\": " << percentile(time_ms, 0.99)
      << ", \"runs\": " << time_ms.size() << "}";
  return out.str();
}

void write_file(const std::string& file, const std::string& text) {
  std::ofstream out(file);
  out << text;
  if (!out.flush()) throw std::runtime_error("cannot write " + file);
}

}  // namespace fivepipe::base
