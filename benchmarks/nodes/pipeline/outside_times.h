// Checks the account of the nodes (pipeline_breakdown.h) against times taken outside them: the
// datagrams of the frame's messages on the loopback interface, by the clock of the kernel. Pure.
//
// The wire shows when a node writes, not when it begins to read or compute. A node is therefore
// taken to begin when its last input is sent and its last message of the previous frame has been,
// and one outside stage covers the bus to a node, its reading and its computation.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "benchmarks/nodes/pipeline/pipeline_breakdown.h"
#include "benchmarks/nodes/wire/message_times.h"

namespace fivepipe::node_bench {

// Returns the stages of each frame whose messages are all known, through the reconstruction node
// whose last tile was sent last. `max_in_flight` is the setting of capture_node. A frame whose
// number follows that of the frame before has no stage `capture`, because capture_node may have
// waited for the frame's time.
std::map<std::uint64_t, FrameStages> outside_stages(
    const std::map<std::uint64_t, wire::FrameMessages>& messages, const PipelineNodes& nodes,
    int max_in_flight);

// One stage of the outside times, and the sum of the stages of the account that it covers.
struct StageAgreement {
  std::string stage;
  std::vector<double> own_ms, outside_ms;  // one per frame
  // The means over the frames without the kOmittedFraction with the largest and with the smallest
  // difference. On two busy cores the kernel interrupts a node in a tenth of the frames between its
  // last datagram and its next reading of the clock, for 1 to 4 ms; such frames would decide the
  // mean, and say nothing about the account.
  struct Means {
    double own_ms = 0, outside_ms = 0;
  };
  Means means_ms() const;
  // Quantile of the difference, outside minus own, over all frames: 0 to 1.
  double difference_ms(double quantile) const;
  // The larger of a time and kMaxDifferenceFraction of the outside mean: of the difference of the
  // means, and of its quantiles kTail and 1 - kTail over all frames.
  double limit_ms() const;
  double tail_limit_ms() const;
  bool agrees() const;  // within both limits
};
inline constexpr double kOmittedFraction = 0.25;  // the interquartile mean
inline constexpr double kMaxDifference_ms = 0.3, kMaxDifferenceFraction = 0.05;
// Of the frames in which the kernel interrupts a node, most are interrupted once, for less than
// this: the largest p95 of a stage on two busy cores is 1.9 ms (paper_files.json, `capture`).
inline constexpr double kTail = 0.05, kMaxTail_ms = 3;

// Compares the frames that both have. Omits the stage `capture` if fewer than a tenth have it. The
// last element is the sum of the stages of each frame. Empty if there is no such frame.
std::vector<StageAgreement> compared(const std::map<std::uint64_t, FrameStages>& own,
                                     const std::map<std::uint64_t, FrameStages>& outside);
// Appends the frames of another run.
void append(std::vector<StageAgreement>& to, const std::vector<StageAgreement>& other);

}  // namespace fivepipe::node_bench
