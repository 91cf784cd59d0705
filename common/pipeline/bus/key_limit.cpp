#include "common/pipeline/bus/key_limit.h"

#include <utility>

namespace fivepipe::bus::detail {

bool KeyLimit::accepts(std::uint64_t writer, std::uint64_t instance) {
  const std::scoped_lock lock(mutex_);
  const auto [known, is_new] = keys_of_writer_.try_emplace(writer);
  Keys& keys = known->second;
  if (is_new) {
    writers_.push_back(writer);
    if (writers_.size() > kMaxWriters) {
      keys_of_writer_.erase(writers_.front());
      refused_.erase(writers_.front());
      writers_.pop_front();
    }
  }
  if (keys.contains(instance)) return true;
  if (keys.size() >= max_keys_) {
    ++refused_[writer];
    return false;
  }
  keys.insert(instance);
  return true;
}

void KeyLimit::forget(std::uint64_t instance) {
  const std::scoped_lock lock(mutex_);
  for (auto& [writer, keys] : keys_of_writer_) keys.erase(instance);
}

std::map<std::uint64_t, std::uint64_t> KeyLimit::take_refused() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(refused_, {});
}

}  // namespace fivepipe::bus::detail
