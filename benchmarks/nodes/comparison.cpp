#include "benchmarks/nodes/comparison.h"

#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace fivepipe::node_bench {
namespace {

using nlohmann::json;

const json& results_of(const json& suite, const char* which) {
  if (!suite.is_object() || !suite.contains("results") || !suite["results"].is_array())
    throw std::runtime_error(std::string(which) + " file has no list of results");
  return suite["results"];
}

double median_of(const json& result, const char* which) {
  const auto time = result.find("time_ms");
  if (!result.is_object() || time == result.end() || !time->contains("median") ||
      !(*time)["median"].is_number())
    throw std::runtime_error(std::string(which) + " file has a result without time_ms.median: " +
                             result.dump().substr(0, 120));
  return (*time)["median"].get<double>();
}

std::string name_of(const json& result, const char* which) {
  if (!result.is_object() || !result.contains("name") || !result["name"].is_string())
    throw std::runtime_error(std::string(which) + " file has a result without a name");
  return result["name"].get<std::string>();
}

std::vector<std::string> worse_errors(const json& before, const json& after) {
  std::vector<std::string> worse;
  const json none = json::object();
  const json& then = before.contains("error") ? before["error"] : none;
  const json& now = after.contains("error") ? after["error"] : none;
  for (const auto& [figure, value] : now.items())
    if (then.contains(figure) && value.is_number() && then[figure].is_number() &&
        value.get<double>() > then[figure].get<double>())
      worse.push_back(figure + ": " + value.dump() + " instead of " + then[figure].dump());
  return worse;
}

}  // namespace

Comparison compared(const json& before, const json& after) {
  std::map<std::string, const json*> of_name;
  for (const json& result : results_of(after, "the second"))
    of_name[name_of(result, "the second")] = &result;
  Comparison comparison;
  for (const json& result : results_of(before, "the first")) {
    const std::string name = name_of(result, "the first");
    const auto found = of_name.find(name);
    if (found == of_name.end()) {
      comparison.only_before.push_back(name);
      continue;
    }
    const json& now = *found->second;
    const std::string then_sum = result.value("checksum", ""), now_sum = now.value("checksum", "");
    comparison.results.push_back(
        {name, median_of(result, "the first"), median_of(now, "the second"),
         !then_sum.empty() && !now_sum.empty() && then_sum != now_sum, worse_errors(result, now)});
    of_name.erase(found);
  }
  for (const auto& [name, result] : of_name) comparison.only_after.push_back(name);
  if (before.contains("machine") && after.contains("machine") &&
      before["machine"] != after["machine"])
    comparison.machines = before["machine"].dump() + "\n  and " + after["machine"].dump();
  return comparison;
}

}  // namespace fivepipe::node_bench
