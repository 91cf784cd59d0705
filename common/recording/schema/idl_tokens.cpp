#include "common/recording/schema/idl_tokens.h"

#include <charconv>

namespace fivepipe::schema {
namespace {

// Longer than any real name; bounds the memory of scoped names.
constexpr std::size_t kMaxNameLength = 256;

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\f' || c == '\v';
}

std::string printable(std::string_view text) {
  std::string quoted;
  for (char c : text.substr(0, 40)) quoted += c >= ' ' && c <= '~' ? c : '?';
  return text.size() > 40 ? quoted + "..." : quoted;
}

}  // namespace

void throw_error_at(const Token& at, const std::string& what) {
  throw IdlError("line " + std::to_string(at.line) + ", column " + std::to_string(at.column) +
                 ": " + what);
}

std::string quoted(const Token& token) {
  return token.kind == Token::Kind::end ? "the end of the text" : "'" + printable(token.text) + "'";
}

Tokens::Tokens(std::string_view text) : text_(text) { read_next(); }

void Tokens::step() {
  if (text_[at_] == '\n') {
    ++line_;
    column_ = 1;
  } else {
    ++column_;
  }
  ++at_;
}

void Tokens::skip_comment() {
  const Token opening{Token::Kind::sign, text_.substr(at_, 2), line_, column_};
  const bool to_line_end = text_[at_ + 1] == '/';
  const std::size_t found = to_line_end ? text_.find('\n', at_) : text_.find("*/", at_ + 2);
  if (found == std::string_view::npos && !to_line_end)
    throw_error_at(opening, "the comment is not closed");
  const std::size_t end =
      found == std::string_view::npos ? text_.size() : found + (to_line_end ? 0 : 2);
  while (at_ < end) step();
}

void Tokens::skip_blanks() {
  while (at_ < text_.size()) {
    const std::string_view pair = text_.substr(at_, 2);
    if (is_blank(text_[at_]))
      step();
    else if (pair == "//" || pair == "/*")
      skip_comment();
    else
      return;
  }
}

void Tokens::read_next() {
  skip_blanks();
  next_ = {Token::Kind::end, {}, line_, column_};
  if (at_ == text_.size()) return;
  const std::size_t begin = at_;
  const char first = text_[at_];
  if (is_letter(first) || is_digit(first)) {
    while (at_ < text_.size() &&
           (is_letter(text_[at_]) || is_digit(text_[at_]) || text_[at_] == '_'))
      step();
    next_.kind = is_letter(first) ? Token::Kind::identifier : Token::Kind::number;
  } else {
    step();
    if (first == ':' && at_ < text_.size() && text_[at_] == ':') step();
    next_.kind = Token::Kind::sign;
  }
  next_.text = text_.substr(begin, at_ - begin);
  if (const std::size_t length = next_.text.size(); length > kMaxNameLength)
    throw_error_at(next_, "a name has " + std::to_string(length) + " characters; the limit is " +
                              std::to_string(kMaxNameLength));
  if (next_.kind == Token::Kind::sign && next_.text == "#")
    throw_error_at(next_, "preprocessor lines are not supported");
  if (next_.kind == Token::Kind::sign && next_.text != "::" &&
      std::string_view("{};,<>[]()@:=").find(first) == std::string_view::npos)
    throw_error_at(next_, "unexpected character " + quoted(next_));
}

Token Tokens::take() {
  const Token token = next_;
  read_next();
  return token;
}

bool Tokens::take_if(std::string_view text) {
  if (next_.kind == Token::Kind::end || next_.text != text) return false;
  take();
  return true;
}

void Tokens::expect(std::string_view text) {
  if (!take_if(text))
    throw_error_at(next_, "expected '" + std::string(text) + "', found " + quoted(next_));
}

Token Tokens::expect_name(const char* what) {
  if (next_.kind != Token::Kind::identifier)
    throw_error_at(next_, "expected " + std::string(what) + ", found " + quoted(next_));
  return take();
}

std::uint32_t Tokens::expect_positive(const char* what) {
  std::uint32_t number = 0;
  const char* end = next_.text.data() + next_.text.size();
  // Octal numbers are rejected: 010 would mean 8.
  const bool is_read = next_.kind == Token::Kind::number && next_.text[0] != '0';
  if (!is_read || std::from_chars(next_.text.data(), end, number).ptr != end || number == 0)
    throw_error_at(next_, "expected " + std::string(what) +
                              ", a decimal number from 1 to 4294967295, found " + quoted(next_));
  take();
  return number;
}

}  // namespace fivepipe::schema
