#include <cstdio>
#include <fstream>
#include <iostream>

#include "benchmarks/nodes/comparison.h"
#include "benchmarks/nodes/from_recording.h"
#include "launch/cli/benchmarks.h"

namespace fivepipe::launch {
namespace {

constexpr int kCriterionNotMet = 4;

nlohmann::json read(const std::string& file) {
  std::ifstream in(file);
  try {
    return nlohmann::json::parse(in);
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(file + ": " + error.what());
  }
}

std::string check_percent(std::string& text) {
  if (text.ends_with('%')) text.pop_back();
  try {
    std::size_t end = 0;
    if (const double percent = std::stod(text, &end); end == text.size() && percent >= 0) return "";
  } catch (const std::logic_error&) {
  }
  return "expected a share of the time like 5%, got '" + text + "'";
}

}  // namespace

int bench_compare(const std::vector<std::string>& words) {
  std::string before, after, fail_above;
  CLI::App app(
      "Two results of one benchmark side by side, by the ratio of their medians.\n\nExamples:\n"
      "  fivepipe bench compare before.json after.json\n"
      "  fivepipe bench compare docs/benchmarks/recon_node.json out/recon_node.json --fail-above "
      "5%\n\n"
      "Exit codes: 0, 1 a file can't be compared, 2 usage, 4 with --fail-above: something takes "
      "longer by more, errs more, or is missing.",
      "fivepipe bench compare");
  app.add_option("BEFORE", before, "results (JSON)")->required()->check(CLI::ExistingFile);
  app.add_option("AFTER", after, "results (JSON)")->required()->check(CLI::ExistingFile);
  app.add_option("--fail-above", fail_above,
                 "5%: exit code 4 where a median is longer by more than that")
      ->check(CLI::Validator(check_percent, "PERCENT"));
  if (const auto exit_code = node_bench::parsed(app, words)) return *exit_code;
  const node_bench::Comparison comparison = node_bench::compared(read(before), read(after));
  const double max_ratio = fail_above.empty() ? 0 : 1 + 0.01 * std::stod(fail_above);
  std::printf("%-56s %10s %10s %7s\n", "median [ms]", "before", "after", "ratio");
  int failures = 0;
  for (const node_bench::ComparedResult& result : comparison.results) {
    const bool fails = max_ratio > 0 && result.is_slower_than(max_ratio);
    failures += fails || (max_ratio > 0 && !result.worse_errors.empty());
    std::printf("%-56s %10.4f %10.4f %7.3f%s%s\n", result.name.c_str(), result.before_ms,
                result.after_ms, result.ratio(), fails ? "  SLOWER" : "",
                result.output_differs ? "  its output differs" : "");
    for (const std::string& error : result.worse_errors)
      std::printf("    greater error: %s\n", error.c_str());
  }
  for (const std::string& name : comparison.only_before)
    std::printf("only in %s: %s\n", before.c_str(), name.c_str());
  for (const std::string& name : comparison.only_after)
    std::printf("only in %s: %s\n", after.c_str(), name.c_str());
  if (!comparison.machines.empty())
    std::printf("not the same machine or build, so that times tell little: %s\n",
                comparison.machines.c_str());
  std::fflush(stdout);
  if (comparison.results.empty()) {
    std::cerr << "nothing to compare: no result has the same name in both\n";
    return 1;
  }
  if (max_ratio > 0)
    failures += int(comparison.only_before.size());  // what is missing may be anything
  if (failures > 0)
    std::cerr << failures << " are slower by more than " << 100 * (max_ratio - 1)
              << " %, err more, or are missing\n";
  return failures > 0 ? kCriterionNotMet : 0;
}

}  // namespace fivepipe::launch
