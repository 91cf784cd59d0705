#include "benchmarks/nodes/wire/message_times.h"

#include <algorithm>

#include "benchmarks/nodes/wire/rtps.h"
#include "common/pipeline/bus/topics.h"
#include "common/recording/schema/wire_types.h"

namespace fivepipe::wire {
namespace {

// The frames of this many fragmented messages per writer are kept. More are not sent at once.
constexpr std::size_t kMaxOpen = 64;

std::string type_of(const std::string& topic) {
  for (const bus::topics::Topic& known : bus::topics::all())
    if (topic == known.name) return known.type;
  return {};
}

}  // namespace

MessageTimes::MessageTimes(const std::map<std::string, MessageWriter>& writers,
                           std::map<std::string, std::string> participants)
    : participants_(std::move(participants)) {
  for (const auto& [guid, writer] : writers)
    writers_.emplace(
        guid, Writer{writer, {schema::fivepipe_idl(), type_of(writer.topic), "frame"}, {}, {}});
}

void MessageTimes::add(const Datagram& datagram) {
  const RtpsDatagram parsed = parse_rtps(datagram.payload);
  if (const auto known = participants_.find(parsed.destination); known != participants_.end())
    reader_of_port_[datagram.destination_port] = known->second;
  for (const RtpsData& data : parsed.data) {
    const auto found = writers_.find(data.writer);
    if (found == writers_.end()) continue;
    Writer& writer = found->second;
    const Sent sent{data.sequence_number, data.fragment};
    Sent& newest = writer.newest[datagram.destination_port];
    if (sent <= newest) continue;  // repeated
    newest = sent;
    if (data.fragment == 1)
      if (const auto frame = writer.frame.read(data.cdr);
          frame && std::holds_alternative<std::uint64_t>(*frame))
        writer.open[data.sequence_number] = std::get<std::uint64_t>(*frame);
    while (writer.open.size() > kMaxOpen) writer.open.erase(writer.open.begin());
    const auto frame = writer.open.find(data.sequence_number);
    if (frame == writer.open.end()) continue;
    SendTimes& times = by_frame_[frame->second][{&writer, datagram.destination_port}];
    if (times.first_ns == 0) times.first_ns = datagram.stamp_ns;
    times.last_ns = std::max(times.last_ns, datagram.stamp_ns);
  }
}

std::map<std::uint64_t, FrameMessages> MessageTimes::by_frame() const {
  std::map<std::uint64_t, FrameMessages> by_frame;
  for (const auto& [frame, routes] : by_frame_)
    for (const auto& [route, times] : routes) {
      const auto& [writer, port] = route;
      const auto reader = reader_of_port_.find(port);
      by_frame[frame][{writer->description.topic, writer->description.node,
                       reader == reader_of_port_.end() ? "" : reader->second}] = times;
    }
  return by_frame;
}

}  // namespace fivepipe::wire
