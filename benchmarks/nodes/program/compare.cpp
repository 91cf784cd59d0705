#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "benchmarks/nodes/comparison.h"
#include "benchmarks/nodes/program/options.h"
#include "benchmarks/nodes/program/subcommands.h"
#include "common/base/text_table.h"

namespace fivepipe::measure {
namespace {

using node_bench::ComparedResult;
using node_bench::Comparison;

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
  return "expected a percentage like 5%, got '" + text + "'";
}

// `max_ratio` 0: no criterion.
void print(const Comparison& comparison, double max_ratio) {
  base::TextTable table(
      {{"median [ms]"}, {"before", true}, {"after", true}, {"ratio", true}, {"", false}});
  for (const ComparedResult& result : comparison.results) {
    std::string diagnostic = max_ratio > 0 && result.is_slower_than(max_ratio) ? "SLOWER " : "";
    if (result.output_differs) diagnostic += "the output differs ";
    for (const std::string& error : result.worse_errors)
      diagnostic += fmt::format("larger error {} ", error);
    table.add({result.name, base::with_decimals(result.before_ms, 4),
               base::with_decimals(result.after_ms, 4), base::with_decimals(result.ratio(), 3),
               diagnostic});
  }
  std::cout << table.text();
}

// Prints what cannot be compared.
void print_differences(const Comparison& comparison, const std::string& before,
                       const std::string& after) {
  for (const std::string& name : comparison.only_before)
    std::cout << fmt::format("only in {}: {}\n", before, name);
  for (const std::string& name : comparison.only_after)
    std::cout << fmt::format("only in {}: {}\n", after, name);
  if (!comparison.machines.empty())
    std::cout << "the machine or the build differs, so the ratios do not compare the code alone: "
              << comparison.machines << '\n';
  std::cout << std::flush;
}

// Counts the results that are slower, have a larger error, or are missing. A missing result counts
// because it may hide a regression.
int failures_in(const Comparison& comparison, double max_ratio) {
  int failures = int(comparison.only_before.size());
  for (const ComparedResult& result : comparison.results)
    failures += result.is_slower_than(max_ratio) || !result.worse_errors.empty();
  return failures;
}

}  // namespace

int bench_compare(const std::vector<std::string>& words) {
  std::string before, after, fail_above;
  CLI::App app(
      "Compare two result files of one benchmark by the ratio of their medians.\n\nExamples:\n"
      "  fivepipe bench compare before.json after.json\n"
      "  fivepipe bench compare out/before.json out/after.json --fail-above 5%\n\n"
      "Exit codes: 0; 1 if a file cannot be compared or the files share no result name; 2 for "
      "wrong arguments; 4 with --fail-above if a result is slower by more, has a larger error, or "
      "is missing.",
      "fivepipe bench compare");
  app.add_option("BEFORE", before, "result file (JSON)")->required()->check(CLI::ExistingFile);
  app.add_option("AFTER", after, "result file (JSON)")->required()->check(CLI::ExistingFile);
  app.add_option("--fail-above", fail_above,
                 "exit with 4 if a median is longer by more than this, for example 5%")
      ->check(CLI::Validator(check_percent, "PERCENT"));
  if (const auto exit_code = parse(app, words)) return *exit_code;
  const Comparison comparison = node_bench::compared(read(before), read(after));
  const double max_ratio = fail_above.empty() ? 0 : 1 + 0.01 * std::stod(fail_above);
  print(comparison, max_ratio);
  print_differences(comparison, before, after);
  if (comparison.results.empty()) {
    std::cerr << "nothing to compare: the files share no result name\n";
    return 1;
  }
  const int failures = max_ratio > 0 ? failures_in(comparison, max_ratio) : 0;
  if (failures > 0)
    std::cerr << fmt::format(
        "{} results are slower by more than {:g} %, have a larger error, or are missing\n",
        failures, 100 * (max_ratio - 1));
  return failures > 0 ? kCriterionNotMet : 0;
}

}  // namespace fivepipe::measure
