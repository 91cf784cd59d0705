// The permissions of each role against the sources of its programs.
#include "launch/keys/role_topics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <string>

#include "common/pipeline/bus/topics.h"

namespace fivepipe::keys {
namespace {

namespace fs = std::filesystem;
using security::Role;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

const fs::path kRoot = FIVEPIPE_SOURCE_DIR;

struct Used {
  std::set<std::string> writes, reads;
};

// Adds the topics that the source, and what it includes of common/pipeline/node, writes and reads.
void add_topics(const fs::path& file, std::set<fs::path>& seen, Used& used) {
  if (!fs::exists(kRoot / file) || !seen.insert(file).second) return;
  std::ifstream stream(kRoot / file);
  const std::string text((std::istreambuf_iterator<char>(stream)), {});
  static const std::regex endpoint("(writer|reader)<(?:bus::)?topics::(\\w+)>"),
      include("#include \"(common/pipeline/node/\\w+)\\.h\"");
  for (std::sregex_iterator it(text.begin(), text.end(), endpoint), end; it != end; ++it)
    ((*it)[1] == "writer" ? used.writes : used.reads).insert("fivepipe/v1/" + (*it)[2].str());
  for (std::sregex_iterator it(text.begin(), text.end(), include), end; it != end; ++it)
    for (const char* extension : {".h", ".cpp"}) add_topics((*it)[1].str() + extension, seen, used);
}

Used used_by(const std::vector<std::string>& places) {
  Used used;
  std::set<fs::path> seen;
  for (const std::string& place : places)
    if (fs::is_directory(kRoot / place)) {
      for (const auto& entry : fs::recursive_directory_iterator(kRoot / place))
        if (entry.path().extension() == ".h" || entry.path().extension() == ".cpp")
          add_topics(fs::relative(entry.path(), kRoot), seen, used);
    } else {
      EXPECT_TRUE(fs::exists(kRoot / place)) << place;
      add_topics(place, seen, used);
    }
  return used;
}

std::set<std::string> set_of(const std::vector<std::string>& names) {
  return {names.begin(), names.end()};
}

std::set<std::string> all_topics() {
  std::set<std::string> names;
  for (const bus::topics::Topic& topic : bus::topics::all()) names.insert(topic.name);
  return names;
}

// A missing topic makes the program fail, a further one gives it more than it needs.
TEST(RoleTopics, AreThoseThatTheProgramsOfTheRoleWriteAndRead) {
  for (const auto& [role, places] : std::map<Role, std::vector<std::string>>{
           {Role::capture, {"capture_node"}},
           {Role::recon, {"recon_node"}},
           {Role::sim, {"sim_node"}},
           {Role::render, {"render_node"}},
           {Role::supervisor, {"launch/supervise"}},
           {Role::commands, {"launch/cli/simulation.cpp", "launch/study"}}}) {
    const Used used = used_by(places);
    EXPECT_FALSE(used.writes.empty() && used.reads.empty()) << "the sources were not found";
    EXPECT_EQ(set_of(topics_of(role).publishes), used.writes) << name_of(role);
    EXPECT_EQ(set_of(topics_of(role).subscribes), used.reads) << name_of(role);
  }
}

TEST(RoleTopics, ObserversReadAllTopicsAndWriteNone) {
  EXPECT_THAT(topics_of(Role::observer).publishes, IsEmpty());
  EXPECT_EQ(set_of(topics_of(Role::observer).subscribes), all_topics());
  for (const char* source : {"top", "ls", "echo", "hz"})
    EXPECT_THAT(used_by({"launch/cli/" + std::string(source) + ".cpp"}).writes, IsEmpty())
        << source;
  EXPECT_THAT(used_by({"launch/inspect"}).writes, IsEmpty());
}

TEST(RoleTopics, RecorderWritesOnlyItsStatus) {
  const RoleTopics topics = topics_of(Role::recorder);
  EXPECT_EQ(set_of(topics.subscribes), all_topics());
  EXPECT_EQ(set_of(topics.publishes), used_by({"common/recording/replay/record_session.cpp",
                                               "common/recording/replay/recorder.cpp"})
                                          .writes);
}

TEST(RoleTopics, ReplayWritesAllTopicsAndReadsTraces) {
  const RoleTopics topics = topics_of(Role::replay);
  std::set<std::string> writes = all_topics(), reads = {bus::topics::FrameTrace::name};
  for (const std::string& topic : all_topics()) {
    writes.insert(topic + "/type/*");
    reads.insert(topic + "/type/*");
  }
  EXPECT_EQ(set_of(topics.publishes), writes);
  EXPECT_EQ(set_of(topics.subscribes), reads);
}

TEST(RoleTopics, OnlyCommandsAndReplayMayCommand) {
  for (const Role role : security::kRoles)
    EXPECT_EQ(set_of(topics_of(role).publishes).contains(bus::topics::Command::name),
              role == Role::commands || role == Role::replay)
        << name_of(role);
}

// The window of a render_node has keys for it, and `fivepipe up` repeats a request after a restart.
TEST(RoleTopics, OnlyTheseMayMoveAPart) {
  for (const Role role : security::kRoles)
    EXPECT_EQ(set_of(topics_of(role).publishes).contains(bus::topics::SpacingRequest::name),
              role == Role::commands || role == Role::render || role == Role::supervisor ||
                  role == Role::replay)
        << name_of(role);
}

TEST(RoleTopics, TrackerWritesThePoseOfTheHead) {
  EXPECT_THAT(topics_of(Role::tracker).publishes, ElementsAre(bus::topics::HeadPose::name));
  EXPECT_THAT(topics_of(Role::tracker).subscribes, IsEmpty());
}

}  // namespace
}  // namespace fivepipe::keys
