// Recursive-descent parser for the subset that idl.h states; grammar: OMG IDL 4.2, section 7.4.1.
#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "common/recording/schema/idl_tokens.h"

namespace fivepipe::schema {
namespace {

// Limits far above those of real types, which bound the stack and memory that hostile text takes.
constexpr std::size_t kMaxTextBytes = 1 << 20;
// Characters of the enclosing modules' names, which the name of each definition repeats.
constexpr std::size_t kMaxModuleLength = 512;
constexpr std::size_t kMaxStructDepth = 64;   // nesting of structs and sequences
constexpr std::size_t kMaxSequenceDepth = 8;  // nesting of sequences
constexpr std::size_t kMaxDimensions = 8;
constexpr std::uint64_t kMaxElements =
    0xffffffff;  // of an array: the limit of a length on the wire

bool is_reserved(std::string_view name) {
  static const std::set<std::string_view> reserved = {
      "module", "struct",    "enum",      "union",     "switch", "case",    "default",  "typedef",
      "const",  "bitmask",   "bitset",    "map",       "any",    "fixed",   "wchar",    "wstring",
      "native", "interface", "valuetype", "exception", "import", "boolean", "octet",    "char",
      "short",  "long",      "unsigned",  "float",     "double", "string",  "sequence", "int8",
      "uint8",  "int16",     "uint16",    "int32",     "uint32", "int64",   "uint64"};
  return reserved.contains(name);
}

std::optional<Kind> kind_of_word(std::string_view word) {
  static const std::map<std::string_view, Kind> kinds = {
      {"boolean", Kind::boolean}, {"octet", Kind::octet},   {"char", Kind::character},
      {"int8", Kind::int8},       {"uint8", Kind::uint8},   {"short", Kind::int16},
      {"int16", Kind::int16},     {"uint16", Kind::uint16}, {"int32", Kind::int32},
      {"uint32", Kind::uint32},   {"int64", Kind::int64},   {"uint64", Kind::uint64},
      {"float", Kind::float32},   {"double", Kind::float64}};
  const auto found = kinds.find(word);
  return found == kinds.end() ? std::nullopt : std::optional(found->second);
}

class Parser {
 public:
  explicit Parser(std::string_view text) : tokens_(text) {}

  Idl parse() {
    while (tokens_.next().kind != Token::Kind::end) definition();
    return std::move(idl_);
  }

 private:
  struct Named {
    Kind kind;
    std::size_t definition, depth;  // depth: nesting of structs and sequences
  };

  void definition() {
    annotations({"final"});
    const Token word = tokens_.next();
    if (tokens_.take_if("module"))
      module();
    else if (tokens_.take_if("struct"))
      structure();
    else if (tokens_.take_if("enum"))
      enumeration();
    else if (word.kind == Token::Kind::identifier && is_reserved(word.text))
      throw_error_at(word, "'" + std::string(word.text) + "' is not supported here");
    else
      throw_error_at(word, "expected module, struct or enum, found " + quoted(word));
    tokens_.expect(";");
  }

  // Returns the annotations that are present; rejects those that are not allowed.
  std::set<std::string_view> annotations(const std::set<std::string_view>& allowed) {
    std::set<std::string_view> found;
    while (tokens_.take_if("@")) {
      const Token name = tokens_.expect_name("an annotation's name");
      if (name.text == "appendable" || name.text == "mutable")
        throw_error_at(name, "@" + std::string(name.text) +
                                 " is not supported: its layout on the wire differs");
      if (!allowed.contains(name.text))
        throw_error_at(name,
                       "the annotation @" + std::string(name.text) + " is not supported here");
      found.insert(name.text);
    }
    return found;
  }

  Token new_name(const char* what) {
    const Token name = tokens_.expect_name(what);
    if (is_reserved(name.text))
      throw_error_at(name, "expected " + std::string(what) + ", found the keyword " + quoted(name));
    return name;
  }

  std::string scoped(std::string_view name) const {
    std::string full;
    for (const std::string_view module : modules_) full += std::string(module) + "::";
    return full + std::string(name);
  }

  void declare(const Token& name, const Named& named) {
    if (!names_.emplace(scoped(name.text), named).second)
      throw_error_at(name, scoped(name.text) + " is defined twice");
  }

  void module() {
    const Token name = new_name("a module's name");
    modules_.push_back(name.text);
    if (scoped("").size() > kMaxModuleLength)
      throw_error_at(name, "the names of the enclosing modules exceed " +
                               std::to_string(kMaxModuleLength) + " characters");
    tokens_.expect("{");
    while (!tokens_.take_if("}")) {
      const Token& next = tokens_.next();
      if (next.kind == Token::Kind::end)
        throw_error_at(
            next, "expected '}' of module " + std::string(name.text) + ", found " + quoted(next));
      definition();
    }
    modules_.pop_back();
  }

  void enumeration() {
    const Token name = new_name("an enum's name");
    Enum result{scoped(name.text), {}};
    std::set<std::string_view> seen;
    tokens_.expect("{");
    do {
      annotations({});
      const Token enumerator = new_name("an enumerator");
      if (!seen.insert(enumerator.text).second)
        throw_error_at(enumerator, "enumerator " + quoted(enumerator) + " is defined twice");
      result.enumerators.emplace_back(enumerator.text);
    } while (tokens_.take_if(","));
    tokens_.expect("}");
    declare(name, {Kind::enumeration, idl_.enums.size(), 0});
    idl_.enums.push_back(std::move(result));
  }

