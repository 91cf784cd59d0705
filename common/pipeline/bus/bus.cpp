#include "common/pipeline/bus/bus.h"

#include <dds/dds.h>

#include <array>
#include <map>
#include <mutex>
#include <utility>

#include "common/base/realtime.h"
#include "common/pipeline/bus/announcer.h"
#include "common/pipeline/bus/checked.h"
#include "common/pipeline/bus/discovery.h"
#include "common/pipeline/bus/profile.h"
#include "common/pipeline/bus/secured/expiry_watch.h"
#include "common/pipeline/bus/secured/participant_security.h"
#include "common/pipeline/bus/secured/refusal_log.h"
#include "common/pipeline/bus/shutdown/receiver_wakeup.h"

namespace fivepipe::bus {
namespace {

using detail::checked;

// Cyclone DDS clears this many sample structs for each returned loan. A number above the
// tiles of a view costs more time than it saves.
constexpr std::int32_t kMaxSamplesPerTake = 64;

// History depth in samples per key. stream: more than max_frames_in_flight, so that pacing drops
// frames before the bus does.
constexpr std::int32_t kStreamDepth = 8, kLatchedDepth = 1, kEventDepth = 64;
// A reader that exists at the writes takes each of several changes, as of an ObjectSpacing. A
// writer that kept more than one would also send older ones to a reader that joins before the
// others have acknowledged them.
constexpr std::int32_t kLatchedReaderDepth = kEventDepth;

// Readers acknowledge samples when a heartbeat requests it. Cyclone DDS merges several
// configurations; later ones override earlier ones.
constexpr const char* kFrequentHeartbeats =
    R"(,<CycloneDDS><Domain><Internal><HeartbeatInterval )"
    R"(min="100us" minsched="100us" max="10ms">200us</HeartbeatInterval>)"
    R"(</Internal></Domain></CycloneDDS>)";

using Qos = std::unique_ptr<dds_qos_t, void (*)(dds_qos_t*)>;

Qos qos_of(topics::Delivery delivery, bool keep_all, const std::string& identity) {
  Qos qos(dds_create_qos(), dds_delete_qos);
  dds_qset_userdata(qos.get(), identity.data(), identity.size());
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
  dds_qset_writer_data_lifecycle(qos.get(), false);
  switch (delivery) {
    case topics::Delivery::stream:
      dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, kStreamDepth);
      break;
    case topics::Delivery::event:
      dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, kEventDepth);
      break;
    case topics::Delivery::latched:
      dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, kLatchedDepth);
      dds_qset_durability(qos.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
      break;
  }
  if (keep_all) dds_qset_history(qos.get(), DDS_HISTORY_KEEP_ALL, 0);
  return qos;
}

bool is_accepted(const dds_sample_info_t* info, void* reader_filter) {
  auto& filter = *static_cast<detail::ReaderFilter*>(reader_filter);
  const detail::Callback callback(filter.order);
  if (filter.strangers.refuses(info->publication_handle)) return false;
  filter.arrival_times.add(info->publication_handle, info->source_timestamp,
                           base::now_realtime_ns());
  return filter.key_limit.accepts(info->publication_handle, info->instance_handle);
}

void on_match(dds_entity_t reader, dds_subscription_matched_status_t status, void* reader_filter) {
  static_cast<detail::ReaderFilter*>(reader_filter)
      ->report_match(reader, status.last_publication_handle, status.current_count_change > 0);
}

const char* policy_name(std::uint32_t policy) {
  switch (policy) {
    case DDS_TYPE_CONSISTENCY_ENFORCEMENT_QOS_POLICY_ID:
      return "another version of the message type";
    case DDS_DURABILITY_QOS_POLICY_ID: return "durability QoS";
    case DDS_RELIABILITY_QOS_POLICY_ID: return "reliability QoS";
    case DDS_DATA_REPRESENTATION_QOS_POLICY_ID: return "data representation";
    default: return "QoS";
  }
}

}  // namespace

