// Checks the documents against the tree: links, files, commands, options, configuration keys and
// quoted constants exist.
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/support/source_text.h"

namespace fivepipe::test {
namespace {

namespace fs = std::filesystem;

// The changelog names removed things, so only its links are checked.
std::vector<fs::path> documents() {
  std::vector<fs::path> files = {"README.md", "CONTRIBUTING.md"};
  for (const auto& entry : fs::directory_iterator(kRoot / "docs"))
    if (entry.path().extension() == ".md") files.push_back(fs::relative(entry.path(), kRoot));
  return files;
}

std::vector<std::string> matches(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  std::vector<std::string> found;
  for (auto it = std::sregex_iterator(text.begin(), text.end(), regex);
       it != std::sregex_iterator(); ++it)
    found.push_back((*it)[1]);
  return found;
}

// The anchor that GitHub gives a heading.
std::string anchor_of(const std::string& heading) {
  std::string anchor;
  for (const char c : heading) {
    if (std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_')
      anchor += char(std::tolower(static_cast<unsigned char>(c)));
    else if (c == ' ')
      anchor += '-';
  }
  return anchor;
}

TEST(Docs, LinksLeadToFilesAndHeadings) {
  std::vector<fs::path> files = documents();
  files.push_back("CHANGELOG.md");
  for (const fs::path& file : files)
    for (const std::string& link : matches(text_of(file), R"(\]\(([^)]+)\))")) {
      if (link.starts_with("http")) continue;
      const std::size_t hash = link.find('#');
      const std::string path = link.substr(0, hash);
      const fs::path target = path.empty() ? file : file.parent_path() / path;
      ASSERT_TRUE(fs::exists(kRoot / target)) << file << " links to " << link;
      if (hash == std::string::npos) continue;
      std::set<std::string> anchors;
      for (const std::string& heading : matches(text_of(target), R"((?:^|\n)#+ ([^\n]+))"))
        anchors.insert(anchor_of(heading));
      EXPECT_TRUE(anchors.contains(link.substr(hash + 1))) << file << " links to " << link;
    }
}

TEST(Docs, NamedFilesExist) {
  std::set<std::string> folders;
  for (const auto& entry : fs::directory_iterator(kRoot))
    if (entry.is_directory()) folders.insert(entry.path().filename());
  folders.erase("build");
  folders.erase("out");
  for (const fs::path& file : documents())
    for (const std::string& name : matches(text_of(file), R"(`([\w.-]+/[\w./-]*)`)")) {
      if (!folders.contains(name.substr(0, name.find('/')))) continue;
      if (name.find("NAME") != std::string::npos) continue;  // a placeholder
      EXPECT_TRUE(fs::exists(kRoot / name)) << file << " names " << name;
    }
}

// The sources that define commands and options.
std::string command_sources() {
  std::string sources = text_of("launch/demo") + text_of("launch/reference-benchmarks") +
                        text_of("launch/figures") + text_of("tests/run") +
                        text_of("tests/check-code") + text_of("tests/mutations/run") +
                        text_of("tests/mutations/draw");
  for (const char* folder : {"launch", "benchmarks", "capture_node"})
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder))
      if (entry.path().extension() == ".cpp") sources += text_of(fs::relative(entry.path(), kRoot));
  return sources;
}

// The whole option, not only the start of a longer one.
bool holds_option(const std::string& text, const std::string& option) {
  for (std::size_t at = text.find(option); at != text.npos; at = text.find(option, at + 1)) {
    const std::size_t end = at + option.size();
    if (end == text.size() || !(std::islower(static_cast<unsigned char>(text[end])) ||
                                text[end] == '-' || text[end] == '_'))
      return true;
  }
  return false;
}

TEST(Docs, CommandsAndTheirOptionsExist) {
  const std::string sources = command_sources();
  for (const fs::path& file : documents()) {
    const std::string text = text_of(file);
    for (const std::string& command : matches(text, R"((?:\n {4}|`|/)fivepipe ([a-z]+)\b)"))
      EXPECT_NE(sources.find('"' + command + '"'), std::string::npos)
          << file << " names the subcommand " << command;
    for (const std::string& script : matches(text, R"(\n {4}(?:\./)?((?:launch|tests)/[a-z-]+))"))
      EXPECT_TRUE(fs::exists(kRoot / script)) << file << " runs " << script;
    // Options of programs that are not ours.
    static const std::set<std::string> kForeign = {"--build",   "--target", "--gtest_filter",
                                                   "--install", "--args",   "--prefix",
                                                   "--system",  "--now"};
    for (const std::string& option : matches(text, R"([ `=](--[a-z][a-z_-]+))"))
      EXPECT_TRUE(kForeign.contains(option) || holds_option(sources, option))
          << file << " names " << option;
  }
}

TEST(Docs, ConfigurationKeysExist) {
  std::string readers;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "common/config"))
    if (entry.path().extension() == ".cpp") readers += text_of(fs::relative(entry.path(), kRoot));
  int keys = 0;
  const auto expect_key = [&](const std::string& key, const fs::path& file) {
    ++keys;
    EXPECT_NE(readers.find('"' + key + '"'), std::string::npos) << file << " has key " << key;
  };
  for (const fs::path& file : documents())
    for (const std::string& block : matches(text_of(file), "```yaml\\n([^`]*)```"))
      for (const std::string& key : matches(block, R"((?:\n|[{,-]) *([a-z_]+):)"))
        expect_key(key, file);
  EXPECT_GT(keys, 20);
  // The first column of each table of keys.
  const fs::path reference = "docs/configuration.md";
  for (const std::string& table :
       matches(text_of(reference), R"(\n\| key \|[^\n]*\n[-| ]+\n((?:\|[^\n]*\n)+))"))
    for (const std::string& cell : matches("\n" + table, R"(\n\|([^|]*)\|)"))
      for (const std::string& key : matches(cell, R"(`([^`]*)`)")) expect_key(key, reference);
  EXPECT_GT(keys, 120);
}

