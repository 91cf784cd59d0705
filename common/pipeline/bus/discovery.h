// Converts discovery data of readers and writers to text. Internal to bus.
#pragma once
#include <dds/dds.h>

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/pipeline/bus/bus.h"

namespace fivepipe::bus::detail {

std::string guid_text(const dds_guid_t& guid);
std::string user_data_of(const dds_qos_t* qos);
std::map<std::string, std::string> qos_text(const dds_qos_t* qos);
// What discovery knows about a participant's process.
struct DiscoveredProcess {
  bool discovered = false;           // false: its data have not arrived, or it is gone
  std::optional<ProcessId> process;  // nullopt: its user data state no identity
};
// Throws BusError.
DiscoveredProcess process_of_participant(dds_entity_t participant, const dds_guid_t& described);
// Returns the deployments of the discovered participants of which this one sees no endpoint: with
// security, a participant shows its endpoints only to those that it has authenticated. Throws
// BusError.
std::set<std::string> silent_deployments(dds_entity_t participant);
// Returns why these deployments may exchange no messages with this process, for people; empty if
// there are none. keys: the folder of this process's keys; empty: it has none. has_deployment: it
// was started with --deployment.
std::string silence_text(const std::set<std::string>& deployments, const std::string& keys,
                         bool has_deployment);
// Returns all endpoints that this participant has discovered, including its own. Throws BusError.
std::vector<EndpointDescription> discovered_endpoints(dds_entity_t participant);

}  // namespace fivepipe::bus::detail
