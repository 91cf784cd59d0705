// A deployment with `security`, its commands, and processes without its keys.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "common/pipeline/messages/wire_conversions.h"
#include "common/pipeline/security/plugins.h"
#include "launch/keys/authority.h"
#include "tests/support/recording/recordings.h"
#include "tests/support/sanitizer.h"
#include "tests/support/text.h"
#include "tests/system/security/secured.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using security::Protection;
using security::Role;
using ::testing::AnyOf;
using ::testing::HasSubstr;

namespace fs = std::filesystem;

// Of a command that joins, looks and ends.
constexpr auto kCommandTime = 20s * kSlowdown;

// The bus of the test has no keys.
class SecuredDeployment : public RecordingTest {
 protected:
  // The small deployment of this test's domain, with its keys in `name`/keys.
  std::string secured(const std::string& name, Protection protection = Protection::encrypt,
                      int days_ago = 0) {
    make_small_keys(folder_ / name / "keys", domain_, protection, days_ago);
    return changed_deployment(folder_ / name, "program: render_node}",
                              "program: render_node, video: false}\ndomain: " +
                                  std::to_string(domain_) + "\nsecurity: {keys: keys}\n");
  }
  // The same in `files`, with keys that expire in life_s seconds.
  std::string secured_for(int life_s) {
    const std::string file = secured("files");
    keys::make_keys({.folder = folder_ / "files/keys",
                     .deployment = "small",
                     .domain = domain_,
                     .protection = Protection::encrypt,
                     .days = 1,
                     .now_s = std::time(nullptr) - security::kDay_s + life_s});
    return file;
  }
  void start(const std::string& deployment, const std::vector<std::string>& more = {}) {
    deployed_.emplace(deployment, domain_, out_, more);
    EXPECT_TRUE(eventually(bus_, kStart, [&] { return is_rendering(); })) << deployed_->said();
  }
  // `fivepipe up` prints the frame rate after 5 s.
  bool is_rendering() const {
    return contains(deployed_->said(), "frames composited, now ") ||
           contains(deployed_->said(), "frame composited, now ");
  }
  nlohmann::json ended_by(int signal_number) {
    deployed_->signal(signal_number);
    EXPECT_TRUE(deployed_->wait_for_end(5s * kSlowdown)) << deployed_->said();
    return nlohmann::json::parse(std::ifstream(out_ / "report.json"));
  }
  // Runs a command to its end. Returns its exit code and output.
  std::pair<int, std::string> result_of(std::vector<std::string> words,
                                        const std::string& deployment = "") {
    if (!deployment.empty()) words.insert(words.end(), {"--deployment", deployment});
    const auto program = fivepipe(words.front(), words);
    const auto code = program->wait_for_end(kCommandTime);
    EXPECT_TRUE(code) << words.front() << ": " << program->said();
    return {code.value_or(-1), program->said()};
  }

  const fs::path out_ = folder_ / "out";
  std::optional<Deployed> deployed_;
};

class BothProtections : public SecuredDeployment, public testing::WithParamInterface<Protection> {};

TEST_P(BothProtections, CommandsJoinByTheirRolesAndFramesAreComposited) {
  const std::string file = secured("files", GetParam()), recording = folder_ / "whole.mcap";
  start(file, {"--record", recording});
  const auto [top_code, top] = result_of({"top", "--once"}, file);
  EXPECT_EQ(top_code, 0) << top;
  for (const std::string& node : kNodes)
    EXPECT_THAT(top, testing::ContainsRegex("\n" + node + " +[^ ]+ +running "));
  const auto [ls_code, ls] = result_of({"ls"}, file);
  EXPECT_EQ(ls_code, 0) << ls;
  EXPECT_THAT(ls, HasSubstr("fivepipe/v1/HullTile"));
  EXPECT_EQ(result_of({"hz", "ObjectPixelMap", "--once", "4"}, file).first, 0);
  EXPECT_EQ(result_of({"echo", "HeadPose", "--count", "2"}, file).first, 0);
  EXPECT_EQ(result_of({"simulation", "pause"}, file).first, 0);
  // The recorder authenticates first.
  const auto [record_code, record] = result_of(
      {"record", "-o", folder_ / "part.mcap", "--duration", kHasSanitizer ? "15" : "4"}, file);
  EXPECT_EQ(record_code, 0) << record;
  const auto report = ended_by(SIGINT);
  EXPECT_GT(report["frames"]["composited"].get<int>(), 20) << report["frames"].dump(1);
  EXPECT_EQ(report["recorder"]["lost"], 0);
  EXPECT_GT(counts_by_topic(recording::Recording(recording)).at(bus::topics::FrameComposited::name),
            20u);
  // Each writer of a replay needs the type of its topic.
  EXPECT_EQ(result_of({"replay", recording, "--end", "0.2", "--no-wait"}, file).first, 0);
}

