#include "launch/inspect/echo.h"

#include <unistd.h>

#include <chrono>
#include <iostream>
#include <system_error>

#include "common/base/output_queue.h"
#include "common/base/realtime.h"
#include "common/base/text_table.h"
#include "common/recording/schema/wire_types.h"
#include "launch/inspect/topic_source.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// After this time without a writer, echo reports that it is waiting.
constexpr auto kWriterTimeout = 2s;

void finish(base::OutputQueue& output) {
  if (const int error = output.finish())
    throw std::system_error(error, std::generic_category(), "standard output");
}

int echo_recording(const EchoRequest& request, const std::function<bool()>& interrupted) {
  const recording::Recording recording = opened(request.file);
  const std::string topic = resolve_topic(request.topic, topics_in(recording));
  std::map<mcap::Id, MessageFormatter> formatters;
  base::OutputQueue output(STDOUT_FILENO);
  std::uint64_t shown = 0;
  const auto show = [&](const recording::RecordedMessage& message) {
    auto formatter = formatters.find(message.channel->id);
    if (formatter == formatters.end()) {
      const recording::RecordedChannel& channel = data_channel(recording, *message.channel);
      formatter = formatters
                      .emplace(message.channel->id,
                               MessageFormatter(recording.idl(channel), channel.type, request.text))
                      .first;
    }
    std::string text = formatter->second({topic, message.channel->node, message.source_stamp_ns,
                                          message.log_stamp_ns, message.key_change, message.cdr});
    shown += !text.empty();
    output.put(std::move(text));
    return (request.count == 0 || shown < request.count) && !interrupted() && !output.closed();
  };
  const int result = each_message(recording, topic, request.start_s, request.end_s, show);
  finish(output);
  if (shown == 0)
    std::cerr << topic << ": no message"
              << (request.start_s > 0 || request.end_s ? " in this time range" : "") << "\n";
  return interrupted() ? 130 : result;
}

int echo_bus(const EchoRequest& request, const std::function<bool()>& interrupted) {
  const bus::topics::Topic topic = live_topic(request.topic);
  const MessageFormatter formatter(schema::fivepipe_idl(), topic.type, request.text);
  bus::Bus bus({request.domain, request.network, "echo"});
  bus::SerializedReader reader(bus, topic);
  WriterNames names(bus, reader);
  base::OutputQueue output(STDOUT_FILENO);
  std::uint64_t shown = 0, dropped = 0;
  const auto started = Clock::now();
  bool reported_waiting = false;
  const auto show = [&](const bus::SerializedSample& sample) {
    if (request.count > 0 && shown == request.count) return;
    std::string text = formatter({topic.name, names.of(sample.writer), sample.source_stamp_ns,
                                  base::now_realtime_ns(), key_change_of(sample.kind), sample.cdr});
    if (text.empty()) return;
    output.offer(std::move(text)) ? ++shown : ++dropped;
  };
  while (!interrupted() && !output.closed() && (request.count == 0 || shown < request.count)) {
    bus.wait(50ms);
    reader.take(show);
    if (!reported_waiting && reader.writers() == 0 && Clock::now() - started > kWriterTimeout) {
      const std::string why = bus.why_not_admitted();
      std::cerr << "waiting: no node writes " << topic.name << " in domain " << request.domain
                << "; "
                << (why.empty() ? "--domain selects another one, `fivepipe ls` lists the nodes"
                                : why)
                << ", Ctrl-C quits\n";
      reported_waiting = true;
    }
  }
  finish(output);
  if (dropped > 0)
    std::cerr << "dropped " << base::counted(dropped, "message") << ": the output is too slow\n";
  return request.count > 0 && shown < request.count && interrupted() ? 130 : 0;
}

}  // namespace

int echo(const EchoRequest& request, const std::function<bool()>& interrupted) {
  return request.file.empty() ? echo_bus(request, interrupted)
                              : echo_recording(request, interrupted);
}

}  // namespace fivepipe::launch
