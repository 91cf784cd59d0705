#include "launch/keys/role_topics.h"

#include "common/pipeline/bus/topics.h"

namespace fivepipe::keys {
namespace {

using Names = std::vector<std::string>;
using security::Role;

// Every node reports its status and its frames.
Names with_reports(Names names) {
  names.insert(names.end(), {bus::topics::NodeStatus::name, bus::topics::FrameTrace::name});
  return names;
}

Names all_topics() {
  Names names;
  for (const bus::topics::Topic& topic : bus::topics::all()) names.emplace_back(topic.name);
  return names;
}

// SerializedWriter writes a sample to itself on a topic of its own.
Names with_types(Names names) {
  for (const bus::topics::Topic& topic : bus::topics::all())
    names.push_back(std::string(topic.name) + "/type/*");
  return names;
}

}  // namespace

RoleTopics topics_of(Role role) {
  using namespace bus::topics;
  switch (role) {
    case Role::capture:
      return {with_reports({CameraInfo::name, ViewInfo::name, HeadPose::name, ObjectColour::name,
                            ObjectCoverage::name, ObjectPixelMap::name, ReplaySession::name}),
              {FrameComposited::name, TileCosts::name, HeadPose::name, HostStatus::name}};
    case Role::recon:
      return {with_reports({HullTile::name, TileCosts::name}),
              {CameraInfo::name, ViewInfo::name, HeadPose::name, ObjectColour::name,
               ObjectCoverage::name, ObjectPixelMap::name, ReplaySession::name, HostStatus::name}};
    case Role::sim:
      return {with_reports({CollisionResult::name, Particles::name, VirtualState::name,
                            HullComponents::name, SimulationMetrics::name, ObjectSpacing::name}),
              {CameraInfo::name, ObjectCoverage::name, ObjectPixelMap::name, Command::name,
               SpacingRequest::name, ObjectSpacing::name, ReplaySession::name, HostStatus::name}};
    case Role::render:
      return {with_reports({FrameComposited::name, SpacingRequest::name}),
              {HullTile::name, CollisionResult::name, Particles::name, VirtualState::name,
               ObjectSpacing::name, ReplaySession::name, HostStatus::name}};
    case Role::supervisor:
      return {{HostStatus::name, SpacingRequest::name},
              {NodeStatus::name, SimulationMetrics::name, FrameComposited::name, HostStatus::name,
               ObjectSpacing::name}};
    case Role::recorder: return {{NodeStatus::name}, all_topics()};
    case Role::observer: return {{}, all_topics()};
    case Role::replay: return {with_types(all_topics()), with_types({FrameTrace::name})};
    case Role::commands: return {{Command::name, SpacingRequest::name}, {ObjectSpacing::name}};
    case Role::tracker: return {{HeadPose::name}, {}};
  }
  return {};
}

}  // namespace fivepipe::keys
