// What the launcher knows of the nodes from the statuses they published, without DDS types.
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

// One process of a node. Counts grow from the start of the process.
struct ProcessStatus {
  std::string node;
  std::uint64_t writer = 0;  // publication handle: tells processes of one node apart
  std::string version;
  std::int64_t start_stamp_ns = 0;  // CLOCK_REALTIME
  bool has_handled_frame = false;   // it could start, and works
  bool final_report =
      false;  // the process ended in order; otherwise this is the last status before it died
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

// The newest status of every process heard of.
class StatusRegistry {
 public:
  void add(ProcessStatus status, std::int64_t arrived_stamp_ns);
  // No writer of this node is left: what it published last stands for a dead process.
  void writer_gone(const std::string& node);

  // By node, each node's processes in the order they started.
  std::map<std::string, std::vector<ProcessStatus>> processes() const;
  // Nodes of which two processes publish at the same time, for longer than it takes to notice that
  // one of them died.
  std::vector<std::string> duplicates() const;
  // CPU in use by the newest process of a node between its two newest statuses [% of one core]; 0
  // before the second one.
  double cpu_percent(const std::string& node) const;
  // Nodes whose newest status is younger than max_age_ns at this time.
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
