// When the samples of a reader arrived in this process. Internal to bus.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>

namespace fivepipe::bus::detail {

// DDS states when a sample was written, but not when it arrived. Thread-safe: DDS calls add() in
// its receive threads.
class ArrivalTimes {
 public:
  // Maximum number of times; a further one displaces the oldest. A reader of the tiles of a stereo
  // view (8 x 6 tiles in two eyes) holds up to 768 samples.
  static constexpr std::size_t kMaxSamples = 1024;

  // The publication handle of the writer and the source timestamp identify a sample. arrived_ns:
  // CLOCK_REALTIME.
  void add(std::uint64_t writer, std::int64_t source_stamp_ns, std::int64_t arrived_ns);
  // Returns the time of the sample that arrived last. If it was displaced, returns the oldest known
  // time, which is later. Returns nullopt if no such sample has arrived.
  std::optional<std::int64_t> of(std::uint64_t writer, std::int64_t source_stamp_ns) const;

 private:
  struct Arrival {
    std::uint64_t writer = 0;  // 0: none
    std::int64_t source_stamp_ns = 0, arrived_ns = 0;
  };
  mutable std::mutex mutex_;
  std::array<Arrival, kMaxSamples> arrivals_;  // ring buffer
  std::size_t next_ = 0;                       // its oldest element
};

}  // namespace fivepipe::bus::detail