namespace detail {

Entity::~Entity() { dds_delete(handle); }

LoanedSamples take(Entity& reader) {
  LoanedSamples taken;
  std::array<void*, kMaxSamplesPerTake> samples{};
  std::array<dds_sample_info_t, kMaxSamplesPerTake> infos;
  const std::int32_t count = checked(
      dds_take(reader.handle, samples.data(), infos.data(), kMaxSamplesPerTake, kMaxSamplesPerTake),
      "dds_take");
  const std::int64_t now_ns = base::now_realtime_ns();
  taken.samples.assign(samples.begin(), samples.begin() + count);
  for (std::int32_t i = 0; i < count; ++i) {
    const dds_sample_info_t& info = infos[i];
    taken.infos.push_back(
        {info.valid_data, info.instance_state != DDS_IST_ALIVE, info.publication_handle,
         info.source_timestamp,
         reader.filter->arrival_times.of(info.publication_handle, info.source_timestamp)
             .value_or(now_ns)});
    taken.is_strangers.push_back(reader.filter->strangers.contains(info.publication_handle));
    reader.filter->key_limit.update(info);
  }
  return taken;
}

void return_loan(std::int32_t reader, LoanedSamples& taken) {
  if (!taken.samples.empty())
    dds_return_loan(reader, taken.samples.data(), std::int32_t(taken.samples.size()));
}

void write(Entity& writer, const void* message, const char* topic) {
  const std::int32_t result = dds_write(writer.handle, message);
  if (result == DDS_RETCODE_TIMEOUT) {
    ++writer.written->not_sent;
    return;
  }
  checked(result, std::string("writing ") + topic);
  ++writer.written->sent;
}

bool wait_for_acks(std::int32_t writer, std::chrono::nanoseconds timeout) {
  return dds_wait_for_acks(writer, timeout.count()) == DDS_RETCODE_OK;
}

int matched_readers(std::int32_t writer) {
  dds_publication_matched_status_t status;
  return dds_get_publication_matched_status(writer, &status) == DDS_RETCODE_OK
             ? int(status.current_count)
             : 0;
}

int matched_writers(const Entity& reader) {
  if (const std::optional<int> own = reader.filter->strangers.own_writers()) return *own;
  dds_subscription_matched_status_t status;
  return dds_get_subscription_matched_status(reader.handle, &status) == DDS_RETCODE_OK
             ? int(status.current_count)
             : 0;
}

}  // namespace detail

struct Bus::Impl {
  struct Endpoint {
    std::weak_ptr<detail::Entity> entity;
    const char* topic;
    bool reads;
    std::shared_ptr<detail::WriteCounts> written;
    detail::WriterProcesses processes = {};  // of the writers of a reader
  };
  std::unique_ptr<detail::Entity> domain, participant, waitset;  // deleted in reverse order
  std::map<std::string, std::int32_t> topic_of_name;
  std::vector<Endpoint> endpoints;
  std::mutex mutex;
  std::string deployment, identity;  // identity: the user data of each entity
  bool has_deployment = false;       // also without its name: only its file names its machines
  bool has_stranger = false, is_stranger_reported = false;
  std::optional<security::Credentials> security;
  std::optional<detail::ExpiryWatch> expiry_watch;
  std::optional<detail::Announcer> announcer;

  // Returns `result`. Throws BusError if it is an error. what: "reader of" or "writer of".
  std::int32_t permitted(std::int32_t result, const char* what, const char* topic_name) const {
    if (result == DDS_RETCODE_NOT_ALLOWED_BY_SECURITY && security)
      throw BusError("role " + std::string(security::name_of(security->files.role)) +
                     " may not have a " + what + " " + topic_name + ": " +
                     security->files.permissions().string() + " does not allow it. " +
                     security->remedy + " makes the permissions of all roles");
    return checked(result, std::string(what) + " " + topic_name);
  }

  // The topic of a writer.
  std::int32_t topic(const char* name, const dds_topic_descriptor_t* descriptor) {
    const auto known = topic_of_name.find(name);
    if (known != topic_of_name.end()) return known->second;
    return topic_of_name[name] =
               permitted(dds_create_topic(participant->handle, descriptor, name, nullptr, nullptr),
                         "writer of", name);
  }
};

