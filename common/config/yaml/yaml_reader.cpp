#include "common/config/yaml/yaml_reader.h"

#include <fmt/ranges.h>
#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include "common/base/readable_file.h"
#include "common/config/yaml/key_suggestion.h"

namespace fivepipe::config {

SourceLocation location_of_mark(const YAML::Mark& mark) {
  return mark.is_null() ? SourceLocation{} : SourceLocation{mark.line + 1, mark.column + 1};
}

std::string kind_of(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Sequence: return "a list of " + std::to_string(node.size());
    case YAML::NodeType::Map: return "a mapping";
    case YAML::NodeType::Scalar: return '"' + node.Scalar() + '"';
    default: return "nothing";
  }
}

namespace {

// Collects where the documents of a file start, and nothing else.
class DocumentStarts : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark& mark) override { marks_.push_back(mark); }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
  const std::vector<YAML::Mark>& marks() const { return marks_; }

 private:
  std::vector<YAML::Mark> marks_;
};

// Returns the starts of the first two documents. At a comma, yaml-cpp 0.7 reads empty documents
// without end, which YAML::LoadAll() collects; so this function stops at the second.
std::vector<YAML::Mark> first_document_starts(const std::string& text) {
  std::istringstream in(text);
  YAML::Parser parser(in);
  DocumentStarts starts;
  while (starts.marks().size() < 2 && parser.HandleNextDocument(starts)) {
  }
  return starts.marks();
}

// Returns the location of the first tab among the blanks at the start of a line.
std::optional<SourceLocation> first_indenting_tab(const std::string& text) {
  SourceLocation at{1, 1};
  bool is_indentation = true;
  for (const char c : text) {
    if (c == '\t' && is_indentation) return at;
    is_indentation = c == '\n' || (is_indentation && c == ' ');
    at = c == '\n' ? SourceLocation{at.line + 1, 1} : SourceLocation{at.line, at.column + 1};
  }
  return std::nullopt;
}

}  // namespace

YamlMap YamlMap::load(const std::filesystem::path& file, Problems& problems) {
  const auto context = std::make_shared<Context>(Context{file, &problems, nullptr});
  const YamlMap nothing(context, YAML::Node(YAML::NodeType::Undefined), "the file");
  if (const auto why = base::why_unreadable(file)) {
    nothing.report({}, *why);
    return nothing;
  }
  std::ifstream in(file);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  try {
    const std::vector<YAML::Mark> starts = first_document_starts(text);
    if (starts.size() > 1) {
      const bool is_comma = starts[1].pos == starts[0].pos;
      nothing.report(location_of_mark(starts[1]),
                     is_comma ? "not YAML: a value cannot start with a comma"
                              : "the file contains a second YAML document: remove it");
      return nothing;
    }
    const YAML::Node document = YAML::Load(text);
    if (document.IsMap()) return YamlMap(context, document, "the file");
    nothing.report({1, 1}, "the file must contain a mapping of keys to values");
  } catch (const YAML::Exception& error) {
    const SourceLocation at = location_of_mark(error.mark);
    // The error may show in the line after the tab.
    if (const auto tab = first_indenting_tab(text);
        tab && (tab->line == at.line || tab->line + 1 == at.line))
      nothing.report(*tab, "not YAML: a tab cannot indent a line, use spaces");
    else
      nothing.report(at, "not YAML: " + error.msg);
  }
  return nothing;
}

YamlMap::YamlMap(std::shared_ptr<Context> context, YAML::Node node, std::string what)
    : context_(std::move(context)), node_(std::move(node)), what_(std::move(what)) {
  if (is_void()) return;
  std::map<std::string, int> line_of_key;
  for (const auto& entry : node_) {
    const SourceLocation location = location_of_mark(entry.first.Mark());
    if (!entry.first.IsScalar()) {
      report(location, "a key must be a single word, is " + kind_of(entry.first));
      continue;
    }
    const auto [first, is_new] = line_of_key.try_emplace(entry.first.Scalar(), location.line);
    if (!is_new)
      report(location, "duplicate key " + entry.first.Scalar() + ", already set in line " +
                           std::to_string(first->second));
  }
}

