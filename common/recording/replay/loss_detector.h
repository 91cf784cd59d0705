// What nodes say they sent against what came here: how a recorder finds out that it missed
// something. Pure.
#pragma once
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace fivepipe::replay {

// Stamps: CLOCK_REALTIME [ns].
struct SentStatus {
  std::string node;
  std::int64_t start_stamp_ns;                // of the process: tells it from one before it
  std::int64_t source_stamp_ns;               // when the status was written
  std::map<std::string, std::uint64_t> sent;  // messages since the start, by topic
  bool final_report = false;
};

// One topic of a node, all its processes together, from where they could be compared.
struct SentByNode {
  std::string node, topic;
  std::uint64_t sent = 0, received = 0;
  std::uint64_t missing() const { return sent > received ? sent - received : 0; }
};

// A process that started later than the tally is compared from its start. One that ran before is
// compared from its second status on, when all readers know it, by its messages' source stamps:
// what was on its way does not disturb.
class LossDetector {
 public:
  explicit LossDetector(std::int64_t start_stamp_ns) : start_stamp_ns_(start_stamp_ns) {}

  void received(const std::string& node, const std::string& topic, std::int64_t source_stamp_ns);
  // Statuses older than the tally are a replay's, of what others sent once: not regarded.
  void add_status(const SentStatus& status);

  // A node's count is as old as its last status: it never tells too much.
  std::vector<SentByNode> compared() const;
  // Something came from these, but they told nothing to compare it with, or only once, or nothing
  // of late, though none of them ended in order.
  std::set<std::string> unverified_nodes(std::int64_t now_ns) const;

 private:
  struct Process {
    std::map<std::string, std::uint64_t> sent_before, sent;
  };
  struct Node {
    SentStatus newest;
    bool compares = false;  // `received` stands against what its processes sent
    std::int64_t from_ns = std::numeric_limits<std::int64_t>::min();  // counts what was sent later
    std::map<std::int64_t, Process> processes;                        // by their start
    std::map<std::string, std::uint64_t> received;
    std::map<std::string, std::vector<std::int64_t>>
        stamps;  // between its first and its second status, where it ran before
  };
  static void begin(Node& node, std::int64_t from_ns);

  std::int64_t start_stamp_ns_;
  std::map<std::string, Node> nodes_;
};

}  // namespace fivepipe::replay
