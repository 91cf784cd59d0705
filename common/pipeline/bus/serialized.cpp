#include "common/pipeline/bus/serialized.h"

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_protocol.h>

#include <unistd.h>

#include <array>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "common/base/containers/bounded_map.h"
#include "common/pipeline/bus/cdr_padding.h"
#include "common/pipeline/bus/checked.h"
#include "common/pipeline/bus/discovery.h"

namespace fivepipe::bus {
namespace {

using detail::checked;

constexpr std::uint32_t kMaxSerializedPerTake = 256;
// Encapsulation: representation identifier and options.
constexpr std::size_t kHeaderBytes = 4;

struct Serdata {
  explicit Serdata(ddsi_serdata* taken) : data(taken) {}
  ~Serdata() { ddsi_serdata_unref(data); }
  Serdata(const Serdata&) = delete;
  Serdata& operator=(const Serdata&) = delete;
  ddsi_serdata* data;
};

std::uint32_t status_info_of(SampleKind kind) {
  switch (kind) {
    case SampleKind::data: return 0;
    case SampleKind::disposed: return NN_STATUSINFO_DISPOSE;
    case SampleKind::unregistered: break;
  }
  return NN_STATUSINFO_UNREGISTER;
}

// Returns how Cyclone DDS serialises the topic's type. This version has no call for it, so the
// function writes a sample to itself on a topic that no other process uses.
ddsi_sertype* type_of(dds_entity_t participant, const topics::Topic& described) {
  const std::string own_name = std::string(described.name) + "/type/" + std::to_string(getpid());
  const detail::Entity topic(checked(
      dds_create_topic(participant, described.descriptor, own_name.c_str(), nullptr, nullptr),
      own_name));
  const detail::Entity reader(
      checked(dds_create_reader(participant, topic.handle, nullptr, nullptr), own_name));
  const detail::Entity writer(
      checked(dds_create_writer(participant, topic.handle, nullptr, nullptr), own_name));
  const std::vector<std::byte> zeros(described.descriptor->m_size);
  checked(dds_write(writer.handle, zeros.data()), own_name);
  ddsi_serdata* taken = nullptr;
  dds_sample_info_t info;
  if (dds_takecdr(reader.handle, &taken, 1, &info, DDS_ANY_STATE) != 1)
    throw BusError(std::string(described.name) +
                   ": cannot determine how Cyclone DDS serialises the type");
  const Serdata sample(taken);
  return ddsi_sertype_ref(sample.data->type);
}

}  // namespace

// Describes each writer when DDS discovers it: the writer may be gone when its samples are taken.
struct SerializedReader::Writers {
  // The oldest descriptions are forgotten.
  static constexpr std::size_t kMaxDescribed = 4096;
  mutable std::mutex mutex;
  base::BoundedMap<std::uint64_t, WriterDescription> by_handle{kMaxDescribed};

  detail::CallbackOrder order;
  detail::ReaderFilter* filter = nullptr;  // of the reader

