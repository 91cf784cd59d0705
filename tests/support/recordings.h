// Recordings made and replayed by the real programs, for tests.
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

namespace fivepipe::test {

using Payload = std::vector<std::byte>;
using Stamped = std::pair<std::int64_t, Payload>;  // source stamp and message

// Processes that compile shaders, on a busy machine.
inline constexpr std::chrono::seconds kStart{60};

// A domain, a folder and a bus of its own; programs in that domain.
class RecordingTest : public testing::Test {
 protected:
  RecordingTest();
  ~RecordingTest() override;

  std::uint32_t domain_;
  std::filesystem::path folder_;
  bus::Bus bus_;

  // The deployment runs for so long from its first composited frame on, and is recorded from its
  // start.
  std::filesystem::path recorded(double duration_s,
                                 const std::string& deployment = kSmallDeployment,
                                 const std::vector<std::string>& options = {});
  // `fivepipe WORDS..` in this test's domain. Its output is in the file NAME.log.
  std::unique_ptr<Program> fivepipe(const std::string& name, std::vector<std::string> words,
                                    bool typed_to = false);
  // One node alone.
  std::unique_ptr<Program> node(const std::string& program, const std::string& name,
                                const std::string& deployment = kSmallDeployment);
  // A recorder that already listens.
  std::unique_ptr<Program> recorder(const std::filesystem::path& file,
                                    const std::vector<std::string>& options = {});
  // Somebody of that name writes, or reads, these topics.
  bool takes_part(const std::string& participant, bool writes, const std::set<std::string>& topics);

 private:
  int programs_ = 0;
};

// What one writer of a topic wrote, in the order of source stamps.
using WrittenByOne = std::vector<Stamped>;
// By topic: every writer's, in an order that does not depend on who was found first.
std::map<std::string, std::vector<WrittenByOne>> messages_by_writer(
    const recording::Recording& recording);
// The last that is told of each key: disposed, unregistered. By topic and key.
std::map<std::pair<std::string, Payload>, recording::KeyChange> last_key_changes(
    const recording::Recording& recording);
// Each node's last status, which must be its final one; and how many messages of each topic these
// say were sent, statuses apart.
std::map<std::string, nlohmann::ordered_json> final_statuses(const recording::Recording& recording);
std::map<std::string, std::uint64_t> sent_by_topic(
    const std::map<std::string, nlohmann::ordered_json>& statuses);
std::map<std::string, std::uint64_t> counts_by_topic(const recording::Recording& recording);

// Takes all that is written of these topics, from now on.
// What running nodes write.
class Outputs {
 public:
  Outputs(bus::Bus& bus, const std::vector<std::string>& topics);
  void take();
  // Each topic has so many writers.
  bool has_writers(int count) const;
  std::uint64_t taken() const;
  // By topic, in an order that does not depend on when they came.
  std::map<std::string, std::vector<Payload>> sorted() const;

 private:
  std::map<std::string, std::unique_ptr<bus::SerializedReader>> readers_;
  std::map<std::string, std::vector<Payload>> payloads_;
};

}  // namespace fivepipe::test