// A number in a document and the constant in the code that it quotes.
struct QuotedConstant {
  const char *document, *sentence, *file, *constant;
};

TEST(Docs, QuotedConstantsAreThoseOfTheCode) {
  const QuotedConstant quoted[] = {
      {"docs/architecture.md", R"(at most (\d+) incomplete sets)",
       "common/pipeline/frames/frame_set_assembler.h", R"(kMaxIncompleteSets = (\d+))"},
      {"docs/architecture.md", R"(while (\d+) frames arrive from others)",
       "common/pipeline/frames/frame_set_assembler.h", R"(kLostAfterFrames = (\d+))"},
      {"docs/architecture.md", R"(At most (\d+) frames are open)",
       "render_node/views/tile_assembler.h", R"(kMaxOpenFrames = (\d+))"},
      {"docs/architecture.md", R"(waits at most (\d+) ms for the simulation's state)",
       "render_node/views/pending_frames.h", R"(kStateTimeout\{(\d+)\})"},
      {"docs/collision.md", R"(touch the hull first, within ([\d.]+) pixels)",
       "sim_node/contact/support_points.h", R"(kTouchesFirst = ([\d.]+))"},
      {"docs/architecture.md", R"(composites nothing for (\d+) ms)", "capture_node/pacing/pacing.h",
       R"(kStallTimeout\{(\d+)\})"},
      {"docs/architecture.md", R"(After (\d+) ms it drops the sample)",
       "common/pipeline/bus/bus.cpp", R"(RELIABLE, DDS_MSECS\((\d+)\))"},
      {"docs/architecture.md", R"(while more than (\d+) MB are unacknowledged)",
       "launch/profiles/loopback.xml", R"(<WhcHigh>(\d+) ?MB)"},
      {"docs/architecture.md", R"(counts at most (\d+) subjects per reason)",
       "common/pipeline/node/drop_counts.h", R"(kMaxPerReason = (\d+))"},
      {"docs/architecture.md", R"(at most (\d+) keys per writer)", "common/pipeline/bus/topics.h",
       R"(kMaxKeys = (\d+))"},
      {"docs/architecture.md", R"((\d+) for `HullTile`, and refuses)",
       "common/pipeline/bus/topics.h", R"(kMaxTiles = (\d+))"},
      {"docs/architecture.md", R"(Beyond (\d+) writers of a topic)",
       "common/pipeline/bus/key_limit.h", R"(kMaxWriters = (\d+))"},
      {"docs/architecture.md", R"(no frame set arrives for (\d+) ms)",
       "sim_node/simulation_pipe.cpp", R"(kFrameSetTimeout = (\d+)ms)"},
      {"docs/recording.md", R"(buffers up to (\d+) MiB)",
       "common/recording/files/recording_writer.h", R"(max_queued_bytes = std::size_t\((\d+)\))"},
      {"docs/recording.md", R"(closes a chunk at (\d+) MiB)",
       "common/recording/files/recording_writer.h", R"(chunk_bytes = std::size_t\((\d+)\))"},
      {"docs/recording.md", R"(MiB or after (\d+\.\d+) s)",
       "common/recording/files/recording_writer.h", R"(chunk_s = (\d+\.\d+))"},
  };
  for (const QuotedConstant& q : quoted) {
    const std::string document = std::regex_replace(text_of(q.document), std::regex("\\s+"), " ");
    const auto stated = matches(document, q.sentence),
               defined = matches(text_of(q.file), q.constant);
    ASSERT_EQ(stated.size(), 1u) << q.document << ": " << q.sentence;
    ASSERT_EQ(defined.size(), 1u) << q.file << ": " << q.constant;
    EXPECT_EQ(stated[0], defined[0]) << q.document << ": " << q.sentence;
  }
}

// The file for programs in an unsecured deployment is that for a secured one without its keys.
TEST(Docs, TheNetworkFilesOfOwnProgramsDifferInSecurityOnly) {
  const auto network_of = [](const std::string& name) {
    const std::string text = text_of("docs/examples/" + name + "/" + name + ".xml");
    return text.substr(text.find("<CycloneDDS>"));
  };
  std::string secured = network_of("secured_program");
  const std::string end = "</Security>\n";
  const std::size_t from = secured.find("    <Security>"), to = secured.find(end);
  ASSERT_NE(from, std::string::npos);
  ASSERT_NE(to, std::string::npos);
  EXPECT_EQ(secured.erase(from, to + end.size() - from), network_of("lan_program"));
}

}  // namespace
}  // namespace fivepipe::test