  Writers() { order.pass(); }
  ~Writers() { order.pass(); }
  void add_writer(dds_entity_t reader, dds_instance_handle_t handle) {
    dds_builtintopic_endpoint_t* described = dds_get_matched_publication_data(reader, handle);
    if (!described) return;
    const WriterDescription writer{detail::guid_text(described->key),
                                   detail::guid_text(described->participant_key),
                                   detail::qos_text(described->qos)};
    dds_builtintopic_free_endpoint(described);
    const std::scoped_lock lock(mutex);
    by_handle.set(handle, writer);
  }
  static void matched(dds_entity_t reader, dds_subscription_matched_status_t status,
                      void* writers) {
    auto& known = *static_cast<Writers*>(writers);
    const detail::Callback callback(known.order);
    const bool is_new = status.current_count_change > 0;
    known.filter->report_match(reader, status.last_publication_handle, is_new);
    if (is_new) known.add_writer(reader, status.last_publication_handle);
  }
};

SerializedReader::SerializedReader(Bus& bus, const topics::Topic& topic)
    : writers_(std::make_unique<Writers>()), entity_(bus.make_reader(topic, {.keep_all = true})) {
  writers_->filter = entity_->filter.get();
  writers_->order.pass();
  const std::unique_ptr<dds_listener_t, void (*)(dds_listener_t*)> listener(
      dds_create_listener(writers_.get()), dds_delete_listener);
  dds_lset_subscription_matched(listener.get(), Writers::matched);
  checked(dds_set_listener(entity_->handle, listener.get()), topic.name);
  // The listener does not report writers that matched before it was set.
  std::vector<dds_instance_handle_t> matched(64);
  const auto count_of_all = [&] {
    return std::size_t(checked(
        dds_get_matched_publications(entity_->handle, matched.data(), matched.size()), topic.name));
  };
  std::size_t count = 0;
  while ((count = count_of_all()) > matched.size()) matched.resize(count);
  matched.resize(count);
  for (const dds_instance_handle_t writer : matched) writers_->add_writer(entity_->handle, writer);
}

SerializedReader::~SerializedReader() = default;
SerializedReader::SerializedReader(SerializedReader&&) noexcept = default;

namespace {

void deliver(ddsi_serdata* data, SampleKind kind, const dds_sample_info_t& info,
             const std::function<void(const SerializedSample&)>& each) {
  ddsrt_iovec_t bytes;
  ddsi_serdata* held = ddsi_serdata_to_ser_ref(data, 0, ddsi_serdata_size(data), &bytes);
  each({kind,
        info.publication_handle,
        info.source_timestamp,
        {static_cast<const std::byte*>(bytes.iov_base), bytes.iov_len}});
  ddsi_serdata_to_ser_unref(held, &bytes);
}

}  // namespace

std::size_t SerializedReader::take(const std::function<void(const SerializedSample&)>& each) {
  std::array<ddsi_serdata*, kMaxSerializedPerTake> taken{};
  std::array<dds_sample_info_t, kMaxSerializedPerTake> infos;
  // If data of the key was not taken yet, a change of the key's state has no sample of its own.
  struct Change {
    std::shared_ptr<Serdata> key;
    dds_sample_info_t info;
  };
  std::map<dds_instance_handle_t, Change> changes;
  std::size_t all = 0;
  for (std::uint32_t count = kMaxSerializedPerTake; count == kMaxSerializedPerTake;) {
    count = std::uint32_t(checked(dds_takecdr(entity_->handle, taken.data(), kMaxSerializedPerTake,
                                              infos.data(), DDS_ANY_STATE),
                                  "dds_takecdr"));
    for (std::size_t i = 0; i < count; ++i) {
      const Serdata sample(taken[i]);
      if (entity_->filter->strangers.contains(infos[i].publication_handle)) {
        entity_->filter->key_limit.update(infos[i]);
        continue;
      }
      if (infos[i].valid_data) {
        deliver(sample.data, SampleKind::data, infos[i], each);
        ++all;
      }
      entity_->filter->key_limit.update(infos[i]);
      if (infos[i].instance_state != DDS_IST_ALIVE)
        changes[infos[i].instance_handle] = {
            std::make_shared<Serdata>(infos[i].valid_data ? ddsi_serdata_to_untyped(sample.data)
                                                          : ddsi_serdata_ref(sample.data)),
            infos[i]};
      else
        changes.erase(infos[i].instance_handle);
    }
  }
  for (const auto& [instance, change] : changes)
    deliver(change.key->data,
            change.info.instance_state == DDS_IST_NOT_ALIVE_DISPOSED ? SampleKind::disposed
                                                                     : SampleKind::unregistered,
            change.info, each);
  return all + changes.size();
}

std::optional<WriterDescription> SerializedReader::writer(std::uint64_t handle) const {
  const std::scoped_lock lock(writers_->mutex);
  const WriterDescription* known = writers_->by_handle.find(handle);
  return known ? std::optional(*known) : std::nullopt;
}

int SerializedReader::writers() const { return detail::matched_writers(*entity_); }

SerializedWriter::SerializedWriter(Bus& bus, const topics::Topic& topic, WriterHistory history)
    : topic_(topic.name),
      entity_(bus.make_writer(topic, history == WriterHistory::keep_all &&
                                         topic.delivery != topics::Delivery::latched)),
      type_(type_of(bus.participant(), topic)) {}

SerializedWriter::~SerializedWriter() { ddsi_sertype_unref(type_); }

bool SerializedWriter::write(const SerializedSample& sample) {
  if (sample.cdr.size() < kHeaderBytes)
    throw BusError(topic_ + ": " + std::to_string(sample.cdr.size()) +
                   " bytes are not a serialised message");
  std::vector<std::byte> padded;  // the key of a changed state is recorded without padding
  if (sample.cdr.size() % 4 != 0) padded = detail::padded_to_words(sample.cdr);
  const std::span<const std::byte> cdr = padded.empty() ? sample.cdr : padded;
  ddsrt_iovec_t bytes;
  // The C interface lacks const; Cyclone DDS only reads.
  bytes.iov_base = const_cast<std::byte*>(cdr.data());
  bytes.iov_len = cdr.size();
  ddsi_serdata* data = ddsi_serdata_from_ser_iov(
      type_, sample.kind == SampleKind::data ? SDK_DATA : SDK_KEY, 1, &bytes, bytes.iov_len);
  if (!data)
    throw BusError(topic_ + ": " + std::to_string(sample.cdr.size()) +
                   " bytes are not a message of this type");
  data->statusinfo = status_info_of(sample.kind);
  data->timestamp.v = sample.source_stamp_ns;
  const dds_return_t result =
      dds_forwardcdr(entity_->handle, data);  // takes the reference also if it fails
  if (result == DDS_RETCODE_TIMEOUT) {
    ++entity_->written->not_sent;
    return false;
  }
  checked(result, "writing " + topic_);
  ++entity_->written->sent;
  return true;
}

int SerializedWriter::readers() const { return detail::matched_readers(entity_->handle); }
bool SerializedWriter::wait_for_delivery(std::chrono::nanoseconds timeout) {
  return detail::wait_for_acks(entity_->handle, timeout);
}

}  // namespace fivepipe::bus