INSTANTIATE_TEST_SUITE_P(Protections, BothProtections,
                         testing::Values(Protection::sign, Protection::encrypt),
                         [](const auto& parameter) { return name_of(parameter.param); });

TEST_F(SecuredDeployment, AParticipantWithoutKeysNeitherReceivesNorSends) {
  auto frames = bus_.reader<bus::topics::FrameComposited>();
  auto poses = bus_.reader<bus::topics::HeadPose>();
  auto statuses_in = bus_.reader<bus::topics::NodeStatus>();
  bus::Bus member({.domain = domain_, .participant = "mallory", .deployment = "small"});
  auto commands = member.writer<bus::topics::Command>();
  auto statuses = member.writer<bus::topics::NodeStatus>();
  auto maps = member.writer<bus::topics::ObjectPixelMap>();
  const std::string file = secured("files");
  start(file);
  fivepipe_v1_NodeStatus status{};
  messages::set_text(status.node, "mallory");
  commands.write({});
  statuses.write(status);
  EXPECT_EQ(commands.readers(), 0);
  EXPECT_EQ(maps.readers(), 0);
  EXPECT_EQ(statuses.readers(), 1) << "that of the test";
  const auto [code, top] = result_of({"top", "--once"}, file);
  EXPECT_EQ(code, 0) << top;
  EXPECT_THAT(top, testing::Not(HasSubstr("mallory")));
  EXPECT_TRUE(frames.take().empty());
  EXPECT_TRUE(poses.take().empty());
  EXPECT_EQ(frames.writers(), 0);
  for (const auto& sample : statuses_in.take())
    EXPECT_TRUE(!sample.valid() || std::string(sample->node) == "mallory") << sample->node;
  EXPECT_TRUE(is_rendering());
  const auto report = ended_by(SIGINT);
  EXPECT_TRUE(report["refused_from"].empty()) << "not even refused: nothing arrived";
  EXPECT_GT(report["frames"]["composited"].get<int>(), 20);
}

TEST_F(SecuredDeployment, ACommandWithoutKeysReportsWhichOptionAdmitsIt) {
  start(secured("files"));
  for (const auto& [words, expected] :
       {std::pair<std::vector<std::string>, int>({"top", "--once"}, 3),
        {{"ls"}, 3},
        {{"hz", "HeadPose", "--once", "3"}, 3},
        {{"simulation", "pause"}, 3},
        {{"record", "-o", folder_ / "none.mcap", "--duration", "3"}, 1}}) {
    const auto [code, said] = result_of(words);
    EXPECT_EQ(code, expected) << words.front() << ": " << said;
    EXPECT_THAT(said,
                HasSubstr("deployment 'small' runs there, but exchanges no messages with this "
                          "program: with security it admits only programs that have its "
                          "keys (add --deployment and its file)"))
        << words.front();
  }
}