void YamlMap::use_settings(Settings& settings) { context_->settings = &settings; }

void YamlMap::report(SourceLocation location, const std::string& what) const {
  context_->problems->add(context_->file, location, what);
}

SourceLocation YamlMap::location() const {
  return is_void() ? SourceLocation{} : location_of_mark(node_.Mark());
}

SourceLocation YamlMap::location_of(const std::string& key) const {
  if (!is_void())
    for (const auto& entry : node_)
      if (entry.first.IsScalar() && entry.first.Scalar() == key)
        return location_of_mark(entry.second.IsNull() ? entry.first.Mark() : entry.second.Mark());
  return location();
}

std::vector<std::string> YamlMap::keys() const {
  std::vector<std::string> result;
  if (!is_void())
    for (const auto& entry : node_)
      if (entry.first.IsScalar() &&
          std::find(result.begin(), result.end(), entry.first.Scalar()) == result.end())
        result.push_back(entry.first.Scalar());
  return result;
}

YAML::Node YamlMap::value_of(const std::string& key, bool required) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.push_back(key);
  if (is_void()) return YAML::Node(YAML::NodeType::Undefined);
  for (const auto& entry : node_)
    if (entry.first.IsScalar() && entry.first.Scalar() == key) {
      if (!entry.second.IsNull()) return entry.second;
      report(location_of_mark(entry.first.Mark()), key + " has no value");
      return YAML::Node(YAML::NodeType::Undefined);
    }
  if (required) missing_.try_emplace(key);
  return YAML::Node(YAML::NodeType::Undefined);
}

bool YamlMap::has(const std::string& key) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.push_back(key);
  const auto present = keys();
  return std::find(present.begin(), present.end(), key) != present.end();
}

bool YamlMap::is_text(const std::string& key) {
  return value_of(key, false).IsDefined() && value_of(key, false).IsScalar();
}

YamlMap YamlMap::map(const std::string& key) {
  YAML::Node node = value_of(key, true);
  if (node.IsDefined() && !node.IsMap())
    report(location_of_mark(node.Mark()),
           key + " must be a mapping of keys to values, is " + kind_of(node));
  return YamlMap(context_, node, key);
}

std::vector<YamlMap> YamlMap::maps(const std::string& key) {
  std::vector<YamlMap> result;
  const YAML::Node node = value_of(key, true);
  if (!node.IsDefined()) return result;
  if (!node.IsSequence() || node.size() == 0) {
    report(location_of_mark(node.Mark()),
           key + " must be a list of at least one, is " + kind_of(node));
    return result;
  }
  for (std::size_t i = 0; i < node.size(); ++i) {
    const std::string what = key + '[' + std::to_string(i) + ']';
    if (!node[i].IsMap())
      report(location_of_mark(node[i].Mark()),
             what + " must be a mapping of keys to values, is " + kind_of(node[i]));
    result.push_back(YamlMap(context_, node[i], what));
  }
  return result;
}

void YamlMap::finish() {
  if (is_void()) return;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar()) continue;
    const std::string key = entry.first.Scalar();
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    std::string what = "unknown key " + key;
    if (const auto suggestion = suggest_key(key, known_)) {
      what += (suggestion->unit_differs ? ": use " : ": did you mean ") + suggestion->key;
      if (!suggestion->unit_differs) what += '?';
      missing_.erase(suggestion->key);
    } else {
      what += fmt::format("; known keys: {}", fmt::join(known_, ", "));
    }
    report(location_of_mark(entry.first.Mark()), what);
  }
  report_missing();
}

void YamlMap::report_missing() {
  for (const auto& [key, hint] : missing_)
    report(location(), key + " is missing in " + what_ + (hint.empty() ? "" : ": " + hint));
  missing_.clear();
}

}  // namespace fivepipe::config