Bus::Bus(const BusOptions& options) : impl_(std::make_unique<Impl>()) {
  FittedProfile profile = fitted_to_kernel(profile_xml(options.network), kernel_rmem_max_bytes());
  if (options.frequent_heartbeats) profile.xml += kFrequentHeartbeats;
  if (!profile.warning.empty()) warnings_.push_back(profile.warning);
  // A process configures a domain once. A second Bus in the same domain (tests, tools) uses the
  // configuration of the first one.
  const std::int32_t domain = dds_create_domain(options.domain, profile.xml.c_str());
  if (domain >= 0)
    impl_->domain = std::make_unique<detail::Entity>(domain);
  else if (domain != DDS_RETCODE_PRECONDITION_NOT_MET)
    throw BusError("cannot open DDS domain " + std::to_string(options.domain) +
                   " with network profile '" + options.network.profile + "': " +
                   dds_strretcode(-domain) + " (Cyclone DDS logs the reason in the lines above)");
  const Qos qos(dds_create_qos(), dds_delete_qos);
  if (!options.participant.empty()) dds_qset_entity_name(qos.get(), options.participant.c_str());
  impl_->deployment = options.deployment;
  impl_->has_deployment =
      !options.deployment.empty() || reaches_other_machines(options.network.profile);
  impl_->identity = to_user_data(this_process(), options.deployment);
  dds_qset_userdata(qos.get(), impl_->identity.data(), impl_->identity.size());
  std::string what = "DDS participant in domain " + std::to_string(options.domain);
  impl_->security = options.network.security;
  if (impl_->security) {
    detail::limit_dds_log();
    detail::set_security(qos.get(), impl_->security->files);
    warnings_.insert(warnings_.end(), impl_->security->warnings.begin(),
                     impl_->security->warnings.end());
    if (impl_->security->expires_s > 0) impl_->expiry_watch.emplace(*impl_->security);
    what += " with the keys in " + impl_->security->files.folder.string() +
            " (Cyclone DDS logs the reason in the lines above; " + impl_->security->remedy +
            " makes new keys)";
  }
  impl_->participant = std::make_unique<detail::Entity>(
      checked(dds_create_participant(options.domain, qos.get(), nullptr), what));
  impl_->waitset = std::make_unique<detail::Entity>(
      checked(dds_create_waitset(impl_->participant->handle), "waitset"));
  // Cyclone DDS does not wait for an empty waitset. Attached to itself, it waits without readers.
  checked(dds_waitset_attach(impl_->waitset->handle, impl_->waitset->handle, 0), "waitset");
  if (reaches_other_machines(options.network.profile) && resolves_addresses_quickly())
    impl_->announcer.emplace(impl_->participant->handle, impl_->identity);
}

Bus::~Bus() {
  const detail::ReceiverWakeup wakeup;
  impl_.reset();
}

std::shared_ptr<detail::Entity> Bus::make_reader(const topics::Topic& topic,
                                                 const ReaderOptions& options) {
  const std::scoped_lock lock(impl_->mutex);
  const Qos qos = qos_of(topic.delivery, options.keep_all, impl_->identity);
  if (topic.delivery == topics::Delivery::latched && !options.keep_all)
    dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, kLatchedReaderDepth);
  // The filter belongs to a topic entity and must be set before the reader exists.
  const dds_entity_t filtered = impl_->permitted(
      dds_create_topic(impl_->participant->handle, topic.descriptor, topic.name, nullptr, nullptr),
      "reader of", topic.name);
  auto filter = std::make_unique<detail::ReaderFilter>(topic.max_keys, impl_->deployment);
  dds_topic_filter topic_filter{};
  topic_filter.mode = DDS_TOPIC_FILTER_SAMPLEINFO_ARG;
  topic_filter.f.sampleinfo_arg = is_accepted;
  topic_filter.arg = filter.get();
  checked(dds_set_topic_filter_extended(filtered, &topic_filter), "topic filter");
  // Exists before the reader, so that no writer is missed.
  const std::unique_ptr<dds_listener_t, void (*)(dds_listener_t*)> listener(
      dds_create_listener(filter.get()), dds_delete_listener);
  dds_lset_subscription_matched(listener.get(), on_match);
  auto entity = std::make_shared<detail::Entity>(
      impl_->permitted(
          dds_create_reader(impl_->participant->handle, filtered, qos.get(), listener.get()),
          "reader of", topic.name),
      std::move(filter));
  if (options.ends_wait) {
    const std::int32_t condition =
        checked(dds_create_readcondition(entity->handle, DDS_ANY_STATE), "read condition");
    checked(dds_waitset_attach(impl_->waitset->handle, condition, 0), "waitset");
  }
  impl_->endpoints.push_back({entity, topic.name, true, entity->written});
  return entity;
}

