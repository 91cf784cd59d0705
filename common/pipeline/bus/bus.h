// Typed and owning layer over Cyclone DDS. No other library calls Cyclone DDS. Messages are the
// plain structs that idlc generates.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/pipeline/bus/arrival_times.h"
#include "common/pipeline/bus/callback_order.h"
#include "common/pipeline/bus/key_limit.h"
#include "common/pipeline/bus/process_id.h"
#include "common/pipeline/bus/profile.h"
#include "common/pipeline/bus/strangers.h"
#include "common/pipeline/bus/topics.h"
#include "common/pipeline/bus/writer_processes.h"

namespace fivepipe::bus {

struct BusError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct SampleInfo {
  bool valid;                    // false: only the key's state changed (disposed, or no writer)
  bool writer_gone;              // the key has no writer any more
  std::uint64_t writer;          // publication handle; see Reader::process() for an identity
  std::int64_t source_stamp_ns;  // CLOCK_REALTIME at the write
  // CLOCK_REALTIME at the arrival in this process; if that is no longer known, a later time, but
  // not after the arrival of any later sample whose time is known
  std::int64_t arrived_ns;
};

namespace detail {
struct WriteCounts {
  std::atomic<std::uint64_t> sent{0}, not_sent{0};  // samples written and dropped
};
// What DDS calls for each sample that arrives at a reader.
struct ReaderFilter {
  ReaderFilter(std::size_t max_keys, std::string deployment)
      : key_limit(max_keys), strangers(std::move(deployment)) {
    order.pass();
  }
  ~ReaderFilter() { order.pass(); }
  // The reader has a new match with the writer, or the match has ended.
  void report_match(std::int32_t reader, std::uint64_t writer, bool is_new) {
    const Callback callback(order);
    if (is_new)
      strangers.matched(reader, writer);
    else
      strangers.unmatched(writer);
  }
  CallbackOrder order;
  KeyLimit key_limit;
  Strangers strangers;
  ArrivalTimes arrival_times;
};
struct Entity {  // owns a DDS entity
  explicit Entity(std::int32_t entity_handle, std::unique_ptr<ReaderFilter> reader_filter = nullptr)
      : handle(entity_handle), filter(std::move(reader_filter)) {}
  ~Entity();
  Entity(const Entity&) = delete;
  Entity& operator=(const Entity&) = delete;
  const std::int32_t handle;
  // Shared, because the bus reports the counts of a writer that is gone.
  const std::shared_ptr<WriteCounts> written = std::make_shared<WriteCounts>();
  const std::unique_ptr<ReaderFilter> filter;  // of a reader; outlives it
};
struct LoanedSamples {  // memory that the reader owns, until return_loan()
  std::vector<void*> samples;
  std::vector<SampleInfo> infos;
  std::vector<bool> is_strangers;  // of another deployment
};
LoanedSamples take(Entity& reader);
void return_loan(std::int32_t reader, LoanedSamples& taken);
void write(Entity& writer, const void* message, const char* topic);
bool wait_for_acks(std::int32_t writer, std::chrono::nanoseconds timeout);
int matched_readers(std::int32_t writer);
int matched_writers(const Entity& reader);  // of its deployment
}  // namespace detail

template <class Topic>
class Batch;

// One sample. Valid while its Batch exists. Dereference it if valid(); otherwise only the
// fields of the key are defined.
template <class Topic>
class Sample {
 public:
  Sample(const void* message, const SampleInfo& info)
      : message_(static_cast<const typename Topic::Message*>(message)), info_(info) {}
  const typename Topic::Message& operator*() const { return *message_; }
  const typename Topic::Message* operator->() const { return message_; }
  bool valid() const { return info_.valid; }
  bool writer_gone() const { return info_.writer_gone; }
  std::uint64_t writer() const { return info_.writer; }
  std::int64_t source_stamp_ns() const { return info_.source_stamp_ns; }
  std::int64_t arrived_ns() const { return info_.arrived_ns; }

 private:
  const typename Topic::Message* message_;
  SampleInfo info_;
};

// The samples of one take() in the order of DDS: by key, each key by age, oldest first. Holds the
// reader's loan: destroy it before the next take().
template <class Topic>
class Batch {
 public:
  Batch(std::int32_t reader, detail::LoanedSamples taken)
      : reader_(reader), loan_(std::move(taken)) {
    for (std::size_t i = 0; i < loan_.infos.size(); ++i)
      if (!loan_.is_strangers[i]) samples_.emplace_back(loan_.samples[i], loan_.infos[i]);
  }
  ~Batch() { detail::return_loan(reader_, loan_); }
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;
  auto begin() const { return samples_.begin(); }
  auto end() const { return samples_.end(); }
  bool empty() const { return samples_.empty(); }
  std::size_t size() const { return samples_.size(); }

 private:
  std::int32_t reader_;
  detail::LoanedSamples loan_;
  std::vector<Sample<Topic>> samples_;
};

template <class Topic>
class Reader {
 public:
  explicit Reader(std::shared_ptr<detail::Entity> entity) : entity_(std::move(entity)) {}
  // Returns the samples that arrived since the last take(), at most 64. Never waits.
  Batch<Topic> take() { return Batch<Topic>(entity_->handle, detail::take(*entity_)); }
  // Returns the process that wrote the sample. Returns nullopt if its participant states no
  // identity (another program, an older version), or if the writer was gone at the first call for
  // it.
  std::optional<ProcessId> process(const Sample<Topic>& sample) { return process(sample.writer()); }
  std::optional<ProcessId> process(std::uint64_t writer) {  // Sample::writer()
    return processes_.of(entity_->handle, writer);
  }
  // Number of matched writers of the deployment.
  int writers() const { return detail::matched_writers(*entity_); }

