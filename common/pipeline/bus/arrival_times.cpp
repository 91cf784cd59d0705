#include "common/pipeline/bus/arrival_times.h"

namespace fivepipe::bus::detail {

void ArrivalTimes::add(std::uint64_t writer, std::int64_t source_stamp_ns,
                       std::int64_t arrived_ns) {
  const std::scoped_lock lock(mutex_);
  arrivals_[next_] = {writer, source_stamp_ns, arrived_ns};
  next_ = (next_ + 1) % kMaxSamples;
}

std::optional<std::int64_t> ArrivalTimes::of(std::uint64_t writer,
                                             std::int64_t source_stamp_ns) const {
  const std::scoped_lock lock(mutex_);
  for (std::size_t i = 1; i <= kMaxSamples; ++i) {
    const Arrival& arrival = arrivals_[(next_ + kMaxSamples - i) % kMaxSamples];
    if (arrival.writer == 0) return std::nullopt;
    if (arrival.writer == writer && arrival.source_stamp_ns == source_stamp_ns)
      return arrival.arrived_ns;
  }
  return arrivals_[next_].arrived_ns;
}

}  // namespace fivepipe::bus::detail
