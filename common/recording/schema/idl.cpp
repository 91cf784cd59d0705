#include "common/recording/schema/idl.h"

#include <algorithm>
#include <set>

namespace fivepipe::schema {
namespace {

std::string module_of(const std::string& scoped_name) {
  const std::size_t end = scoped_name.rfind("::");
  return end == std::string::npos ? "" : scoped_name.substr(0, end);
}
std::string name_inside(const std::string& scoped_name, std::string_view module) {
  return module_of(scoped_name) == module && !module.empty() ? scoped_name.substr(module.size() + 2)
                                                             : scoped_name;
}

const Type& innermost(const Type& type) {
  return type.kind == Kind::sequence ? innermost(type.element[0]) : type;
}

std::string dimensions_text(const Member& member) {
  std::string text;
  for (std::uint32_t size : member.dimensions) text += "[" + std::to_string(size) + "]";
  return text;
}

// Writes self-contained IDL text: each definition once, after those that it needs.
class TextWriter {
 public:
  explicit TextWriter(const Idl& idl) : idl_(idl) {}

  void add(const Struct& type) {
    if (!written_.insert(type.name).second) return;
    for (const Member& member : type.members) {
      const Type& needed = innermost(member.type);
      if (needed.kind == Kind::structure) add(idl_.structs[needed.definition]);
      if (needed.kind == Kind::enumeration) add(idl_.enums[needed.definition]);
    }
    const std::string module = enter_module_of(type.name);
    line("@final struct " + name_inside(type.name, module) + " {");
    for (const Member& member : type.members)
      line("  " + std::string(member.is_key ? "@key " : "") + type_text(idl_, member.type, module) +
           " " + member.name + dimensions_text(member) + ";");
    line("};");
  }

  std::string finish() {
    enter({});
    return std::move(text_);
  }

 private:
  void add(const Enum& type) {
    if (!written_.insert(type.name).second) return;
    const std::string module = enter_module_of(type.name);
    std::string names;
    for (const std::string& enumerator : type.enumerators)
      names += (names.empty() ? "" : ", ") + enumerator;
    line("enum " + name_inside(type.name, module) + " { " + names + " };");
  }

  std::string enter_module_of(const std::string& scoped_name) {
    const std::string module = module_of(scoped_name);
    std::vector<std::string> path;
    for (std::size_t begin = 0; begin < module.size();) {
      const std::size_t end = std::min(module.find("::", begin), module.size());
      path.push_back(module.substr(begin, end - begin));
      begin = end + 2;
    }
    enter(path);
    return module;
  }

  void enter(const std::vector<std::string>& path) {
    while (open_.size() > path.size() || !std::equal(open_.begin(), open_.end(), path.begin())) {
      open_.pop_back();
      line("};");
    }
    while (open_.size() < path.size()) {
      line("module " + path[open_.size()] + " {");
      open_.push_back(path[open_.size()]);
    }
  }

  void line(const std::string& text) { text_ += std::string(2 * open_.size(), ' ') + text + "\n"; }

  const Idl& idl_;
  std::set<std::string_view> written_;
  std::vector<std::string> open_;
  std::string text_;
};

class Comparison {
 public:
  Comparison(const Idl& a, const Idl& b) : a_(a), b_(b) {}

  std::string of(const Struct& a, const Struct& b, const std::string& path) {
    // Compares a type that is used in many places only once.
    if (!compared_.emplace(&a, &b).second) return "";
    for (std::size_t i = 0; i < std::max(a.members.size(), b.members.size()); ++i) {
      if (i >= a.members.size()) return "field " + path + b.members[i].name + " is missing";
      if (i >= b.members.size()) return "field " + path + a.members[i].name + " is new";
      if (std::string found = of(a.members[i], b.members[i], path); !found.empty()) return found;
    }
    return "";
  }

