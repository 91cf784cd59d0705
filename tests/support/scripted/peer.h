// Plays the peers of one real node: publishes crafted messages and reads what the node publishes.
#pragma once
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/pipeline/messages/wire_conversions.h"
#include "tests/support/recording/recordings.h"

namespace fivepipe::test {

// What a node reports about itself.
struct NodeReport {
  struct Latency {
    double p50_ms = 0, max_ms = 0;
    std::uint64_t count = 0;
  };
  struct Collisions {
    std::uint64_t frames = 0, points = 0, first_contacts = 0;
    bool operator==(const Collisions&) const = default;
  };
  bool has_handled_frame = false, is_final = false;
  std::uint64_t frame = 0;
  std::string gl_renderer;
  std::map<std::string, std::uint64_t> counts, sent, empty_cameras;
  std::map<std::string, std::uint64_t> drops;  // by "reason: subject: detail"
  std::map<std::string, Latency> latencies;
  std::map<std::string, Collisions> collisions;
  std::map<std::string, std::string> diagnostics;
};

// The times of one frame in a node, as its FrameTrace states them.
struct TracedFrame {
  struct Step {
    std::string name;
    std::int64_t start_ns, end_ns;
  };
  std::string node;
  std::uint64_t frame;
  std::int64_t capture_stamp_ns, first_input_ns, last_input_ns;
  std::vector<Step> steps;
};

// Collects the samples of a topic. The loan of a sample ends with take(), so `copy` makes a value
// of each.
template <class Topic, class Value>
class Collected {
 public:
  using Copy = Value (*)(const bus::Sample<Topic>&);
  Collected(bus::Bus& bus, Copy copy) : reader_(bus.reader<Topic>()), copy_(copy) {}

  const std::vector<Value>& take() {
    for (const auto& sample : reader_.take())
      if (sample.valid()) all_.push_back(copy_(sample));
    return all_;
  }
  const std::vector<Value>& all() const { return all_; }
  int writers() const { return reader_.writers(); }

 private:
  bus::Reader<Topic> reader_;
  Copy copy_;
  std::vector<Value> all_;
};

// The name of the deployments of these tests: a node accepts the messages of its own one.
inline const std::string kScriptedDeployment = "scripted";

class ScriptedPeer : public RecordingTest {
 protected:
  // Maximum time for a node to answer on a busy machine.
  static constexpr std::chrono::seconds kAnswer{10};

  ScriptedPeer();

  // Writes `text` to a file in the test's folder and returns its path.
  std::string file(const std::string& name, const std::string& text) const;

  // Starts the node with --out out_ and `more`, and waits until it reads and writes its topics and
  // has found the readers of this test. Create these before.
  void start(const std::string& program, const std::string& name, const std::string& deployment,
             const std::vector<std::string>& more = {});

  // Writes the message and waits until every reader has it.
  template <class Topic>
  void deliver(bus::Writer<Topic>& writer, const typename Topic::Message& message) {
    writer.write(message);
    EXPECT_TRUE(writer.wait_for_delivery(kAnswer)) << Topic::name;
  }
  // Stops the node's main thread during send(), as if the node were busy: DDS receives all messages
  // of send(), and the node finds them at once.
  void at_once(const std::function<void()>& send);
  // Waits until every writer has at least one reader, the node under test.
  template <class... Topic>
  void wait_for_readers(const bus::Writer<Topic>&... writers) {
    EXPECT_TRUE(holds([&] { return ((writers.readers() > 0) && ...); })) << said();
  }
  // Waits until the condition holds. Returns false after kAnswer, or if the node has failed.
  bool holds(const std::function<bool()>& condition);
  // Announces a replay, which stays in force until end_replay(). Waits until the node has discarded
  // its state, except in at_once().
  void begin_replay(bool lossless);
  void end_replay();

  // The newest status of the node. Each process publishes one every half second.
  const NodeReport& report();
  // Waits until the node has published `count` further statuses.
  bool reports_again(int count = 1);
  const std::vector<TracedFrame>& traces() { return traces_.take(); }
  // Expects that the node uses hardly any CPU time between two of its statuses.
  void expect_sleep();
  // Sends SIGTERM and waits for the exit code 0. Returns the final report.
  NodeReport ended();
  // Waits until the node has ended by itself.
  std::optional<int> wait_for_end() { return program_->wait_for_end(kAnswer); }
  std::string said() const { return program_ ? program_->said() : ""; }

  std::filesystem::path out_;
  std::unique_ptr<Program> program_;

 private:
  bool is_stopped_ = false;  // the main thread of the node, in at_once()
  bool has_failed();         // whether the node has ended with another code than 0

  std::string name_;
  std::optional<bus::Reader<bus::topics::NodeStatus>> statuses_;
  Collected<bus::topics::FrameTrace, TracedFrame> traces_;
  std::optional<bus::Writer<bus::topics::ReplaySession>> sessions_;
  NodeReport report_;
  std::uint64_t reports_ = 0;
};

// Returns the sum of the drops with this reason, over all subjects and details.
std::uint64_t drops_of(const NodeReport& report, const std::string& reason);

}  // namespace fivepipe::test
