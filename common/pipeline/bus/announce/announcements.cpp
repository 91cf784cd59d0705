#include "common/pipeline/bus/announce/announcements.h"

#include <algorithm>

namespace fivepipe::bus::detail {

void Announcements::found(const std::string& guid, const std::string& machine) {
  if (machine == own_machine_) return;
  missing_.erase(machine);
  if (present_.size() < kMaxRemembered) present_[guid] = machine;
}

void Announcements::lost(const std::string& guid, Clock::time_point now) {
  const auto known = present_.find(guid);
  if (known == present_.end()) return;
  const std::string machine = known->second;
  present_.erase(known);
  const bool is_missing = std::ranges::none_of(
      present_, [&](const auto& process) { return process.second == machine; });
  if (is_missing && missing_.size() < kMaxRemembered) missing_[machine] = now + kSearch;
}

bool Announcements::take_due(Clock::time_point now) {
  std::erase_if(missing_, [&](const auto& machine) { return now > machine.second; });
  if (missing_.empty() || (due_ && now < *due_)) return false;
  due_ = now + kPeriod;
  return spend_one(now);
}

std::optional<Announcements::Clock::time_point> Announcements::next() const {
  if (missing_.empty()) return std::nullopt;
  return due_.value_or(budget_at_);
}

bool Announcements::spend_one(Clock::time_point now) {
  const double waited_s = std::chrono::duration<double>(now - budget_at_).count();
  budget_ = std::min(double(kMaxAtOnce), budget_ + waited_s);
  budget_at_ = now;
  if (budget_ < 1) return false;
  --budget_;
  return true;
}

}  // namespace fivepipe::bus::detail
