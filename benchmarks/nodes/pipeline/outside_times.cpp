#include "benchmarks/nodes/pipeline/outside_times.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/base/timing.h"
#include "common/pipeline/bus/topics.h"

namespace fivepipe::node_bench {
namespace {

using namespace bus::topics;

// A message sent this long ago has arrived, also on a busy machine.
constexpr std::int64_t kArrived_ns = 5'000'000;

// A capture_node that waits for the clock or for composites begins few frames at once, if it wakes
// late. Such frames are no sample.
constexpr double kMinCaptureFraction = 0.1;

// What the wire shows of one frame [ns].
struct OutsideFrame {
  std::uint64_t frame = 0;
  std::int64_t first_input_ns = 0;               // see is_input()
  std::int64_t captured_ns = 0;                  // FrameTrace, the last message of capture_node
  std::string slowest;                           // its tiles were sent last
  std::int64_t maps_ns = 0;                      // the last map for that node
  std::map<std::string, wire::SendTimes> tiles;  // by node, with TileCosts
  std::int64_t state_ns = 0;                     // 0: no simulation
  std::int64_t composited_ns = 0;
};

void extend(wire::SendTimes& times, const wire::SendTimes& other) {
  times.first_ns = times.first_ns ? std::min(times.first_ns, other.first_ns) : other.first_ns;
  times.last_ns = std::max(times.last_ns, other.last_ns);
}

bool is_input(const std::string& topic) {
  return topic == HeadPose::name || topic == ObjectColour::name || topic == ObjectCoverage::name ||
         topic == ObjectPixelMap::name;
}

// The tiles and their costs, by reconstruction node.
std::map<std::string, wire::SendTimes> tiles_of(const wire::FrameMessages& messages) {
  std::map<std::string, wire::SendTimes> tiles;
  for (const auto& [route, times] : messages)
    if (route.topic == HullTile::name || route.topic == TileCosts::name)
      extend(tiles[route.writer], times);
  return tiles;
}

std::optional<OutsideFrame> outside_frame(std::uint64_t number, const wire::FrameMessages& messages,
                                          const PipelineNodes& nodes) {
  OutsideFrame frame;
  frame.frame = number;
  frame.tiles = tiles_of(messages);
  for (const auto& [node, times] : frame.tiles)
    if (frame.slowest.empty() || times.last_ns > frame.tiles.at(frame.slowest).last_ns)
      frame.slowest = node;
  wire::SendTimes inputs;
  for (const auto& [route, times] : messages) {
    if (is_input(route.topic)) extend(inputs, times);
    if (route.topic == FrameTrace::name && route.writer == nodes.capture)
      frame.captured_ns = times.last_ns;
    // The path leads through the maps for the slowest node. They may be sent to others later.
    if (route.topic == ObjectPixelMap::name && route.reader == frame.slowest)
      frame.maps_ns = std::max(frame.maps_ns, times.last_ns);
    // Without a new frame, the simulation repeats the state of the last one later.
    if (route.topic == VirtualState::name && route.reader == nodes.rendering)
      frame.state_ns = times.first_ns;
    if (route.topic == FrameComposited::name)
      frame.composited_ns =
          frame.composited_ns ? std::min(frame.composited_ns, times.first_ns) : times.first_ns;
  }
  frame.first_input_ns = inputs.first_ns;
  const bool complete = !frame.slowest.empty() && frame.maps_ns > 0 && frame.composited_ns > 0 &&
                        (nodes.simulation.empty() || frame.state_ns > 0);
  return complete ? std::optional(frame) : std::nullopt;
}

// When capture_node begins the frame after the frames `before`: when it has sent the last of them.
// 0 if it may have waited for the time of the frame, or for the composite of an earlier one, whose
// arrival the wire does not show.
std::int64_t capture_ns(const std::vector<OutsideFrame>& before, std::uint64_t frame,
                        int max_in_flight) {
  if (before.empty() || frame == before.back().frame + 1) return 0;
  const std::int64_t begin_ns = before.back().captured_ns;
  if (max_in_flight <= 0) return begin_ns;
  if (before.size() < std::size_t(max_in_flight)) return 0;
  // The composite of one of the newest max_in_flight frames permits the next one.
  const bool is_free = std::any_of(
      before.end() - max_in_flight, before.end(),
      [&](const OutsideFrame& newest) { return newest.composited_ns + kArrived_ns < begin_ns; });
  return is_free ? begin_ns : 0;
}

FrameStages stages_of(const OutsideFrame& frame, std::int64_t begin_ns,
                      const std::map<std::string, std::int64_t>& free_ns, bool captured) {
  FrameStages stages;
  std::int64_t now_ns = begin_ns ? begin_ns : frame.first_input_ns;
  const auto until = [&](const char* name, std::int64_t end_ns) {
    const std::int64_t end_or_now_ns = std::max(now_ns, end_ns);
    stages.emplace_back(name, 1e-6 * double(end_or_now_ns - now_ns));
    now_ns = end_or_now_ns;
  };
  const auto free_at = [&](const std::string& node) {
    const auto found = free_ns.find(node);
    return found == free_ns.end() ? std::int64_t{0} : found->second;
  };
  const wire::SendTimes& tiles = frame.tiles.at(frame.slowest);
  if (begin_ns) until(stage::kCapture, frame.first_input_ns);
  until(captured ? stage::kPublish : stage::kSend, frame.maps_ns);
  until(stage::kReconBusy, std::min(free_at(frame.slowest), tiles.first_ns));
  until(stage::kReconstruct, tiles.first_ns);
  until(stage::kWriteTiles, tiles.last_ns);
  until(stage::kRenderBusy, std::min(free_at(FrameComposited::name), frame.composited_ns));
  until(stage::kSimulation, std::min(frame.state_ns, frame.composited_ns));
  until(stage::kRender, frame.composited_ns);
  return stages;
}

// The stages of the account that an outside stage covers.
struct Covered {
  const char* outside;
  std::vector<const char*> own;
  std::string name() const {
    std::string text;
    for (const char* stage : own) text += (text.empty() ? "" : " + ") + std::string(stage);
    return text;
  }
};

const std::vector<Covered>& covered() {
  using namespace stage;
  static const std::vector<Covered> stages = {
      {kCapture, {kCapture}},
      {kPublish, {kPublish}},
      {kSend, {kSend}},
      {kReconBusy, {kReconBusy}},
      {kReconstruct, {kReconBus, kReconInputs, kReconstruct}},
      {kWriteTiles, {kWriteTiles}},
      {kRenderBusy, {kRenderBusy}},
      {kSimulation, {kSimulation}},
      {kRender, {kRenderBus, kRenderInputs, kRender}}};
  return stages;
}

std::optional<double> time_of(const FrameStages& stages, const char* name) {
  for (const auto& [stage, time_ms] : stages)
    if (stage == name) return time_ms;
  return std::nullopt;
}

// Keeps the stages in the order of the path.
std::vector<StageAgreement> sorted(std::vector<StageAgreement> stages) {
  const auto place = [](const StageAgreement& stage) {
    return std::find_if(covered().begin(), covered().end(),
                        [&](const Covered& known) { return known.name() == stage.stage; }) -
           covered().begin();
  };
  std::stable_sort(stages.begin(), stages.end(),
                   [&](const auto& a, const auto& b) { return place(a) < place(b); });
  return stages;
}

void add(std::vector<StageAgreement>& to, const std::string& stage, double own_ms,
         double outside_ms) {
  auto known =
      std::find_if(to.begin(), to.end(), [&](const StageAgreement& s) { return s.stage == stage; });
  if (known == to.end()) known = to.insert(to.end(), {stage, {}, {}});
  known->own_ms.push_back(own_ms);
  known->outside_ms.push_back(outside_ms);
}

}  // namespace

std::map<std::uint64_t, FrameStages> outside_stages(
    const std::map<std::uint64_t, wire::FrameMessages>& messages, const PipelineNodes& nodes,
    int max_in_flight) {
  std::map<std::uint64_t, FrameStages> by_frame;
  std::vector<OutsideFrame> before;
  std::map<std::string, std::int64_t> free_ns;  // by reconstruction node, and of the rendering
  for (const auto& [number, of_frame] : messages) {
    const auto frame = outside_frame(number, of_frame, nodes);
    if (!frame) continue;
    const bool captured = !nodes.capture.empty();
    const std::int64_t begin_ns = captured ? capture_ns(before, number, max_in_flight) : 0;
    by_frame[number] = stages_of(*frame, begin_ns, free_ns, captured);
    for (const auto& [node, times] : frame->tiles) free_ns[node] = times.last_ns;
    free_ns[FrameComposited::name] = frame->composited_ns;
    before.push_back(*frame);
  }
  return by_frame;
}

std::vector<StageAgreement> compared(const std::map<std::uint64_t, FrameStages>& own,
                                     const std::map<std::uint64_t, FrameStages>& outside) {
  std::vector<StageAgreement> agreements;
  std::size_t frames = 0, with_capture = 0;
  for (const auto& [frame, stages] : outside) {
    frames += own.contains(frame);
    with_capture += own.contains(frame) && time_of(stages, stage::kCapture);
  }
  const bool knows_capture = double(with_capture) >= kMinCaptureFraction * double(frames);
  for (const auto& [frame, outside_of_frame] : outside) {
    const auto own_of_frame = own.find(frame);
    if (own_of_frame == own.end()) continue;
    double own_sum_ms = 0, outside_sum_ms = 0;
    for (const Covered& stage : covered()) {
      const auto outside_ms = time_of(outside_of_frame, stage.outside);
      if (!outside_ms || (std::string(stage.outside) == stage::kCapture && !knows_capture))
        continue;
      double own_ms = 0;
      for (const char* part : stage.own) own_ms += time_of(own_of_frame->second, part).value_or(0);
      add(agreements, stage.name(), own_ms, *outside_ms);
      own_sum_ms += own_ms;
      outside_sum_ms += *outside_ms;
    }
    add(agreements, "all stages", own_sum_ms, outside_sum_ms);
  }
  return sorted(std::move(agreements));
}

void append(std::vector<StageAgreement>& to, const std::vector<StageAgreement>& other) {
  for (const StageAgreement& stage : other)
    for (std::size_t i = 0; i < stage.own_ms.size(); ++i)
      add(to, stage.stage, stage.own_ms[i], stage.outside_ms[i]);
  to = sorted(std::move(to));
}

StageAgreement::Means StageAgreement::means_ms() const {
  std::vector<std::size_t> frames(own_ms.size());
  for (std::size_t i = 0; i < frames.size(); ++i) frames[i] = i;
  const auto difference_ms = [&](std::size_t i) { return outside_ms[i] - own_ms[i]; };
  std::sort(frames.begin(), frames.end(),
            [&](std::size_t a, std::size_t b) { return difference_ms(a) < difference_ms(b); });
  const std::size_t omitted = std::size_t(kOmittedFraction * double(frames.size()));
  Means means;
  const double kept = double(frames.size() - 2 * omitted);
  for (std::size_t i = omitted; i + omitted < frames.size(); ++i) {
    means.own_ms += own_ms[frames[i]] / kept;
    means.outside_ms += outside_ms[frames[i]] / kept;
  }
  return means;
}
double StageAgreement::difference_ms(double quantile) const {
  std::vector<double> differences_ms;
  for (std::size_t i = 0; i < own_ms.size(); ++i)
    differences_ms.push_back(outside_ms[i] - own_ms[i]);
  return base::percentile(differences_ms, quantile);
}
double StageAgreement::limit_ms() const {
  return std::max(kMaxDifference_ms, kMaxDifferenceFraction * means_ms().outside_ms);
}
double StageAgreement::tail_limit_ms() const {
  return std::max(kMaxTail_ms, kMaxDifferenceFraction * means_ms().outside_ms);
}
bool StageAgreement::agrees() const {
  if (outside_ms.empty()) return false;
  const Means means = means_ms();
  return std::abs(means.outside_ms - means.own_ms) <= limit_ms() &&
         difference_ms(kTail) >= -tail_limit_ms() && difference_ms(1 - kTail) <= tail_limit_ms();
}

}  // namespace fivepipe::node_bench