TEST_F(SecuredDeployment, KeysOfAnotherCaNeitherReceiveNorSend) {
  const std::string file = secured("files"), foreign = secured("foreign"),
                    recording = folder_ / "recorded.mcap";
  start(file, {"--record", recording});
  for (const auto& words :
       {std::vector<std::string>{"top", "--once"}, {"ls"}, {"simulation", "pause"}}) {
    const auto [code, said] = result_of(words, foreign);
    EXPECT_EQ(code, 3) << words.front() << ": " << said;
    EXPECT_THAT(said, HasSubstr("they are of another CA, of the other protection"))
        << words.front();
  }
  const auto [code, said] =
      result_of({"record", "-o", folder_ / "none.mcap", "--duration", "2"}, foreign);
  EXPECT_EQ(code, 1) << said;
  ended_by(SIGINT);
  // The foreign replay sends the same messages again to a deployment of this name.
  start(file);
  EXPECT_EQ(result_of({"replay", recording, "--no-wait", "--end", "1"}, foreign).first, 0);
  const auto report = ended_by(SIGINT);
  EXPECT_TRUE(report["refused_from"].empty()) << report["refused_from"];
  EXPECT_EQ(report["duplicate_nodes"], nlohmann::json::array());
  EXPECT_GT(report["frames"]["composited"].get<int>(), 20);
}

// A peer of the other protection is refused, too.
TEST_F(SecuredDeployment, SignedAndEncryptedKeysDoNotWorkTogether) {
  const std::string file = secured("files", Protection::encrypt);
  start(file);
  make_small_keys(folder_ / "files/keys", domain_, Protection::sign);
  const auto [code, said] = result_of({"top", "--once"}, file);
  EXPECT_EQ(code, 3) << said;
  EXPECT_THAT(said, HasSubstr("the keys of one process sign, those of the other encrypt"));
}

