#include "capture_node/sources/source_error.h"

#include <algorithm>

namespace fivepipe::capture {
namespace {

std::string lines(const std::vector<SourceProblem>& problems) {
  std::string text;
  for (const SourceProblem& problem : problems)
    text += (text.empty() ? "" : "\n") + problem.camera + ": " + problem.what;
  return text;
}

}  // namespace

SourceError::SourceError(std::vector<SourceProblem> problems)
    : std::runtime_error(lines(problems)), problems_(std::move(problems)) {}

void throw_problems(std::vector<SourceProblem> problems) {
  const bool hardware = std::any_of(problems.begin(), problems.end(), [](const SourceProblem& p) {
    return p.fault == SourceFault::hardware_missing || p.fault == SourceFault::hardware_failed;
  });
  if (hardware) throw HardwareMissing(std::move(problems));
  throw SourceError(std::move(problems));
}

}  // namespace fivepipe::capture
