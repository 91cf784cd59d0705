#include "launch/inspect/hz.h"

#include <unistd.h>

#include <chrono>
#include <iostream>

#include "common/base/output_queue.h"
#include "common/base/realtime.h"
#include "common/recording/files/frame_groups.h"
#include "common/recording/schema/wire_types.h"
#include "launch/inspect/arrival_statistics.h"
#include "launch/inspect/topic_source.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kRefreshPeriod = 1s;
// Time that a table of a live topic covers; enough for topics with two messages per second.
constexpr std::int64_t kWindow_s = 5;

int measure_recording(const HzRequest& request, const std::function<bool()>& interrupted) {
  const recording::Recording recording = opened(request.file);
  const std::string topic = resolve_topic(request.topic, topics_in(recording));
  recording::FrameIdReader frame_of(recording);
  bool type_known = true;
  const auto frame_in =
      [&](const recording::RecordedMessage& message) -> std::optional<std::uint64_t> {
    if (type_known) try {
        const auto id = frame_of(message);
        return id ? std::optional(id->frame) : std::nullopt;
      } catch (const recording::RecordingError& error) {
        type_known = false;
        std::cerr << error.what() << "; frame numbers are not available\n";
      }
    return std::nullopt;
  };
  ArrivalStatistics statistics;
  const int result = each_message(
      recording, topic, 0, std::nullopt, [&](const recording::RecordedMessage& message) {
        if (!message.key_change)
          statistics.add(message.channel->node,
                         {message.log_stamp_ns,
                          base::difference_ns(message.log_stamp_ns, message.source_stamp_ns),
                          message.cdr.size()},
                         frame_in(message));
        return !interrupted();
      });
  if (interrupted()) return 130;
  std::cout << topic << ", as recorded\n" << statistics.text() << std::flush;
  return result;
}

// Reads the frame number of a live message; nullopt if the type belongs to no frame.
class LiveFrame {
 public:
  explicit LiveFrame(const bus::topics::Topic& topic) {
    const schema::Struct& type = schema::fivepipe_idl().at(topic.type);
    // NodeStatus names a frame but does not belong to it: it has no capture stamp.
    if (type.find("frame") && type.find("capture_stamp_ns"))
      field_.emplace(schema::fivepipe_idl(), topic.type, "frame");
  }
  std::optional<std::uint64_t> operator()(std::span<const std::byte> cdr) const {
    const auto value = field_ ? field_->read(cdr) : std::nullopt;
    const auto* frame = value ? std::get_if<std::uint64_t>(&*value) : nullptr;
    return frame ? std::optional(*frame) : std::nullopt;
  }

 private:
  std::optional<schema::FieldReader> field_;
};

std::string no_message_text(bus::Bus& bus, int writers) {
  const std::string why = bus.why_not_admitted();
  return "no message; writers: " + std::to_string(writers) + "\n" + why + (why.empty() ? "" : "\n");
}

int measure_bus(const HzRequest& request, const std::function<bool()>& interrupted) {
  const bus::topics::Topic topic = live_topic(request.topic);
  const LiveFrame frame_of(topic);
  bus::Bus bus({request.domain, request.network, "hz"});
  bus::SerializedReader reader(bus, topic);
  WriterNames names(bus, reader);
  ArrivalStatistics statistics;
  const bool once = request.once_s > 0, on_terminal = isatty(STDOUT_FILENO) && !once;
  const auto period = once ? std::chrono::duration_cast<Clock::duration>(
                                 std::chrono::duration<double>(request.once_s))
                           : Clock::duration(kRefreshPeriod);
  for (auto next = Clock::now() + period;; next += period) {
    while (Clock::now() < next && !interrupted()) {
      bus.wait(std::min<std::chrono::nanoseconds>(100ms, next - Clock::now()));
      reader.take([&](const bus::SerializedSample& sample) {
        const std::int64_t now_ns = base::now_realtime_ns();
        const Arrival arrival{now_ns, base::difference_ns(now_ns, sample.source_stamp_ns),
                              sample.cdr.size()};
        if (sample.kind == bus::SampleKind::data)
          statistics.add(names.of(sample.writer), arrival, frame_of(sample.cdr));
      });
    }
    if (interrupted()) return once ? 130 : 0;
    if (!once) statistics.remove_before(base::now_realtime_ns() - kWindow_s * 1'000'000'000);
    if (on_terminal) std::cout << "\x1b[H\x1b[2J";  // cursor home, clear the screen
    std::cout << topic.name << ", domain " << request.domain
              << (once ? ""
                       : ", the last " + std::to_string(kWindow_s) + " s; frames since the start")
              << "\n";
    if (statistics.messages() == 0)
      std::cout << no_message_text(bus, reader.writers());
    else
      std::cout << statistics.text();
    std::cout << (on_terminal || once ? "" : "\n") << std::flush;
    if (!std::cout) return base::is_broken_pipe(STDOUT_FILENO) ? 0 : 1;
    if (once) return statistics.messages() == 0 ? 3 : 0;
  }
}

}  // namespace

int measure_rate(const HzRequest& request, const std::function<bool()>& interrupted) {
  return request.file.empty() ? measure_bus(request, interrupted)
                              : measure_recording(request, interrupted);
}

}  // namespace fivepipe::launch