 private:
  std::string of(const Member& a, const Member& b, const std::string& path) {
    if (a.name != b.name) return "field " + path + a.name + " instead of " + b.name;
    const std::string field = "field " + path + a.name;
    if (const std::string x = type_text(a_, a.type) + dimensions_text(a),
        y = type_text(b_, b.type) + dimensions_text(b);
        x != y)
      return field + ": " + x + " instead of " + y;
    if (a.is_key != b.is_key) return field + (a.is_key ? " is a key" : " is not a key");
    // Both have the same kind and name, because their texts are equal.
    const Type &x = innermost(a.type), &y = innermost(b.type);
    if (x.kind == Kind::structure && y.kind == Kind::structure)
      return of(a_.structs[x.definition], b_.structs[y.definition], path + a.name + ".");
    if (x.kind == Kind::enumeration && y.kind == Kind::enumeration)
      return of(a_.enums[x.definition], b_.enums[y.definition], field);
    return x.kind == y.kind
               ? ""
               : field + ": a struct instead of an enum, or an enum instead of a struct";
  }

  static std::string of(const Enum& a, const Enum& b, const std::string& field) {
    for (std::size_t i = 0; i < std::max(a.enumerators.size(), b.enumerators.size()); ++i) {
      if (i >= a.enumerators.size())
        return field + ": " + b.enumerators[i] + " of " + b.name + " is missing";
      if (i >= b.enumerators.size())
        return field + ": " + a.enumerators[i] + " of " + a.name + " is new";
      if (a.enumerators[i] != b.enumerators[i])
        return field + ": " + a.enumerators[i] + " instead of " + b.enumerators[i] + " in " +
               a.name;
    }
    return "";
  }

  const Idl &a_, &b_;
  std::set<std::pair<const Struct*, const Struct*>> compared_;
};

}  // namespace

std::size_t size_bytes(Kind primitive) {
  switch (primitive) {
    case Kind::int16:
    case Kind::uint16: return 2;
    case Kind::int32:
    case Kind::uint32:
    case Kind::float32: return 4;
    case Kind::int64:
    case Kind::uint64:
    case Kind::float64: return 8;
    default: return 1;
  }
}

const Member* Struct::find(std::string_view member) const {
  const auto found = std::find_if(members.begin(), members.end(),
                                  [&](const Member& m) { return m.name == member; });
  return found == members.end() ? nullptr : &*found;
}

const Struct* Idl::find(std::string_view scoped_name) const {
  const auto found = std::find_if(structs.begin(), structs.end(),
                                  [&](const Struct& s) { return s.name == scoped_name; });
  return found == structs.end() ? nullptr : &*found;
}

const Struct& Idl::at(std::string_view scoped_name) const {
  if (const Struct* found = find(scoped_name)) return *found;
  throw IdlError("the schema has no struct " + std::string(scoped_name));
}

std::string type_text(const Idl& idl, const Type& type, std::string_view module) {
  switch (type.kind) {
    case Kind::boolean: return "boolean";
    case Kind::octet: return "octet";
    case Kind::character: return "char";
    case Kind::int8: return "int8";
    case Kind::uint8: return "uint8";
    case Kind::int16: return "short";
    case Kind::uint16: return "unsigned short";
    case Kind::int32: return "long";
    case Kind::uint32: return "unsigned long";
    case Kind::int64: return "long long";
    case Kind::uint64: return "unsigned long long";
    case Kind::float32: return "float";
    case Kind::float64: return "double";
    case Kind::string: return type.bound ? "string<" + std::to_string(type.bound) + ">" : "string";
    case Kind::enumeration: return name_inside(idl.enums[type.definition].name, module);
    case Kind::structure: return name_inside(idl.structs[type.definition].name, module);
    case Kind::sequence: break;
  }
  std::string inner = type_text(idl, type.element[0], module);
  if (type.bound) return "sequence<" + inner + ", " + std::to_string(type.bound) + ">";
  // Some parsers read ">>" as one token.
  return "sequence<" + inner + (inner.back() == '>' ? " >" : ">");
}

std::string self_contained(const Idl& idl, std::string_view scoped_name) {
  TextWriter writer(idl);
  writer.add(idl.at(scoped_name));
  return writer.finish();
}

std::string difference(const Idl& a, const Idl& b, std::string_view scoped_name) {
  return Comparison(a, b).of(a.at(scoped_name), b.at(scoped_name), "");
}

}  // namespace fivepipe::schema