  void structure() {
    const Token name = new_name("a struct's name");
    if (tokens_.next().text == ";")
      throw_error_at(tokens_.next(), "a declaration of struct " + std::string(name.text) +
                                         " without members is not supported");
    if (tokens_.next().text == ":") throw_error_at(tokens_.next(), "inheritance is not supported");
    Struct result{scoped(name.text), {}};
    std::size_t depth = 0;
    std::set<std::string_view> seen;
    tokens_.expect("{");
    do depth = std::max(depth, members(result, seen));
    while (!tokens_.take_if("}"));
    if (depth >= kMaxStructDepth)
      throw_error_at(name, "structs nested more than " + std::to_string(kMaxStructDepth) + " deep");
    declare(name, {Kind::structure, idl_.structs.size(), depth + 1});
    idl_.structs.push_back(std::move(result));
  }

  // Parses one declaration of a struct and returns the nesting depth of its type.
  std::size_t members(Struct& into, std::set<std::string_view>& seen) {
    const bool is_key = annotations({"key"}).contains("key");
    std::size_t depth = 0;
    const Type type = this->type(depth);
    do {
      const Token name = new_name("a field's name");
      if (!seen.insert(name.text).second)
        throw_error_at(name, "field " + quoted(name) + " is defined twice");
      into.members.push_back({std::string(name.text), type, dimensions(), is_key});
    } while (tokens_.take_if(","));
    tokens_.expect(";");
    return depth;
  }

  std::vector<std::uint32_t> dimensions() {
    std::vector<std::uint32_t> sizes;
    std::uint64_t elements = 1;
    while (tokens_.next().text == "[") {
      const Token opening = tokens_.take();
      sizes.push_back(tokens_.expect_positive("an array's size"));
      elements *= sizes.back();
      if (elements > kMaxElements)
        throw_error_at(opening,
                       "an array of more than " + std::to_string(kMaxElements) + " elements");
      if (sizes.size() > kMaxDimensions)
        throw_error_at(opening,
                       "an array of more than " + std::to_string(kMaxDimensions) + " dimensions");
      tokens_.expect("]");
    }
    return sizes;
  }

  std::uint32_t bound(const char* what) {
    const std::uint32_t limit = tokens_.expect_positive(what);
    tokens_.expect(">");
    return limit;
  }

  Type type(std::size_t& depth) {
    if (tokens_.next().text == "::") return reference(depth);
    const Token word = tokens_.expect_name("a type");
    if (word.text == "string")
      return {Kind::string, tokens_.take_if("<") ? bound("the string's bound") : 0, 0, {}};
    if (word.text == "sequence") return sequence(word, depth);
    if (word.text == "long")
      return {tokens_.take_if("long") ? Kind::int64 : long_of_32_bits(), 0, 0, {}};
    if (word.text == "unsigned") return {unsigned_kind(), 0, 0, {}};
    if (const auto kind = kind_of_word(word.text)) return {*kind, 0, 0, {}};
    if (is_reserved(word.text))
      throw_error_at(word, "'" + std::string(word.text) + "' is not supported here");
    return reference(depth, word);
  }

  Kind long_of_32_bits() {
    if (tokens_.next().text == "double")
      throw_error_at(tokens_.next(), "'long double' is not supported");
    return Kind::int32;
  }

  Kind unsigned_kind() {
    if (tokens_.take_if("short")) return Kind::uint16;
    if (!tokens_.take_if("long"))
      throw_error_at(tokens_.next(),
                     "expected short or long after unsigned, found " + quoted(tokens_.next()));
    return tokens_.take_if("long") ? Kind::uint64 : Kind::uint32;
  }

  Type sequence(const Token& word, std::size_t& depth) {
    if (++open_sequences_ > kMaxSequenceDepth)
      throw_error_at(word,
                     "sequences nested more than " + std::to_string(kMaxSequenceDepth) + " deep");
    Type result{Kind::sequence, 0, 0, {}};
    tokens_.expect("<");
    result.element.push_back(type(depth));
    if (tokens_.take_if(","))
      result.bound = bound("the sequence's bound");
    else
      tokens_.expect(">");
    --open_sequences_;
    ++depth;
    return result;
  }

  Type reference(std::size_t& depth, std::optional<Token> first = std::nullopt) {
    const bool from_outside = !first;
    if (!first) tokens_.take();
    const Token begin = first ? *first : tokens_.expect_name("a type");
    std::string name(begin.text);
    while (tokens_.take_if("::")) name += "::" + std::string(tokens_.expect_name("a type").text);
    // Searches from the innermost module outwards.
    for (std::size_t modules = from_outside ? 0 : modules_.size();; --modules) {
      std::string full;
      for (std::size_t i = 0; i < modules; ++i) full += std::string(modules_[i]) + "::";
      if (const auto found = names_.find(full + name); found != names_.end()) {
        depth = std::max(depth, found->second.depth);
        return {found->second.kind, 0, found->second.definition, {}};
      }
      if (modules == 0) throw_error_at(begin, "type " + name + " is not defined before its use");
    }
  }

  Tokens tokens_;
  Idl idl_;
  std::vector<std::string_view> modules_;
  std::map<std::string, Named, std::less<>> names_;
  std::size_t open_sequences_ = 0;
};

}  // namespace

Idl parse_idl(std::string_view text) {
  if (text.size() > kMaxTextBytes)
    throw IdlError("the IDL text has " + std::to_string(text.size()) + " bytes; the limit is " +
                   std::to_string(kMaxTextBytes));
  return Parser(text).parse();
}

}  // namespace fivepipe::schema
