// Samples as they are on the wire, for who records and replays them: read and written verbatim,
// with source time stamp, writer and changes of the key's state. The only code that uses Cyclone
// DDS's internal headers is serialized.cpp.
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

// data: the whole message. disposed: by its writer; unregistered: no writer of the key is left.
// Their payload holds the key alone.
enum class SampleKind { data, disposed, unregistered };

struct SerializedSample {
  SampleKind kind = SampleKind::data;
  std::uint64_t writer = 0;          // publication handle, in this process
  std::int64_t source_stamp_ns = 0;  // CLOCK_REALTIME when written
  std::span<const std::byte> cdr;    // with its 4 bytes of encapsulation
};

// Who writes, as discovery tells it.
struct WriterDescription {
  std::string guid;  // 32 hexadecimal digits
  std::string participant_guid;
  std::map<std::string, std::string>
      qos;  // "reliability": "reliable", "history": "keep_last 8", ..
};

// Keeps everything until it is taken, whatever the topic's delivery: take often. The Bus must
// outlive it.
class SerializedReader {
 public:
  SerializedReader(Bus& bus, const topics::Topic& topic);
  ~SerializedReader();
  SerializedReader(SerializedReader&&) noexcept;

  // All that has arrived since the last call, in the order that DDS hands it out (by key, each
  // oldest first), changes of keys' states last; never waits. Samples live during the call to
  // `each` alone. How many there were.
  std::size_t take(const std::function<void(const SerializedSample&)>& each);
  // Of any writer that was there since this reader is, even if it is gone by now.
  std::optional<WriterDescription> writer(std::uint64_t handle) const;
  int writers() const;

 private:
  struct Writers;
  std::unique_ptr<Writers> writers_;  // outlives the reader, whose listener fills it
  std::shared_ptr<detail::Entity> entity_;
};

// keep_all: write waits for slow readers. topic: as the topic's delivery says.
enum class WriterHistory { topic, keep_all };

class SerializedWriter {
 public:
  SerializedWriter(Bus& bus, const topics::Topic& topic, WriterHistory history);
  ~SerializedWriter();
  SerializedWriter(const SerializedWriter&) = delete;
  SerializedWriter& operator=(const SerializedWriter&) = delete;

  // False: readers took nothing in for 100 ms; nothing was written. Throws BusError where the bytes
  // are no message of the topic (or no key of it), or DDS refuses it.
  bool write(const SerializedSample& sample);
  int readers() const;
  bool wait_for_delivery(std::chrono::nanoseconds timeout);

 private:
  std::string topic_;
  std::shared_ptr<detail::Entity> entity_;
  ::ddsi_sertype* type_ = nullptr;
};

}  // namespace fivepipe::bus
