#include "common/config/yaml/problems.h"

#include <algorithm>
#include <map>
#include <tuple>

namespace fivepipe::config {

namespace {

std::string one_per_line(const std::vector<ConfigProblem>& problems) {
  std::string text;
  for (const ConfigProblem& p : problems) {
    if (!text.empty()) text += '\n';
    text += p.file;
    if (p.line > 0) text += ':' + std::to_string(p.line) + ':' + std::to_string(p.column);
    text += ": " + p.what;
  }
  return text;
}

}  // namespace

ConfigError::ConfigError(std::vector<ConfigProblem> problems)
    : std::runtime_error(one_per_line(problems)), problems_(std::move(problems)) {}

void Problems::add(const std::filesystem::path& file, SourceLocation location, std::string what) {
  const ConfigProblem problem{file.string(), location.line, location.column, std::move(what)};
  const auto is_same = [&](const ConfigProblem& p) {
    return std::tie(p.file, p.line, p.column, p.what) ==
           std::tie(problem.file, problem.line, problem.column, problem.what);
  };
  if (std::none_of(problems_.begin(), problems_.end(), is_same)) problems_.push_back(problem);
}

void Problems::throw_if_any() const {
  if (problems_.empty()) return;
  std::map<std::string, std::size_t> order_of_file;
  for (const ConfigProblem& p : problems_) order_of_file.try_emplace(p.file, order_of_file.size());
  std::vector<ConfigProblem> sorted = problems_;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [&](const ConfigProblem& a, const ConfigProblem& b) {
                     return std::tuple(order_of_file[a.file], a.line, a.column) <
                            std::tuple(order_of_file[b.file], b.line, b.column);
                   });
  throw ConfigError(std::move(sorted));
}

}  // namespace fivepipe::config
