#include "common/pipeline/bus/discovery.h"

#include <array>
#include <cstring>
#include <memory>

#include "common/pipeline/bus/announcer.h"

namespace fivepipe::bus::detail {
namespace {

constexpr std::int32_t kMaxEndpoints = 1024;  // per built-in topic

// Calls `each` for every endpoint in the built-in topic that is alive.
template <class Described, class Each>
void for_each_endpoint(dds_entity_t participant, dds_entity_t builtin_topic, const Each& each) {
  const dds_entity_t reader = dds_create_reader(participant, builtin_topic, nullptr, nullptr);
  if (reader < 0) throw BusError(std::string("reading discovery: ") + dds_strretcode(-reader));
  const Entity owner(reader);
  std::vector<void*> samples(kMaxEndpoints, nullptr);
  std::vector<dds_sample_info_t> infos(kMaxEndpoints);
  const dds_return_t count =
      dds_read(reader, samples.data(), infos.data(), kMaxEndpoints, kMaxEndpoints);
  for (dds_return_t i = 0; i < count; ++i)
    if (infos[std::size_t(i)].valid_data && infos[std::size_t(i)].instance_state == DDS_IST_ALIVE)
      each(*static_cast<const Described*>(samples[std::size_t(i)]));
  if (count > 0) dds_return_loan(reader, samples.data(), count);
}

std::string duration_text(dds_duration_t duration_ns) {
  return duration_ns == DDS_INFINITY ? "infinite" : std::to_string(duration_ns / 1'000'000) + " ms";
}

}  // namespace

std::string guid_text(const dds_guid_t& guid) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : guid.v) text += {kDigits[byte >> 4], kDigits[byte & 15]};
  return text;
}

std::string user_data_of(const dds_qos_t* qos) {
  void* bytes = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(qos, &bytes, &size) || !bytes) return "";
  std::string user_data(static_cast<const char*>(bytes), size);
  dds_free(bytes);
  if (user_data.ends_with(Announcer::kAnnouncement)) user_data.pop_back();
  return user_data;
}

std::map<std::string, std::string> qos_text(const dds_qos_t* qos) {
  std::map<std::string, std::string> text;
  dds_reliability_kind_t reliability;
  dds_durability_kind_t durability;
  dds_history_kind_t history;
  dds_duration_t blocking_ns = 0;
  std::int32_t depth = 0;
  if (dds_qget_reliability(qos, &reliability, &blocking_ns))
    text["reliability"] = reliability == DDS_RELIABILITY_RELIABLE
                              ? "reliable, blocks " + duration_text(blocking_ns)
                              : "best_effort";
  if (dds_qget_durability(qos, &durability)) {
    static constexpr const char* kNames[] = {"volatile", "transient_local", "transient",
                                             "persistent"};
    text["durability"] = kNames[durability];
  }
  if (dds_qget_history(qos, &history, &depth))
    text["history"] =
        history == DDS_HISTORY_KEEP_ALL ? "keep_all" : "keep_last " + std::to_string(depth);
  return text;
}

DiscoveredProcess process_of_participant(dds_entity_t participant, const dds_guid_t& described) {
  DiscoveredProcess found;
  for_each_endpoint<dds_builtintopic_participant_t>(
      participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, [&](const auto& known) {
        if (std::memcmp(known.key.v, described.v, sizeof described.v) != 0) return;
        found.discovered = true;
        found.process = from_user_data(user_data_of(known.qos));
      });
  return found;
}

std::set<std::string> silent_deployments(dds_entity_t participant) {
  std::set<std::string> with_endpoints, silent;
  const auto add = [&](const dds_builtintopic_endpoint_t& known) {
    with_endpoints.insert(guid_text(known.participant_key));
  };
  for_each_endpoint<dds_builtintopic_endpoint_t>(participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION,
                                                 add);
  for_each_endpoint<dds_builtintopic_endpoint_t>(participant, DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION,
                                                 add);
  for_each_endpoint<dds_builtintopic_participant_t>(
      participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, [&](const auto& known) {
        if (!with_endpoints.contains(guid_text(known.key)))
          silent.insert(deployment_from_user_data(user_data_of(known.qos)));
      });
  silent.erase("");  // other programs, and fivepipe ls
  return silent;
}

std::string silence_text(const std::set<std::string>& deployments, const std::string& keys,
                         bool has_deployment) {
  std::string names;
  for (const std::string& name : deployments) names += (names.empty() ? "'" : "', '") + name;
  if (names.empty()) return "";
  if (!keys.empty())
    return "deployment " + names + "' exchanges no messages with the keys in " + keys +
           ": they are of another CA, of the other protection (sign or encrypt) or expired, or the "
           "deployment runs without security. If a line 'DDS: ...' above names no reason, copy the "
           "folder again from the machine with the CA";
  const std::string network =
      "a firewall blocks one direction, an MTU differs along the path, or it is still starting";
  const std::string runs =
      "deployment " + names + "' runs there, but exchanges no messages with this program: ";
  return has_deployment
             ? runs + network + "; or it runs with security, which the file given here lacks"
             : runs +
                   "with security it admits only programs that have its keys (add --deployment and "
                   "its file); else " +
                   network;
}

std::vector<EndpointDescription> discovered_endpoints(dds_entity_t participant) {
  dds_guid_t own{};
  dds_get_guid(participant, &own);
  std::map<std::string, std::string> name_of_participant;
  for_each_endpoint<dds_builtintopic_participant_t>(
      participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, [&](const auto& known) {
        char* name = nullptr;
        if (dds_qget_entity_name(known.qos, &name) && name)
          name_of_participant[guid_text(known.key)] = name;
        dds_free(name);
      });
  std::vector<EndpointDescription> endpoints;
  const auto add = [&](const dds_builtintopic_endpoint_t& known, bool writes) {
    const std::string participant_guid = guid_text(known.participant_key);
    endpoints.push_back({known.topic_name, known.type_name, writes,
                         participant_guid == guid_text(own), guid_text(known.key), participant_guid,
                         name_of_participant[participant_guid],
                         deployment_from_user_data(user_data_of(known.qos)), qos_text(known.qos)});
  };
  for_each_endpoint<dds_builtintopic_endpoint_t>(participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION,
                                                 [&](const auto& known) { add(known, true); });
  for_each_endpoint<dds_builtintopic_endpoint_t>(participant, DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION,
                                                 [&](const auto& known) { add(known, false); });
  return endpoints;
}

}  // namespace fivepipe::bus::detail
