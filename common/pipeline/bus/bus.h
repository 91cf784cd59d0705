// Typed, owning layer over Cyclone DDS: the only code that calls it. Messages are idlc's plain
// structs.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/pipeline/bus/topics.h"

namespace fivepipe::bus {

struct BusError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct SampleInfo {
  bool valid;  // false: only the state of the key changed (its writer disposed it or went away)
  bool writer_gone;      // no writer of this key is left
  std::uint64_t writer;  // publication handle: tells a restarted process from its predecessor
  std::int64_t source_stamp_ns;  // CLOCK_REALTIME when written
};

namespace detail {
struct WriteCounts {
  std::atomic<std::uint64_t> sent{0}, not_sent{0};  // samples written, and given up
};
struct Entity {  // a DDS entity handle, deleted with its owner
  explicit Entity(std::int32_t entity_handle) : handle(entity_handle) {}
  ~Entity();
  Entity(const Entity&) = delete;
  Entity& operator=(const Entity&) = delete;
  const std::int32_t handle;
  const std::shared_ptr<WriteCounts> written =
      std::make_shared<WriteCounts>();  // outlives a writer: its last samples count too
};
struct LoanedSamples {  // samples on loan from a reader
  std::vector<void*> samples;
  std::vector<SampleInfo> infos;
};
LoanedSamples take(std::int32_t reader);
void return_loan(std::int32_t reader, LoanedSamples& taken);
void write(Entity& writer, const void* message, const char* topic);
bool wait_for_acks(std::int32_t writer, std::chrono::nanoseconds timeout);
int matched_readers(std::int32_t writer);
int matched_writers(std::int32_t reader);
}  // namespace detail

template <class Topic>
class Batch;

// One sample, valid while its Batch lives. Dereference only where valid().
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

 private:
  const typename Topic::Message* message_;
  SampleInfo info_;
};

// What one take returned, in DDS's order (by key, each key oldest first). Holds the reader's loan:
// destroy it before the next take().
template <class Topic>
class Batch {
 public:
  Batch(std::int32_t reader, detail::LoanedSamples taken)
      : reader_(reader), loan_(std::move(taken)) {
    for (std::size_t i = 0; i < loan_.infos.size(); ++i)
      samples_.emplace_back(loan_.samples[i], loan_.infos[i]);
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
  // All that has arrived since the last take, at most 64 samples; never waits.
  Batch<Topic> take() { return Batch<Topic>(entity_->handle, detail::take(entity_->handle)); }
  int writers() const { return detail::matched_writers(entity_->handle); }

 private:
  std::shared_ptr<detail::Entity> entity_;
};

template <class Topic>
class Writer {
 public:
  explicit Writer(std::shared_ptr<detail::Entity> entity) : entity_(std::move(entity)) {}
  // Copies and sends; the message may be reused at once. Where readers take nothing in for 100 ms
  // (one was killed, or starves) the sample is given up and counted in Bus::take_not_sent. Throws
  // BusError where DDS refuses it for another reason.
  void write(const typename Topic::Message& message) {
    detail::write(*entity_, &message, Topic::name);
  }
  // Until every reader has what was written; false when the time is up.
  bool wait_for_delivery(std::chrono::nanoseconds timeout) {
    return detail::wait_for_acks(entity_->handle, timeout);
  }
  // How many readers are there now: nothing is made that nobody reads.
  int readers() const { return detail::matched_readers(entity_->handle); }

 private:
  std::shared_ptr<detail::Entity> entity_;
};

struct BusOptions {
  std::uint32_t domain = 0;
  std::string profile =
      "loopback";  // shipped in launch/profiles; CYCLONEDDS_URI in the environment wins
  std::string participant = "";  // what others see it as: a node's name
  bool frequent_heartbeats =
      false;  // within milliseconds, not a tenth of a second: for who waits for delivery often
};

// A reader or a writer anywhere on the network.
struct EndpointDescription {
  std::string topic, type;
  bool writes;
  bool own;                            // of this Bus
  std::string guid, participant_guid;  // 32 hexadecimal digits each
  std::string participant;             // the name it gives itself; empty: none
  std::map<std::string, std::string>
      qos;  // "reliability": "reliable", "history": "keep_last 8", ..
};

// A participant with its readers and writers. Readers and writers must not outlive it.
class Bus {
 public:
  explicit Bus(const BusOptions& options);  // throws BusError
  ~Bus();
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  template <class Topic>
  Reader<Topic> reader() {
    return Reader<Topic>(make_reader(Topic::name, Topic::descriptor, Topic::delivery));
  }
  template <class Topic>
  Writer<Topic> writer() {
    return Writer<Topic>(make_writer(Topic::name, Topic::descriptor, Topic::delivery));
  }

  // Until a reader of this bus has something to take, or the time is up. True where there is
  // something.
  bool wait(std::chrono::nanoseconds timeout);

  // What went wrong since the last call, for people: peers refused for another type or QoS (by
  // topic and policy).
  std::vector<std::string> problems();
  // Samples given up since the last call, by topic.
  std::map<std::string, std::uint64_t> take_not_sent();
  // Samples written since the start, by topic: who reads them all must come to the same number.
  std::map<std::string, std::uint64_t> sent();
  // Whoever writes or reads on this network now, as discovery tells it; this process too. Empty
  // right after the start: it takes a moment.
  std::vector<EndpointDescription> endpoints();
  // Said once at start: a receive buffer smaller than the profile asks for, and what to set.
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  friend class SerializedReader;
  friend class SerializedWriter;
  struct Impl;
  std::shared_ptr<detail::Entity> make_reader(const char* name,
                                              const dds_topic_descriptor_t* descriptor,
                                              topics::Delivery delivery, bool keep_all = false);
  std::shared_ptr<detail::Entity> make_writer(const char* name,
                                              const dds_topic_descriptor_t* descriptor,
                                              topics::Delivery delivery, bool keep_all = false);
  std::int32_t participant() const;
  std::unique_ptr<Impl> impl_;
  std::vector<std::string> warnings_;
};

}  // namespace fivepipe::bus
