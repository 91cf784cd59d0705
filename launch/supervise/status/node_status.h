// The newest NodeStatus of each process, without DDS types.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/pipeline/bus/process_id.h"

namespace fivepipe::launch {

struct Latency {
  double p50_ms = 0, p95_ms = 0, p99_ms = 0, max_ms = 0;
  std::uint64_t count = 0;
};

// Messages of one topic that a process wrote or, as a recorder, received.
struct TopicTotals {
  std::uint64_t sent = 0;
  std::uint64_t not_sent = 0;  // dropped after 100 ms of waiting for a reader
  std::uint64_t received = 0;
  std::uint64_t recorded = 0;
  std::uint64_t lost = 0;  // received and not recorded
  TopicTotals& operator+=(const TopicTotals& other);
};

struct CollisionTotals {
  std::uint64_t frames = 0;  // in which the object collided
  std::uint64_t points = 0;  // collision points in these frames
  std::uint64_t first_contacts = 0;
  CollisionTotals& operator+=(const CollisionTotals& other);
};

// A peer can send lists of any length: this many entries of each are used. Of several processes,
// the totals of further entries count together as "other".
inline constexpr std::size_t kMaxStatusEntries = 256;

// One process of a node. All counts are totals since the start of the process.
struct ProcessStatus {
  std::string node;
  std::optional<bus::ProcessId> process;  // nullopt: its participant states no identity
  std::string version;
  std::int64_t start_stamp_ns = 0;  // CLOCK_REALTIME
  bool has_handled_frame = false;   // the node started and works
  bool final_report = false;        // the last status of a process that exited cleanly
  std::uint64_t frame = 0;
  double frame_rate_hz = 0;
  double cpu_s = 0, memory_mb = 0;
  std::string gl_renderer;  // empty: the process uses no OpenGL
  std::map<std::string, std::uint64_t> counts;
  std::map<std::string, std::uint64_t> drops;  // by text_of(BadMessage)
  std::map<std::string, TopicTotals> topics;
  std::map<std::string, std::uint64_t> empty_cameras;  // frame sets by camera
  std::map<std::string, CollisionTotals> collisions;   // by object
  std::map<std::string, Latency> latencies;
  std::vector<std::string> diagnostics;  // "subject: text"
};

// Processes that publish as the same node at the same time.
struct DuplicateNode {
  std::string node;
  std::vector<std::string> processes;  // "process 4711 on host alpha"
};

struct NodeActivity {
  bool ended = false;   // the newest process sent its final report
  double silent_s = 0;  // time since the newest status
};

// A node publishes twice per second; one that is silent for longer hangs, died, or is out of reach.
inline constexpr double kMaxSilence_s = 2;

// Keeps the newest status of each process. Two statuses of a node are of one process if they have
// the same start stamp and the same identity; a status without identity, as from an older version,
// is distinguished by its start stamp alone. Arrival stamps are of any steady clock.
class StatusRegistry {
 public:
  // A peer can publish as any node and with any start stamp. A further node displaces the one with
  // the oldest status that ended or is silent for longer than kMaxSilence_s; the registry ignores
  // it if there is none, or if its process, which may replay a deployment, already publishes
  // kMaxNodesOfProcess nodes. Of a node that has more than kMaxProcesses, it drops the process that
  // is silent longest and adds its counts to those of the one that appeared next, or before if it
  // is the last.
  static constexpr std::size_t kMaxNodes = 256, kMaxNodesOfProcess = 64, kMaxProcesses = 8;

  void add(ProcessStatus status, std::int64_t arrived_ns);
  // Counts a status that the caller cannot add.
  void ignore() { ++ignored_; }
  // Number of statuses that add() or the caller ignored.
  std::uint64_t ignored() const { return ignored_; }

  // The newest status of each process, by node; each node's processes in the order in which their
  // first statuses arrived, but newest() last.
  std::map<std::string, std::vector<ProcessStatus>> processes() const;
  // The newest status of the node's newest process: the one that appeared last, unless others go on
  // while it is silent for 1.5 s. No clock of a process takes part: clocks of hosts differ, and a
  // clock may be set back between two starts. nullptr: none. Valid until the next add().
  const ProcessStatus* newest(const std::string& node) const;
  // Nodes of which a process still publishes 1.5 s after the first status of the one that appeared
  // last. Of the earlier ones, not those that sent their final report.
  std::vector<DuplicateNode> duplicates() const;
  // CPU use of the node's newest process between its two newest statuses [% of one core]; 0 before
  // the second status.
  double cpu_percent(const std::string& node) const;
  // Returns nullopt if no status of the node has arrived.
  std::optional<NodeActivity> activity(const std::string& node, std::int64_t now_ns) const;

 private:
  struct Entry {
    ProcessStatus newest;
    std::int64_t first_arrived_ns = 0, arrived_ns = 0;
    double cpu_percent = 0;
  };
  Entry& entry_of(std::vector<Entry>& processes, const ProcessStatus& status,
                  std::int64_t arrived_ns);
  bool make_space_for_node_of(const std::optional<bus::ProcessId>& process,
                              std::int64_t arrived_ns);
  static std::size_t newest_of(const std::vector<Entry>& processes);
  const Entry* newest_entry(const std::string& node) const;
  std::map<std::string, std::vector<Entry>> entries_;  // by node; by first_arrived_ns
  std::uint64_t ignored_ = 0;
};

}  // namespace fivepipe::launch
