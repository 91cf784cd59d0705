#include "common/base/regex.h"

#include <regex>

namespace fivepipe::base {

struct Regex::Compiled {
  std::regex expression;
};

Regex::Regex(const std::string& expression, Case letters) try
    : compiled_(new Compiled{std::regex(expression, letters == Case::ignored
                                                        ? std::regex::ECMAScript | std::regex::icase
                                                        : std::regex::ECMAScript)}) {
} catch (const std::regex_error& error) {
  throw RegexError(error.what());
}

Regex::~Regex() = default;

bool Regex::found_in(const std::string& text) const {
  return std::regex_search(text, compiled_->expression);
}

std::optional<RegexMatch> Regex::search(const std::string& text) const {
  std::smatch match;
  if (!std::regex_search(text, match, compiled_->expression)) return std::nullopt;
  RegexMatch found{match.prefix(), match.suffix(), {}};
  for (const auto& group : match) found.groups.push_back(group);
  return found;
}

}  // namespace fivepipe::base
