#include <unistd.h>

#include <chrono>
#include <iostream>

#include "common/base/realtime.h"
#include "common/recording/files/frame_groups.h"
#include "common/recording/schema/wire_types.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"
#include "launch/inspect/arrival_statistics.h"
#include "launch/inspect/topic_source.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kRefreshPeriod = 1s;
// What a table shows of a live topic: long enough for what comes twice a second.
constexpr std::int64_t kWindow_s = 5;

struct HzOptions {
  std::string topic;
  std::filesystem::path file;
  double once_s = 0;  // 0: until Ctrl-C
  NetworkOptions network;
};

int hz_from_file(const HzOptions& options) {
  const recording::Recording recording = opened(options.file);
  const std::string topic = resolve_topic(options.topic, topics_in(recording));
  recording::FrameIdReader frame_of(recording);
  bool type_known = true;
  const auto frame_in =
      [&](const recording::RecordedMessage& message) -> std::optional<std::uint64_t> {
    if (type_known) try {
        const auto id = frame_of(message);
        return id ? std::optional(id->frame) : std::nullopt;
      } catch (const recording::RecordingError& error) {
        type_known = false;
        std::cerr << error.what() << "; without frame numbers\n";
      }
    return std::nullopt;
  };
  ArrivalStatistics statistics;
  const int result = each_message(
      recording, topic, 0, std::nullopt, [&](const recording::RecordedMessage& message) {
        if (!message.key_change)
          statistics.add(message.channel->node,
                         {message.log_stamp_ns, message.log_stamp_ns - message.source_stamp_ns,
                          message.cdr.size()},
                         frame_in(message));
        return signals_received() == 0;
      });
  if (signals_received() > 0) return 130;
  std::cout << topic << ", as it was recorded\n" << statistics.text() << std::flush;
  return result;
}

// Of a message of this build's type that is of a frame.
class LiveFrame {
 public:
  explicit LiveFrame(const bus::topics::Topic& topic) {
    const schema::Struct& type = schema::fivepipe_idl().at(topic.type);
    // A node's status tells of a frame, but is not of it: it has no capture stamp.
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

int hz_live(const HzOptions& options) {
  const bus::topics::Topic topic = live_topic(options.topic);
  const LiveFrame frame_of(topic);
  bus::Bus bus({options.network.domain, options.network.profile, "hz"});
  bus::SerializedReader reader(bus, topic);
  WriterNames names(bus, reader);
  ArrivalStatistics statistics;
  const bool once = options.once_s > 0, on_terminal = isatty(STDOUT_FILENO) && !once;
  const auto period = once ? std::chrono::duration_cast<Clock::duration>(
                                 std::chrono::duration<double>(options.once_s))
                           : Clock::duration(kRefreshPeriod);
  for (auto next = Clock::now() + period;; next += period) {
    while (Clock::now() < next && signals_received() == 0) {
      bus.wait(std::min<std::chrono::nanoseconds>(100ms, next - Clock::now()));
      reader.take([&](const bus::SerializedSample& sample) {
        const std::int64_t now_ns = base::now_realtime_ns();
        const Arrival arrival{now_ns, now_ns - sample.source_stamp_ns, sample.cdr.size()};
        if (sample.kind == bus::SampleKind::data)
          statistics.add(names.of(sample.writer), arrival, frame_of(sample.cdr));
      });
    }
    if (signals_received() > 0) return once ? 130 : 0;
    if (!once) statistics.remove_before(base::now_realtime_ns() - kWindow_s * 1'000'000'000);
    if (on_terminal) std::cout << "\x1b[H\x1b[2J";  // home, clear
    std::cout << topic.name << ", domain " << options.network.domain
              << (once ? ""
                       : ", the last " + std::to_string(kWindow_s) + " s; frames since the start")
              << "\n";
    if (statistics.messages() == 0)
      std::cout << "no message; writers: " << reader.writers() << "\n";
    else
      std::cout << statistics.text();
    std::cout << (on_terminal || once ? "" : "\n") << std::flush;
    if (!std::cout) return 1;
    if (once) return statistics.messages() == 0 ? 3 : 0;
  }
}

int run_hz(const HzOptions& options) {
  catch_signals();
  return options.file.empty() ? hz_live(options) : hz_from_file(options);
}

}  // namespace

void add_hz(CLI::App& app, Command& command) {
  auto options = std::make_shared<HzOptions>();
  CLI::App* hz = app.add_subcommand(
      "hz", "Measure how often and how regularly a topic's messages come, by writer");
  hz->footer(
      "Examples:\n"
      "  fivepipe hz HeadPose                       from the bus, refreshed each second; Ctrl-C "
      "ends it\n"
      "  fivepipe hz HullTile --domain 7 --once 10\n"
      "  fivepipe hz ObjectPixelMap --from session.mcap\n\n"
      "Intervals are those at which messages were taken, here or by the recorder; latencies run "
      "from the source's time stamp to there.\n"
      "Exit codes: 0 done, 1 the file is damaged or can't be read, 2 usage, 3 nothing came within "
      "--once, 130 interrupted before.");
  hz->add_option("TOPIC", options->topic, "HullTile, fivepipe/v1/HullTile, ..")->required();
  CLI::Option* file =
      hz->add_option("--from", options->file, "recording (MCAP); without it: the bus")
          ->check(CLI::ExistingFile);
  hz->add_option("--once", options->once_s, "one table, of so many seconds, then end")
      ->check(CLI::Range(0.1, 86400.0))
      ->excludes(file);
  add_network_options(hz, options->network);
  hz->get_option("--domain")->excludes(file);
  hz->get_option("--profile")->excludes(file);
  hz->callback([options, &command] {
    command = [options] { return base::report_errors([&] { return run_hz(*options); }); };
  });
}

}  // namespace fivepipe::launch
