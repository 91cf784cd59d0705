// When the messages of each frame passed the socket of their writer, from the datagrams of the
// loopback interface.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>

#include "benchmarks/nodes/wire/loopback_trace.h"
#include "common/recording/schema/cdr.h"

namespace fivepipe::wire {

struct MessageWriter {
  std::string topic, node;
};
// A topic from the node that writes it to one that reads it.
struct Route {
  std::string topic, writer, reader;               // reader: empty if it is not known
  auto operator<=>(const Route&) const = default;  // NOLINT: clang-tidy 14 misreads it
};
// Of all messages of a frame on a route: when the first and the last datagram were sent [ns,
// CLOCK_REALTIME]. Repeated datagrams do not count.
struct SendTimes {
  std::int64_t first_ns = 0, last_ns = 0;
};
using FrameMessages = std::map<Route, SendTimes>;

class MessageTimes {
 public:
  // `writers`: the writers to follow, by GUID; their types have a field `frame`. `participants`:
  // the names of the nodes by GUID prefix of their participant.
  MessageTimes(const std::map<std::string, MessageWriter>& writers,
               std::map<std::string, std::string> participants);

  void add(const Datagram& datagram);
  std::map<std::uint64_t, FrameMessages> by_frame() const;

 private:
  struct Sent {
    std::uint64_t sequence_number = 0;
    std::uint32_t fragment = 0;
    auto operator<=>(const Sent&) const = default;  // NOLINT: clang-tidy 14 misreads it
  };
  struct Writer {
    MessageWriter description;
    schema::FieldReader frame;
    std::map<std::uint16_t, Sent> newest;         // by destination port
    std::map<std::uint64_t, std::uint64_t> open;  // frames of fragmented messages, by number
  };
  using PortRoute = std::tuple<const Writer*, std::uint16_t>;
  std::map<std::string, Writer> writers_;
  std::map<std::string, std::string> participants_;
  std::map<std::uint16_t, std::string> reader_of_port_;  // some datagrams name their destination
  std::map<std::uint64_t, std::map<PortRoute, SendTimes>> by_frame_;
};

}  // namespace fivepipe::wire
