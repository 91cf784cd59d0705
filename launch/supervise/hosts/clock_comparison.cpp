#include "launch/supervise/hosts/clock_comparison.h"

#include <algorithm>

#include "common/base/realtime.h"

namespace fivepipe::launch {

void ClockComparison::add(const ClockExchange& exchange) {
  using base::difference_ns;
  const std::int64_t round_trip_ns = difference_ns(exchange.own_received_ns, exchange.own_sent_ns),
                     there_ns =
                         difference_ns(exchange.their_sent_ns, exchange.their_received_ns),
                     on_the_way_ns = difference_ns(round_trip_ns, there_ns);
  if (round_trip_ns < 0 || there_ns < 0 || on_the_way_ns < 0) return;
  const std::int64_t error_ns = on_the_way_ns / 2 + 1;  // rounded up
  // The first message took between 0 and on_the_way_ns.
  newest_.push_back(
      {difference_ns(difference_ns(exchange.their_received_ns, exchange.own_sent_ns), error_ns),
       error_ns});
  if (newest_.size() > kExchanges) newest_.pop_front();
}

std::optional<ClockOffset> ClockComparison::offset() const {
  const auto best = std::min_element(newest_.begin(), newest_.end(),
                                     [](const ClockOffset& a, const ClockOffset& b) {
                                       return a.error_ns < b.error_ns;
                                     });
  return best == newest_.end() ? std::nullopt : std::optional(*best);
}

}  // namespace fivepipe::launch
