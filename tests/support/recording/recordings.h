// Records and replays with the real programs, for tests.
#pragma once
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/pipeline/bus/serialized.h"
#include "common/recording/files/recording.h"
#include "tests/support/deployments.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"
#include "tests/support/test_folder.h"

namespace fivepipe::test {

using Payload = std::vector<std::byte>;
using Stamped = std::pair<std::int64_t, Payload>;  // source timestamp and message

// Maximum time for five processes to start on a busy machine; two of them compile shaders.
inline constexpr std::chrono::seconds kStart{60};

// Has its own domain, folder and bus, and starts programs in that domain.
class RecordingTest : public testing::Test {
 protected:
  // See BusOptions.
  explicit RecordingTest(bool frequent_heartbeats = false, const std::string& deployment = "");

  std::uint32_t domain_;
  const TestFolder test_folder_;
  const std::filesystem::path folder_ = test_folder_.path;
  bus::Bus bus_;

  // Records the deployment from its start until `duration_s` after its first composited frame.
  // Returns the recording.
  std::filesystem::path recorded(double duration_s,
                                 const std::string& deployment = kSmallDeployment,
                                 const std::vector<std::string>& options = {});
  // Starts `fivepipe WORDS...` in this test's domain with its output in the file NAME.log.
  std::unique_ptr<Program> fivepipe(const std::string& name, std::vector<std::string> words,
                                    bool typed_to = false);
  // Starts one node with --out folder_/out and `options`.
  std::unique_ptr<Program> node(const std::string& program, const std::string& name,
                                const std::string& deployment = kSmallDeployment,
                                const std::vector<std::string>& options = {});
  // Starts a recorder and waits until its readers exist.
  std::unique_ptr<Program> recorder(const std::filesystem::path& file,
                                    const std::vector<std::string>& options = {});
  // Returns whether a participant of this name writes (or reads) all these topics.
  bool takes_part(const std::string& participant, bool writes, const std::set<std::string>& topics);

 private:
  int programs_ = 0;
};

// The messages of one writer of a topic, by source timestamp.
using WrittenByOne = std::vector<Stamped>;
// Returns the messages of each writer, by topic. The order of the writers depends on their messages
// only.
std::map<std::string, std::vector<WrittenByOne>> messages_by_writer(
    const recording::Recording& recording);
// Returns the last state change of each key, by topic and key.
std::map<std::pair<std::string, Payload>, recording::KeyChange> last_key_changes(
    const recording::Recording& recording);
// Returns the last status of each node, by node. Expects that it is the final one.
std::map<std::string, nlohmann::ordered_json> final_statuses(const recording::Recording& recording);
// Returns the numbers of sent messages in these statuses, by topic, without NodeStatus.
std::map<std::string, std::uint64_t> sent_by_topic(
    const std::map<std::string, nlohmann::ordered_json>& statuses);
// Returns the numbers of recorded messages, by topic.
std::map<std::string, std::uint64_t> counts_by_topic(const recording::Recording& recording);
// Returns the number of recorded messages of a topic for each frame number.
std::map<std::uint64_t, std::uint64_t> counts_by_frame(const recording::Recording& recording,
                                                       const std::string& topic);

// Collects all samples of these topics from its construction on.
class Outputs {
 public:
  Outputs(bus::Bus& bus, const std::vector<std::string>& topics);
  void take();
  // Returns whether each topic has `count` writers.
  bool has_writers(int count) const;
  std::uint64_t taken() const;
  // Returns the payloads by topic, sorted, so that the order of arrival does not matter.
  std::map<std::string, std::vector<Payload>> sorted() const;

 private:
  std::map<std::string, std::unique_ptr<bus::SerializedReader>> readers_;
  std::map<std::string, std::vector<Payload>> payloads_;
};

}  // namespace fivepipe::test
