// Regular expressions (ECMAScript syntax). <regex> takes seconds to compile, so only regex.cpp
// includes it.
#pragma once
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace fivepipe::base {

// what() states the error of the expression.
struct RegexError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct RegexMatch {
  std::string before, after;        // the text before and after the match
  std::vector<std::string> groups;  // group 0 is the match; a group that did not match is empty
};

class Regex {
 public:
  enum class Case { distinguished, ignored };
  // Throws RegexError.
  explicit Regex(const std::string& expression, Case letters = Case::distinguished);
  ~Regex();
  Regex(const Regex&) = delete;
  Regex& operator=(const Regex&) = delete;

  // Returns true if the expression matches a part of the text.
  bool found_in(const std::string& text) const;
  // Returns the first match, or nullopt if there is none.
  std::optional<RegexMatch> search(const std::string& text) const;

 private:
  struct Compiled;
  const std::unique_ptr<const Compiled> compiled_;
};

}  // namespace fivepipe::base
