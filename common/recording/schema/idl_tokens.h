// Splits IDL text into tokens with line and column.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>

#include "common/recording/schema/idl.h"

namespace fivepipe::schema {

struct Token {
  enum class Kind { identifier, number, sign, end };
  Kind kind = Kind::end;
  std::string_view text;  // part of the source text
  std::size_t line = 1, column = 1;
};

[[noreturn]] void throw_error_at(const Token& at, const std::string& what);  // throws IdlError
std::string quoted(const Token& token);  // "'struct'", "the end of the text"

// The text must outlive this object.
class Tokens {
 public:
  explicit Tokens(std::string_view text);
  const Token& next() const { return next_; }
  Token take();
  bool take_if(std::string_view text);  // takes the next token if it equals `text`
  void expect(std::string_view text);
  Token expect_name(const char* what);
  std::uint32_t expect_positive(const char* what);

 private:
  void skip_blanks();
  void skip_comment();
  void step();
  void read_next();
  std::string_view text_;
  std::size_t at_ = 0, line_ = 1, column_ = 1;
  Token next_;
};

}  // namespace fivepipe::schema
