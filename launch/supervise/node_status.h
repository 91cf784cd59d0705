// The newest NodeStatus of each process, without DDS types.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

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
};

struct CollisionTotals {
  std::uint64_t frames = 0;  // in which the object collided
  std::uint64_t points = 0;  // collision points in these frames
  std::uint64_t first_contacts = 0;
};

// One process of a node. All counts are totals since the start of the process.
struct ProcessStatus {
  std::string node;
  std::uint64_t writer = 0;  // publication handle; distinguishes processes of one node
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

// Keeps the newest status of each process.
class StatusRegistry {
 public:
  void add(ProcessStatus status, std::int64_t arrived_stamp_ns);
  // Call when the node has no writer any more: its processes have ended.
  void writer_gone(const std::string& node);

  // The newest status of each process, by node; each node's processes by start.
  std::map<std::string, std::vector<ProcessStatus>> processes() const;
  // Nodes that two processes publish at the same time: the older process still publishes 1.5 s
  // after the first status of the newer one.
  std::vector<std::string> duplicates() const;
  // CPU use of the node's newest process between its two newest statuses [% of one core]; 0 before
  // the second status.
  double cpu_percent(const std::string& node) const;
  // Nodes that have not ended and whose newest status arrived at most max_age_ns before now_ns.
  std::vector<std::string> alive(std::int64_t now_ns, std::int64_t max_age_ns) const;

 private:
  struct Entry {
    ProcessStatus newest;
    std::int64_t first_arrived_ns = 0, arrived_ns = 0;
    double cpu_percent = 0;
    bool gone = false;
  };
  const Entry* newest_entry(const std::string& node) const;
  std::map<std::string, std::map<std::uint64_t, Entry>> entries_;  // by node, then writer
};

}  // namespace fivepipe::launch
