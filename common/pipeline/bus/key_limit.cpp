#include "common/pipeline/bus/key_limit.h"

#include <dds/dds.h>

#include <utility>

namespace fivepipe::bus::detail {

KeyLimit::Keys& KeyLimit::keys_of(std::uint64_t writer) {
  const auto known = keys_of_writer_.find(writer);
  if (known != keys_of_writer_.end()) return known->second;
  return keys_of_writer_.size() < kMaxWriters ? keys_of_writer_[writer] : keys_of_further_writers_;
}

bool KeyLimit::accepts(std::uint64_t writer, std::uint64_t instance) {
  const std::scoped_lock lock(mutex_);
  // The writer may have been a further one when it wrote the key first.
  if (keys_of_further_writers_.contains(instance)) return true;
  Keys& keys = keys_of(writer);
  if (keys.contains(instance)) return true;
  if (keys.size() >= max_keys_) {
    const bool is_named = refused_.contains(writer) || refused_.size() < kMaxWriters;
    ++refused_[is_named ? writer : kFurtherWriters];
    return false;
  }
  keys.insert(instance);
  return true;
}

void KeyLimit::forget(std::uint64_t instance) {
  const std::scoped_lock lock(mutex_);
  for (auto& [writer, keys] : keys_of_writer_) keys.erase(instance);
  std::erase_if(keys_of_writer_, [](const auto& of_writer) { return of_writer.second.empty(); });
  keys_of_further_writers_.erase(instance);
}

void KeyLimit::update(const dds_sample_info& taken) {
  if (taken.instance_state == DDS_IST_NOT_ALIVE_NO_WRITERS)
    forget(taken.instance_handle);
  else if (!taken.valid_data)
    accepts(taken.publication_handle, taken.instance_handle);
}

std::map<std::uint64_t, std::uint64_t> KeyLimit::take_refused() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(refused_, {});
}

}  // namespace fivepipe::bus::detail