TEST_F(SecuredDeployment, ACaptureRoleMayNotPublishCommands) {
  const std::uint32_t domain =
      own_second_domain();  // the plain bus of the test is in the other one
  make_small_keys(folder_ / "keys", domain);
  bus::Network network;
  network.security = security::Credentials{
      files_of(folder_ / "keys", Role::capture), "`fivepipe keys lab.yaml`", {}, 0};
  bus::Bus bus({.domain = domain, .network = network, .deployment = "small"});
  EXPECT_NO_THROW(bus.writer<bus::topics::ObjectPixelMap>());
  EXPECT_NO_THROW(bus.reader<bus::topics::TileCosts>());
  const auto problem_of = [](const auto& make) {
    try {
      make();
    } catch (const bus::BusError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(problem_of([&] { bus.writer<bus::topics::Command>(); }),
              AllOf(HasSubstr("role capture may not have a writer of fivepipe/v1/Command"),
                    HasSubstr("`fivepipe keys lab.yaml`")));
  EXPECT_THAT(problem_of([&] { bus.reader<bus::topics::Command>(); }),
              HasSubstr("role capture may not have a reader of fivepipe/v1/Command"));
  // The role reads this topic, so the topic itself is permitted.
  EXPECT_THAT(problem_of([&] { bus.writer<bus::topics::FrameComposited>(); }),
              HasSubstr("role capture may not have a writer of fivepipe/v1/FrameComposited"));
}

// The documented configuration of a program of one's own. This process, which has an unsecured
// domain, is that program in another one.
TEST_F(SecuredDeployment, AProgramOfYourOwnJoinsByItsConfiguration) {
  const std::uint32_t domain = own_second_domain();
  make_small_keys(folder_ / "files/keys", domain);
  const std::string file = changed_deployment(
      folder_ / "files", "program: render_node}",
      "program: render_node}\ndomain: " + std::to_string(domain) + "\nsecurity: {keys: keys}\n");
  const Program recon(
      {FIVEPIPE_BINARY_DIR "/recon_node", "--deployment", file, "--node", "recon_a"},
      folder_ / "recon.log");
  const std::map<std::string, std::string> environment{
      {"CYCLONEDDS_URI",
       text_of(FIVEPIPE_SOURCE_DIR "/docs/examples/secured_program/secured_program.xml")},
      {"ADDRESS", "127.0.0.1"},
      {"PEER", "127.0.0.1"},
      {"KEYS", folder_ / "files/keys/tracker"},
      {"PLUGINS", fs::path(security::plugin_library("auth")).parent_path()}};
  for (const auto& [name, value] : environment) setenv(name.c_str(), value.c_str(), 1);
  std::optional<bus::Bus> tracker;
  EXPECT_NO_THROW(tracker.emplace(bus::BusOptions{.domain = domain, .deployment = "small"}));
  for (const auto& [name, value] : environment) unsetenv(name.c_str());
  ASSERT_TRUE(tracker);
  auto poses = tracker->writer<bus::topics::HeadPose>();
  EXPECT_TRUE(eventually(*tracker, kStart, [&] { return poses.readers() == 1; })) << recon.said();
  EXPECT_THROW(tracker->writer<bus::topics::Command>(), bus::BusError);
}

// The CA signs a document that does not allow the capture_node to publish poses.
TEST_F(SecuredDeployment, ANodeWithoutThePermissionEndsAndNamesTheTopic) {
  const std::string file = secured("files");
  const fs::path keys = folder_ / "files/keys";
  const keys::Authority authority(keys / "ca/permissions-ca.pem",
                                  keys / "ca/permissions-ca-key.pem");
  keys::RoleTopics topics = keys::topics_of(Role::capture);
  ASSERT_EQ(std::erase(topics.publishes, bus::topics::HeadPose::name), 1u);
  const std::int64_t now_s = std::time(nullptr);
  std::ofstream(files_of(keys, Role::capture).permissions())
      << authority.signed_document(keys::permissions_xml(
             subject_of(Role::capture, "small"), domain_, {now_s - 60, now_s + 3600}, topics));
  const auto capture = node("capture_node", "capture", file);
  EXPECT_EQ(capture->wait_for_end(kCommandTime), 1) << capture->said();
  EXPECT_THAT(capture->said(),
              AllOf(HasSubstr("role capture may not have a writer of fivepipe/v1/HeadPose"),
                    HasSubstr("`fivepipe keys " + file + "`")));
}

TEST_F(SecuredDeployment, ExpiredKeysAreNamedWithTheCommandThatRenewsThem) {
  const std::string file = secured("files", Protection::encrypt, 400);
  for (const auto& words : {std::vector<std::string>{"top", "--once"}, {"simulation", "pause"}}) {
    const auto [code, said] = result_of(words, file);
    EXPECT_EQ(code, 2) << said;
    EXPECT_THAT(said, AllOf(HasSubstr("identity.pem: expired at 2"),
                            HasSubstr("`fivepipe keys " + file + "` makes the keys")));
  }
  Deployed deployed(file, domain_, out_);
  EXPECT_EQ(deployed.wait_for_end(kCommandTime), 2) << deployed.said();
  EXPECT_THAT(deployed.said(), HasSubstr("role supervisor cannot join"));
  const auto [code, doctor] = result_of({"doctor"}, file);
  EXPECT_EQ(code, 3);
  EXPECT_THAT(doctor, HasSubstr("FAIL  security: role sim: "));
  // Renewed by the command.
  const auto keys = std::make_unique<Program>(
      std::vector<std::string>{std::string(FIVEPIPE_BINARY_DIR) + "/fivepipe", "keys", file},
      folder_ / "keys.log");
  EXPECT_EQ(keys->wait_for_end(kCommandTime), 0) << keys->said();
  EXPECT_THAT(keys->said(), HasSubstr("kept the CA"));
  EXPECT_EQ(result_of({"top", "--once"}, file).first, 3) << "no node runs";
}

// DDS deletes a participant whose certificate expires.
TEST_F(SecuredDeployment, ADeploymentEndsCleanlyBeforeItsKeysExpire) {
  constexpr int kLife_s = 15 + 15 * kSlowdown;
  const std::string file = secured_for(kLife_s);
  deployed_.emplace(file, domain_, out_);
  EXPECT_EQ(deployed_->wait_for_end(std::chrono::seconds(kLife_s)), 2) << deployed_->said();
  EXPECT_THAT(deployed_->said(),
              AllOf(HasSubstr("keys/supervisor expire within 15 s: this process ends. `fivepipe "
                              "keys " +
                              file + "` makes new ones"),
                    HasSubstr("keys/capture/identity.pem expires at")));
  const auto report = nlohmann::json::parse(std::ifstream(out_ / "report.json"));
  EXPECT_GT(report["frames"]["composited"].get<int>(), 20);
}

TEST_F(SecuredDeployment, ANodeEndsBeforeItsKeysExpireAndDoesNotStartAgain) {
  constexpr int kLife_s = 8 + 3 * kSlowdown;
  const std::string file = secured_for(kLife_s);
  const auto first = node("sim_node", "simulation", file);
  EXPECT_EQ(first->wait_for_end(kCommandTime), 2) << first->said();
  EXPECT_THAT(first->said(), HasSubstr("keys/sim expire within 8 s: this process ends"));
  const auto second = node("sim_node", "simulation", file);
  EXPECT_EQ(second->wait_for_end(kCommandTime), 2) << second->said();
  EXPECT_THAT(second->said(), HasSubstr("too soon to start"));
}

TEST_F(SecuredDeployment, ARoleWithoutItsFolderIsRefusedWithTheCommand) {
  const std::string file = secured("files");
  fs::remove_all(folder_ / "files/keys/observer");
  const auto [code, said] = result_of({"top", "--once"}, file);
  EXPECT_EQ(code, 2) << said;
  EXPECT_THAT(said, AllOf(HasSubstr("deployment.yaml:"), HasSubstr("role observer cannot join"),
                          HasSubstr("keys/observer/ca.pem: there is no such file"),
                          HasSubstr("`fivepipe keys " + file + "`")));
}

TEST_F(SecuredDeployment, DoctorListsTheRolesOfThisMachineAndTheirExpiry) {
  const std::string file = secured("files", Protection::sign, 340);
  for (const Role role : {Role::observer, Role::tracker})
    fs::remove_all(files_of(folder_ / "files/keys", role).folder);
  fs::permissions(files_of(folder_ / "files/keys", Role::sim).key(), fs::perms(0644));
  const auto [code, said] = result_of({"doctor"}, file);
  EXPECT_EQ(code, 0) << said;
  EXPECT_THAT(said, AllOf(HasSubstr("warn  security: role recon: signed, valid until 2"),
                          HasSubstr(", in 2"), HasSubstr("other users can read"),
                          HasSubstr("DDS: participant in domain")));
  EXPECT_THAT(said, testing::Not(HasSubstr("role tracker")));
  // Without these roles, `fivepipe up` cannot start.
  for (const Role role : {Role::capture, Role::supervisor})
    fs::remove_all(files_of(folder_ / "files/keys", role).folder);
  const auto [incomplete_code, incomplete] = result_of({"doctor"}, file);
  EXPECT_EQ(incomplete_code, 3) << incomplete;
  EXPECT_THAT(incomplete, AllOf(HasSubstr("FAIL  security: role capture: no keys in "),
                                HasSubstr("but node capture of this machine needs them"),
                                HasSubstr("FAIL  security: role supervisor: no keys in ")));
}

TEST_F(SecuredDeployment, LocalRunsWithoutSecurity) {
  const std::string file = secured("files");
  fs::remove_all(folder_ / "files/keys");
  auto frames = bus_.reader<bus::topics::FrameComposited>();
  deployed_.emplace(file, domain_, out_, std::vector<std::string>{"--local"});
  std::size_t composited = 0;
  EXPECT_TRUE(eventually(bus_, kStart, [&] {
    composited += frames.take().size();
    return composited > 10;
  })) << deployed_->said();
  EXPECT_THAT(deployed_->said(), HasSubstr("--local: the nodes use the loopback interface, "
                                           "without security"));
}

TEST_F(SecuredDeployment, KeysNeedADeploymentWithSecurity) {
  Program keys({std::string(FIVEPIPE_BINARY_DIR) + "/fivepipe", "keys", kSmallDeployment},
               folder_ / "keys.log");
  EXPECT_EQ(keys.wait_for_end(kCommandTime), 2);
  EXPECT_THAT(keys.said(), HasSubstr("security: {keys: keys}"));
}

}  // namespace
}  // namespace fivepipe::test
