#include "common/pipeline/node/drop_counts.h"

namespace fivepipe::node {

const std::pair<const messages::BadMessage, std::uint64_t>& DropCounts::add(
    const messages::BadMessage& bad, std::uint64_t n) {
  auto found = counts_.find(bad);
  if (found == counts_.end()) {
    const bool is_named = !bad.subject.empty() || !bad.detail.empty();
    if (is_named && kept_of_reason_[bad.reason] >= kMaxPerReason) {
      found = counts_.try_emplace({bad.reason, kOther, ""}).first;
    } else {
      kept_of_reason_[bad.reason] += is_named;
      found = counts_.try_emplace(bad).first;
    }
  }
  found->second += n;
  return *found;
}

void NamedCounts::add(const std::string& name, std::uint64_t n) {
  const bool fits = counts_.contains(name) || counts_.size() < capacity_;
  counts_[fits ? name : other_] += n;
}

}  // namespace fivepipe::node