 private:
  std::shared_ptr<detail::Entity> entity_;
  detail::WriterProcesses processes_;
};

template <class Topic>
class Writer {
 public:
  explicit Writer(std::shared_ptr<detail::Entity> entity) : entity_(std::move(entity)) {}
  // Copies and sends the message. While more bytes than the profile's WhcHigh are not acknowledged,
  // because readers were killed or are too slow, waits at most 100 ms, then drops the sample and
  // counts it in Bus::take_not_sent(). Throws BusError if DDS refuses the message for another
  // reason.
  void write(const typename Topic::Message& message) {
    detail::write(*entity_, &message, Topic::name);
  }
  // Waits until every reader has acknowledged all samples. Returns false after `timeout`.
  bool wait_for_delivery(std::chrono::nanoseconds timeout) {
    return detail::wait_for_acks(entity_->handle, timeout);
  }
  // Number of matched readers. Use it to skip the work for messages without a reader.
  int readers() const { return detail::matched_readers(entity_->handle); }

 private:
  std::shared_ptr<detail::Entity> entity_;
};

// Returns whether the keys of this process expire and a bus has therefore sent it SIGTERM. Its exit
// code should be 2.
bool keys_expired();

struct BusOptions {
  std::uint32_t domain = 0;
  Network network = {};          // the environment variable CYCLONEDDS_URI overrides its profile
  std::string participant = "";  // name that other processes see, such as the node's
  // Name of the deployment whose messages the readers accept. Empty: those of all.
  std::string deployment = "";
  // Requests acknowledgements within milliseconds instead of 100 ms. Makes wait_for_delivery()
  // fast.
  bool frequent_heartbeats = false;
};

// A reader or a writer of any process in the domain.
struct EndpointDescription {
  std::string topic, type;
  bool writes;
  bool own;                                // belongs to this Bus
  std::string guid, participant_guid;      // 32 hexadecimal digits each
  std::string participant;                 // BusOptions::participant; empty: none
  std::string deployment;                  // BusOptions::deployment; empty: none
  std::map<std::string, std::string> qos;  // such as "history": "keep_last 8"
};

// Samples that the readers of a bus refused.
struct RefusedSamples {
  enum class Reason { too_many_keys, other_deployment };
  Reason reason;
  std::string topic;
  std::string deployment;  // of the writer; empty: it states none, or another reason
  // Of the writer; see Reader::process(). Also nullopt for writers beyond KeyLimit::kMaxWriters.
  std::optional<ProcessId> process;
  std::uint64_t count = 0;
};

// "process 4711 on host alpha of deployment demo".
inline std::string text_of(const RefusedSamples& refused) {
  return text_of(refused.process) + (refused.deployment.empty()
                                         ? " of no deployment"
                                         : " of deployment " + refused.deployment);
}

// A DDS participant with its readers and writers, which must not outlive it. Thread-safe, except
// that each reader and each writer must be used by one thread at a time.
class Bus {
 public:
  // Throws BusError. With security, the process gets SIGTERM 15 s before its keys expire.
  explicit Bus(const BusOptions& options);
  ~Bus();
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  template <class Topic>
  Reader<Topic> reader() {
    return Reader<Topic>(make_reader(topics::described<Topic>()));
  }
  // A reader whose samples do not end wait(), for a thread that takes them now and then.
  template <class Topic>
  Reader<Topic> polled_reader() {
    return Reader<Topic>(make_reader(topics::described<Topic>(), {.ends_wait = false}));
  }
  template <class Topic>
  Writer<Topic> writer() {
    return Writer<Topic>(make_writer(topics::described<Topic>()));
  }

  // Waits until a reader of this bus has a sample. Returns false after `timeout`.
  bool wait(std::chrono::nanoseconds timeout);

  // Returns texts for people: each topic and policy in which DDS refused peers since the last call
  // because their type or QoS differs, and once that take_refused() has counted other_deployment.
  std::vector<std::string> problems();
  // Returns the samples that the readers refused since the last call, by writer: the writer uses
  // more keys of the topic than detail::KeyLimit accepts, or it is not of BusOptions::deployment.
  std::vector<RefusedSamples> take_refused();
  // Returns the number of samples dropped since the last call, by topic.
  std::map<std::string, std::uint64_t> take_not_sent();
  // Returns the number of samples written since the start, by topic. A reader that receives all
  // samples counts the same number.
  std::map<std::string, std::uint64_t> sent();
  // Returns the readers and writers that discovery has found, including those of this process.
  // Discovery takes up to 1 s after the start.
  std::vector<EndpointDescription> endpoints();
  // Returns a text for people if discovery has found a deployment that exchanges no messages with
  // this process, with the possible causes: security, the network, or a process that is starting.
  // Empty if there is none.
  // Call it after discovery: a process that starts has no readers and writers yet.
  std::string why_not_admitted();
  // Names the kernel setting to change if the receive buffer is smaller than the profile requests,
  // keys that other users can read, and keys that expire soon; empty otherwise.
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  friend class SerializedReader;
  friend class SerializedWriter;
  struct Impl;
  struct ReaderOptions {
    bool keep_all = false;
    bool ends_wait = true;
  };
  std::shared_ptr<detail::Entity> make_reader(const topics::Topic& topic,
                                              const ReaderOptions& options = {false, true});
  std::shared_ptr<detail::Entity> make_writer(const topics::Topic& topic, bool keep_all = false);
  std::int32_t participant() const;
  std::unique_ptr<Impl> impl_;
  std::vector<std::string> warnings_;
};

}  // namespace fivepipe::bus
