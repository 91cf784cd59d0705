// Feeds single nodes from a lossless replay and collects their output.
#pragma once
#include <csignal>
#include <string_view>

#include "common/base/realtime.h"
#include "common/pipeline/messages/bad_message.h"
#include "tests/support/recording/recordings.h"

namespace fivepipe::test {

struct NodeUnderTest {
  std::string program, name;
};

struct ReplayRun {
  std::map<std::string, std::vector<Payload>> outputs;  // Outputs::sorted
  // From each node's final report, by node: counts by name, drops by text, sent messages by topic.
  std::map<std::string, std::map<std::string, std::uint64_t>> counts, drops, sent;
  std::string said;  // by the replay
};

class ReplayedNodesTest : public RecordingTest {
 protected:
  // Starts the nodes, replays their inputs `rounds` times and ends the nodes. The test fails if a
  // message or a frame is missing.
  ReplayRun replayed(const std::filesystem::path& recording,
                     const std::vector<NodeUnderTest>& nodes,
                     const std::vector<std::string>& outputs_of,
                     const std::vector<std::string>& options,
                     const std::string& deployment = kSmallDeployment, int rounds = 1) {
    using namespace std::chrono_literals;
    ReplayRun run;
    const std::int64_t start_ns = base::now_realtime_ns();
    Outputs outputs(bus_, outputs_of);
    std::vector<std::unique_ptr<Program>> programs;
    std::vector<std::string> words = {"replay", recording.string(), "--lossless"};
    for (const NodeUnderTest& under_test : nodes) {
      programs.push_back(node(under_test.program, under_test.name, deployment));
      words.insert(words.end(), {"--inputs-of", under_test.name});
    }
    words.insert(words.end(), options.begin(), options.end());
    EXPECT_TRUE(eventually(bus_, kStart, [&] { return outputs.has_writers(int(nodes.size())); }))
        << programs[0]->said();
    for (int round = 0; round < rounds; ++round) {
      const auto replay = fivepipe("replay", words);
      EXPECT_TRUE(eventually(bus_, kStart, [&] {
        outputs.take();
        return replay->wait_for_end(0ms).has_value();
      }));
      run.said = replay->said();
      EXPECT_EQ(replay->wait_for_end(0ms), 0) << run.said;
    }
    for (const auto& program : programs) program->signal(SIGTERM);
    EXPECT_TRUE(eventually(bus_, 10s,
                           [&] {
                             outputs.take();
                             take_final_reports(run, start_ns);
                             return run.counts.size() == nodes.size() &&
                                    outputs.taken() >= sent(run, outputs_of);
                           }))
        << outputs.taken() << " of " << sent(run, outputs_of) << " came";
    EXPECT_EQ(outputs.taken(), sent(run, outputs_of));
    for (const auto& program : programs)
      EXPECT_EQ(program->wait_for_end(10s), 0) << program->said();
    run.outputs = outputs.sorted();
    return run;
  }

 private:
  // Reads the final statuses of the processes that started after start_ns. Skips older ones, which
  // the replay sends from the recording.
  void take_final_reports(ReplayRun& run, std::int64_t start_ns) {
    for (const auto& sample : statuses_.take()) {
      if (!sample.valid() || !sample->final_report || sample->start_stamp_ns < start_ns) continue;
      auto& counts = run.counts[sample->node];
      for (std::uint32_t i = 0; i < sample->counts._length; ++i)
        counts[sample->counts._buffer[i].name] = sample->counts._buffer[i].count;
      for (std::uint32_t i = 0; i < sample->drops._length; ++i)
        run.drops[sample->node][text_of(sample->drops._buffer[i])] = sample->drops._buffer[i].count;
      for (std::uint32_t i = 0; i < sample->topics._length; ++i)
        take_topic(run, sample->node, sample->topics._buffer[i]);
    }
  }
  static void take_topic(ReplayRun& run, const std::string& node,
                         const fivepipe_v1_TopicCounts& topic) {
    run.sent[node][topic.topic] = topic.sent;
    if (topic.not_sent > 0)
      run.drops[node]["not_sent: " + std::string(topic.topic)] = topic.not_sent;
  }
  static std::string text_of(const fivepipe_v1_DropCount& drop) {
    return messages::text_of({drop.reason, drop.subject, drop.detail});
  }
  static std::uint64_t sent(const ReplayRun& run, const std::vector<std::string>& topics) {
    std::uint64_t all = 0;
    for (const auto& [node, sent] : run.sent)
      for (const std::string& topic : topics)
        if (const auto count = sent.find(topic); count != sent.end()) all += count->second;
    return all;
  }

  bus::Reader<bus::topics::NodeStatus> statuses_ = bus_.reader<bus::topics::NodeStatus>();
};

}  // namespace fivepipe::test
