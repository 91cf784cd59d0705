// The messages in an RTPS datagram, as far as a trace of the bus needs them. Source: OMG DDSI-RTPS
// 2.3, sections 8.3.3, 9.4.2 and 9.4.5. Pure; reads nothing beyond the datagram.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace fivepipe::wire {

// A message or a fragment of one.
struct RtpsData {
  std::string writer;  // GUID as in bus::EndpointDescription
  std::uint64_t sequence_number = 0;
  std::uint32_t fragment = 1;      // from 1; 1 if the message is not fragmented
  std::span<const std::byte> cdr;  // with its 4-byte header if fragment is 1; may be cut off
};

struct RtpsDatagram {
  std::string destination;  // GUID prefix of the participant that the datagram names; empty: none
  std::vector<RtpsData> data;  // in the order of the datagram, without samples without payload
};
inline constexpr std::size_t kGuidPrefixDigits = 24;  // of a GUID's 32 hexadecimal digits

// Takes a datagram that may be cut off at its end. Returns what precedes the first defect; nothing
// if the datagram is not RTPS.
RtpsDatagram parse_rtps(std::span<const std::byte> datagram);

}  // namespace fivepipe::wire