std::shared_ptr<detail::Entity> Bus::make_writer(const topics::Topic& topic, bool keep_all) {
  const std::scoped_lock lock(impl_->mutex);
  const Qos qos = qos_of(topic.delivery, keep_all, impl_->identity);
  auto entity = std::make_shared<detail::Entity>(impl_->permitted(
      dds_create_writer(impl_->participant->handle, impl_->topic(topic.name, topic.descriptor),
                        qos.get(), nullptr),
      "writer of", topic.name));
  impl_->endpoints.push_back({entity, topic.name, false, entity->written});
  return entity;
}

bool Bus::wait(std::chrono::nanoseconds timeout) {
  return dds_waitset_wait(impl_->waitset->handle, nullptr, 0, timeout.count()) > 0;
}

bool keys_expired() { return detail::ExpiryWatch::has_ended_process(); }

std::int32_t Bus::participant() const { return impl_->participant->handle; }

std::vector<EndpointDescription> Bus::endpoints() {
  return detail::discovered_endpoints(impl_->participant->handle);
}

std::string Bus::why_not_admitted() {
  return detail::silence_text(detail::silent_deployments(impl_->participant->handle),
                              impl_->security ? impl_->security->files.folder.string() : "",
                              impl_->has_deployment);
}

std::map<std::string, std::uint64_t> Bus::sent() {
  const std::scoped_lock lock(impl_->mutex);
  std::map<std::string, std::uint64_t> by_topic;
  for (const Impl::Endpoint& endpoint : impl_->endpoints)
    if (!endpoint.reads) by_topic[endpoint.topic] += endpoint.written->sent;
  return by_topic;
}

std::map<std::string, std::uint64_t> Bus::take_not_sent() {
  const std::scoped_lock lock(impl_->mutex);
  std::map<std::string, std::uint64_t> by_topic;
  for (const Impl::Endpoint& endpoint : impl_->endpoints)
    if (const std::uint64_t count = endpoint.written->not_sent.exchange(0))
      by_topic[endpoint.topic] += count;
  return by_topic;
}

std::vector<RefusedSamples> Bus::take_refused() {
  const std::scoped_lock lock(impl_->mutex);
  std::vector<RefusedSamples> refused;
  for (Impl::Endpoint& endpoint : impl_->endpoints)
    if (const auto entity = endpoint.entity.lock(); entity && endpoint.reads) {
      for (const auto& [writer, count] : entity->filter->key_limit.take_refused())
        refused.push_back({RefusedSamples::Reason::too_many_keys, endpoint.topic, "",
                           endpoint.processes.of(entity->handle, writer), count});
      for (const auto& [writer, of_writer] : entity->filter->strangers.take_refused())
        refused.push_back({RefusedSamples::Reason::other_deployment, endpoint.topic,
                           of_writer.deployment, endpoint.processes.of(entity->handle, writer),
                           of_writer.samples});
    }
  for (const RefusedSamples& one : refused)
    impl_->has_stranger |= one.reason == RefusedSamples::Reason::other_deployment;
  return refused;
}

std::vector<std::string> Bus::problems() {
  const std::scoped_lock lock(impl_->mutex);
  std::vector<std::string> problems;
  if (impl_->has_stranger && !std::exchange(impl_->is_stranger_reported, true))
    problems.push_back("a program sends messages to deployment '" + impl_->deployment +
                       "' without being part of it, and they are refused (other_deployment): end "
                       "it, or let it state this deployment in the user data of its participant "
                       "and of its writers, as \"Your own programs\" in lab.md describes");
  for (const Impl::Endpoint& endpoint : impl_->endpoints) {
    const auto entity = endpoint.entity.lock();
    if (!entity) continue;
    std::uint32_t policy = 0, change = 0;
    if (endpoint.reads) {
      dds_requested_incompatible_qos_status_t status{};
      if (dds_get_requested_incompatible_qos_status(entity->handle, &status) == DDS_RETCODE_OK)
        policy = status.last_policy_id, change = std::uint32_t(status.total_count_change);
    } else {
      dds_offered_incompatible_qos_status_t status{};
      if (dds_get_offered_incompatible_qos_status(entity->handle, &status) == DDS_RETCODE_OK)
        policy = status.last_policy_id, change = std::uint32_t(status.total_count_change);
    }
    if (change)
      problems.push_back(std::string(endpoint.topic) + ": DDS refused a " +
                         (endpoint.reads ? "writer" : "reader") + " of another process: " +
                         policy_name(policy) + " (policy " + std::to_string(policy) + ")");
  }
  return problems;
}

}  // namespace fivepipe::bus
