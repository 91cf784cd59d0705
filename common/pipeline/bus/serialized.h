// Reads and writes samples in their serialized form with source timestamp, writer and changes of
// the key's state, for recording and replay. Only serialized.cpp uses internal headers of Cyclone
// DDS.
#pragma once
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/pipeline/bus/bus.h"

struct ddsi_sertype;

namespace fivepipe::bus {

// data: a message. disposed: a writer disposed the key. unregistered: the key has no writer any
// more. The payload of the last two contains only the key.
enum class SampleKind { data, disposed, unregistered };

struct SerializedSample {
  SampleKind kind = SampleKind::data;
  std::uint64_t writer = 0;          // publication handle, valid in this process
  std::int64_t source_stamp_ns = 0;  // CLOCK_REALTIME at the write
  std::span<const std::byte> cdr;    // begins with the 4 bytes of encapsulation
};

// A writer as discovery describes it.
struct WriterDescription {
  std::string guid;  // 32 hexadecimal digits
  std::string participant_guid;
  std::map<std::string, std::string> qos;  // such as "history": "keep_last 8"
};

// Keeps all samples until take(), for each kind of delivery. Call take() often to bound the memory.
// The Bus must outlive it.
class SerializedReader {
 public:
  SerializedReader(Bus& bus, const topics::Topic& topic);
  ~SerializedReader();
  SerializedReader(SerializedReader&&) noexcept;

  // Calls `each` for every sample since the last call, in the order of DDS (by key, each key oldest
  // first) and with changes of keys' states last. A sample is valid during the call only. Returns
  // the number of samples. Never waits.
  std::size_t take(const std::function<void(const SerializedSample&)>& each);
  // Describes a writer that has existed since the construction of this reader, also if it has
  // disappeared. Returns nullopt for any other handle.
  std::optional<WriterDescription> writer(std::uint64_t handle) const;
  int writers() const;

 private:
  struct Writers;
  std::unique_ptr<Writers> writers_;  // outlives entity_, whose listener fills it
  std::shared_ptr<detail::Entity> entity_;
};

// keep_all: write() waits for slow readers. topic: the history of the topic's delivery.
enum class WriterHistory { topic, keep_all };

class SerializedWriter {
 public:
  SerializedWriter(Bus& bus, const topics::Topic& topic, WriterHistory history);
  ~SerializedWriter();
  SerializedWriter(const SerializedWriter&) = delete;
  SerializedWriter& operator=(const SerializedWriter&) = delete;

  // Returns false if the readers had no free space for 100 ms; the sample is then not written.
  // Throws BusError if the bytes are not a message (or a key) of the topic, or if DDS refuses it.
  bool write(const SerializedSample& sample);
  int readers() const;
  bool wait_for_delivery(std::chrono::nanoseconds timeout);

 private:
  std::string topic_;
  std::shared_ptr<detail::Entity> entity_;
  ::ddsi_sertype* type_ = nullptr;
};

}  // namespace fivepipe::bus
