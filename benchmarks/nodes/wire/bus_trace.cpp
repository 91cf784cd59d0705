#include "benchmarks/nodes/wire/bus_trace.h"

#include <fmt/format.h>

#include <set>
#include <stdexcept>

#include "benchmarks/nodes/wire/rtps.h"

namespace fivepipe::wire {
namespace {

std::map<std::string, MessageWriter> writers_of(bus::Bus& bus) {
  using namespace bus::topics;
  static const std::set<std::string> followed = {
      HeadPose::name,       ObjectColour::name,    ObjectCoverage::name,
      ObjectPixelMap::name, VirtualState::name,    TileCosts::name,
      HullTile::name,       FrameComposited::name, FrameTrace::name};
  std::map<std::string, MessageWriter> writers;
  for (const bus::EndpointDescription& endpoint : bus.endpoints())
    if (endpoint.writes && followed.contains(endpoint.topic))
      writers[endpoint.guid] = {endpoint.topic, endpoint.participant};
  return writers;
}

std::map<std::string, std::string> participants_of(bus::Bus& bus) {
  std::map<std::string, std::string> participants;
  for (const bus::EndpointDescription& endpoint : bus.endpoints())
    participants[endpoint.participant_guid.substr(0, kGuidPrefixDigits)] = endpoint.participant;
  return participants;
}

}  // namespace

BusTrace::BusTrace(bus::Bus& bus)
    : times_(writers_of(bus), participants_of(bus)),
      trace_([this](const Datagram& datagram) { times_.add(datagram); }) {}

std::map<std::uint64_t, FrameMessages> BusTrace::end() {
  trace_.stop();
  if (trace_.dropped() > 0)
    throw std::runtime_error(
        fmt::format("the trace of the loopback interface lost {} datagrams", trace_.dropped()));
  return times_.by_frame();
}

}  // namespace fivepipe::wire
