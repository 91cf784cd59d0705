#include "common/pipeline/bus/strangers.h"

#include <dds/dds.h>

#include <algorithm>
#include <utility>

#include "common/pipeline/bus/discovery.h"
#include "common/pipeline/bus/process_id.h"

namespace fivepipe::bus::detail {

void Strangers::matched(std::int32_t reader, std::uint64_t writer) {
  if (deployment_.empty()) return;
  dds_builtintopic_endpoint_t* const described = dds_get_matched_publication_data(reader, writer);
  if (!described) return;  // it is gone
  const std::string theirs = deployment_from_user_data(user_data_of(described->qos));
  dds_builtintopic_free_endpoint(described);
  const std::scoped_lock lock(mutex_);
  if (theirs != deployment_)
    deployment_of_stranger_[writer] = theirs;
  else
    own_.insert(writer);
}

void Strangers::unmatched(std::uint64_t writer) {
  const std::scoped_lock lock(mutex_);
  own_.erase(writer);
  if (deployment_of_stranger_.erase(writer) == 0) return;
  ended_.push_back(writer);
  if (ended_.size() > kMaxEnded) ended_.pop_front();
}

bool Strangers::contains(std::uint64_t writer) const {
  const std::scoped_lock lock(mutex_);
  return deployment_of_stranger_.contains(writer) || std::ranges::count(ended_, writer) > 0;
}

std::optional<int> Strangers::own_writers() const {
  if (deployment_.empty()) return std::nullopt;
  const std::scoped_lock lock(mutex_);
  return int(own_.size());
}

bool Strangers::refuses(std::uint64_t writer) {
  const std::scoped_lock lock(mutex_);
  const auto stranger = deployment_of_stranger_.find(writer);
  if (stranger == deployment_of_stranger_.end()) return false;
  const bool is_known = refused_.size() < kMaxRefused || refused_.contains(writer);
  Refused& refused = refused_[is_known ? writer : 0];
  if (is_known) refused.deployment = stranger->second;
  ++refused.samples;
  return true;
}

std::map<std::uint64_t, Strangers::Refused> Strangers::take_refused() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(refused_, {});
}

}  // namespace fivepipe::bus::detail
