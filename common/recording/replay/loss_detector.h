// Compares the send counts of nodes with the messages that were received, to detect losses between
// node and recorder. Independent of DDS.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace fivepipe::replay {

// Stamps are CLOCK_REALTIME.
struct SentStatus {
  std::string node;
  std::int64_t start_stamp_ns;   // start of the process; distinguishes it from its predecessor
  std::int64_t source_stamp_ns;  // when the status was written
  std::map<std::string, std::uint64_t> sent;  // messages since the start, by topic
  bool final_report = false;
};

// One topic of a node, summed over its processes, since the comparison began.
struct SentByNode {
  std::string node, topic;
  std::uint64_t sent = 0, received = 0;
  std::uint64_t missing() const { return sent > received ? sent - received : 0; }
};

// A process that started after the detector is compared from its start. One that ran before is
// compared from its second status on. The recorder's readers match the node's writers one after the
// other; with authentication or on a busy machine some do so after that status. A topic whose first
// received message was sent within 10 s of it is compared from the first status that is at least
// 0.1 s newer than this message; losses before it are not noticed. Messages are assigned to
// statuses by their source stamps, so messages in transit count correctly.
//
// Peers choose the names of their nodes, and their start stamps. The detector ignores further nodes
// (see unverified_nodes()) and further processes of a node, and forgets the oldest stamps.
class LossDetector {
 public:
  static constexpr std::size_t kMaxNodes = 256, kMaxProcesses = 64, kMaxStamps = 1 << 16;
  static constexpr const char* kFurtherNodes = "further nodes";

  explicit LossDetector(std::int64_t start_stamp_ns) : start_stamp_ns_(start_stamp_ns) {}

  void received(const std::string& name, const std::string& topic_name,
                std::int64_t source_stamp_ns);
  // Ignores statuses older than the detector: a replay sends them, with the counts of an earlier
  // run.
  void add_status(const SentStatus& status);

  // A node's count is as old as its last status. Omits a topic that has arrived and waits for the
  // status from which it is compared. A topic whose reader has not matched counts as missing until
  // its first message arrives.
  std::vector<SentByNode> compared() const;
  // Nodes whose messages were received but whose send counts are missing, arrived only once, or are
  // too old although no process of the node exited cleanly. Also nodes with a topic that compared()
  // omits. Contains kFurtherNodes if there were more than kMaxNodes nodes.
  std::set<std::string> unverified_nodes(std::int64_t now_ns) const;

 private:
  struct Process {
    std::map<std::string, std::uint64_t> sent_before, sent;
  };
  struct Topic {
    // Only messages sent at or after this time are counted.
    std::int64_t from_ns = std::numeric_limits<std::int64_t>::min();
    std::uint64_t received = 0;
    std::optional<std::int64_t> first_ns;  // stamp of the message that arrived first
    // For a process that ran before: of messages that arrived while from_ns was not final.
    std::deque<std::int64_t> stamps;
    bool is_compared = false;  // from_ns is final

    void begin(std::int64_t at_ns);
  };
  struct Node {
    SentStatus newest;
    bool compares = false;  // the topics are comparable with the processes' send counts
    std::int64_t from_ns =
        std::numeric_limits<std::int64_t>::min();  // of topics of which no message has arrived
    // Stamp of the second status of a process that ran before, while its topics may match late.
    std::optional<std::int64_t> late_match_since_ns;
    std::map<std::int64_t, Process> processes;  // by their start
    std::map<std::string, Topic> topics;

    // Returns true if a message has arrived, but not the status from which the topic is compared.
    bool awaits_status(const Topic& topic) const;
  };
  Node* node_of(const std::string& name);  // nullptr: one too many
  static void begin(Node& node, std::int64_t from_ns);
  // Which topics that are not compared yet begin: those that have arrived, or all, because another
  // process replaces the one that ran before.
  enum class LateTopics { arrived, all };
  void begin_late_topics(Node& node, std::int64_t from_ns, LateTopics which);
  static void end_late_matches(Node& node);

  std::int64_t start_stamp_ns_;
  std::map<std::string, Node> nodes_;
  bool ignores_nodes_ = false;
};

}  // namespace fivepipe::replay
