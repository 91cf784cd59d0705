// A map of bounded size that forgets its oldest entry.
#pragma once
#include <algorithm>
#include <cstddef>
#include <deque>
#include <map>
#include <utility>

namespace fivepipe::base {

// For keys that peers choose. The age of an entry counts from the call that added its key.
template <class Key, class Value>
class BoundedMap {
 public:
  explicit BoundedMap(std::size_t capacity) : capacity_(std::max<std::size_t>(capacity, 1)) {}

  // Returns nullptr if the map does not have the key. The pointer is valid until the next change of
  // the map.
  const Value* find(const Key& key) const {
    const auto found = values_.find(key);
    return found == values_.end() ? nullptr : &found->second;
  }
  bool contains(const Key& key) const { return values_.contains(key); }

  // Adds the key, and then forgets the oldest entry if there are more than `capacity`. Replaces the
  // value of a key that is in the map already, and keeps its age. The reference is valid until the
  // next change of the map.
  const Value& set(const Key& key, Value value) {
    const auto [at, is_new] = values_.insert_or_assign(key, std::move(value));
    if (is_new) by_age_.push_back(key);
    if (by_age_.size() > capacity_) {
      values_.erase(by_age_.front());
      by_age_.pop_front();
    }
    return at->second;
  }

  std::size_t size() const { return values_.size(); }
  bool empty() const { return values_.empty(); }

 private:
  std::size_t capacity_;
  std::map<Key, Value> values_;
  std::deque<Key> by_age_;  // the keys of values_, oldest first
};

}  // namespace fivepipe::base
