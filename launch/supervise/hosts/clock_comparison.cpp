#include "launch/supervise/hosts/clock_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/realtime.h"

namespace fivepipe::launch {

using base::difference_ns;
using base::distance_ns;

namespace {

// How far the clocks drift apart in this time, rounded up.
std::int64_t drift_ns(std::int64_t time_ns) {
  return std::int64_t(std::ceil(ClockComparison::kMaxDrift * double(time_ns)));
}

}  // namespace

void ClockComparison::add(const ClockExchange& exchange) {
  const std::int64_t round_trip_ns = difference_ns(exchange.own_received_ns, exchange.own_sent_ns),
                     there_ns = difference_ns(exchange.their_sent_ns, exchange.their_received_ns),
                     on_the_way_ns = difference_ns(round_trip_ns, there_ns);
  if (round_trip_ns < 0 || there_ns < 0 || on_the_way_ns < 0) return;
  // The first message took between 0 and on_the_way_ns.
  const std::int64_t half_ns = on_the_way_ns / 2;
  const Measured measured{
      {difference_ns(difference_ns(exchange.their_received_ns, exchange.own_sent_ns), half_ns),
       half_ns + 1 + drift_ns(round_trip_ns)},
      exchange.own_received_ns};
  if (const auto known = offset(measured.own_ns);
      known && distance_ns(known->offset_ns, measured.offset.offset_ns) >
                   known->error_ns + measured.offset.error_ns)
    newest_.clear();
  newest_.push_back(measured);
  if (newest_.size() > kExchanges) newest_.pop_front();
}

ClockOffset ClockComparison::at(const Measured& measured, std::int64_t now_ns) {
  return {measured.offset.offset_ns,
          measured.offset.error_ns + drift_ns(distance_ns(now_ns, measured.own_ns))};
}

std::optional<ClockOffset> ClockComparison::offset(std::int64_t now_ns) const {
  std::optional<ClockOffset> best;
  for (const Measured& measured : newest_)
    if (const ClockOffset offset = at(measured, now_ns); !best || offset.error_ns < best->error_ns)
      best = offset;
  return best;
}

ClockVerdict verdict_on(const ClockOffset& offset) {
  const std::int64_t at_least_ns = difference_ns(distance_ns(offset.offset_ns, 0), offset.error_ns);
  if (at_least_ns > kClockLimit_ns) return ClockVerdict::refused;
  return at_least_ns > kClockWarning_ns ? ClockVerdict::warning : ClockVerdict::good;
}

std::string text_of(const ClockOffset& offset) {
  return fmt::format("{:.2f} ms {} (error at most {:.2f} ms)",
                     1e-6 * double(distance_ns(offset.offset_ns, 0)),
                     offset.offset_ns < 0 ? "behind" : "ahead", 1e-6 * double(offset.error_ns));
}

}  // namespace fivepipe::launch
