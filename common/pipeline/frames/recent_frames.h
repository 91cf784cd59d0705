// A bounded table by frame number that a wrong frame number cannot pin.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

namespace fivepipe::frames {

// Keeps the frames that were added last. A further frame displaces the one that was added first,
// whatever its number: a message with a frame number near 2^64 leaves the table after `capacity`
// further frames, where a table of the largest numbers would keep it and refuse all others.
template <class Value>
class RecentFrames {
 public:
  // The table remembers the numbers of this many displaced or closed frames, more than a reader
  // holds per key (bus.cpp), so that a late message does not open such a frame again.
  static constexpr std::size_t kMaxDisplaced = 64;

  struct Entry {
    std::uint64_t frame;
    Value value;
  };

  explicit RecentFrames(std::size_t capacity) : capacity_(std::max<std::size_t>(capacity, 1)) {}

  // Returns nullptr if the table does not have the frame. The pointer is valid until the next
  // change of the table.
  Value* find(std::uint64_t frame) {
    const auto found = position(frame);
    return found == entries_.end() ? nullptr : &found->value;
  }
  const Value* find(std::uint64_t frame) const {
    return const_cast<RecentFrames*>(this)->find(frame);
  }

  struct Added {
    Value& value;                            // valid until the next change of the table
    std::optional<std::uint64_t> displaced;  // the frame that left the table, if any
  };
  // Returns the frame's value. Adds the frame if the table does not have it, and then displaces the
  // frame that was added first if the table is full.
  Added get_or_add(std::uint64_t frame) {
    if (Value* const found = find(frame)) return {*found, {}};
    std::optional<std::uint64_t> displaced;
    if (entries_.size() == capacity_) {
      displaced = entries_.front().frame;
      remember(*displaced);
      entries_.pop_front();
    }
    std::erase(displaced_, frame);
    return {entries_.emplace_back(Entry{frame, Value{}}).value, displaced};
  }

  // Removes the frame and returns its value, or nullopt if the table does not have it.
  std::optional<Value> take(std::uint64_t frame) {
    const auto found = position(frame);
    if (found == entries_.end()) return std::nullopt;
    std::optional<Value> value(std::move(found->value));
    entries_.erase(found);
    return value;
  }

  // As take(), and was_displaced(frame) is true from now on.
  std::optional<Value> close(std::uint64_t frame) {
    remember(frame);
    return take(frame);
  }

  // Removes all frames with numbers <= `frame`. Returns how many.
  std::size_t erase_up_to(std::uint64_t frame) {
    return std::erase_if(entries_, [&](const Entry& entry) { return entry.frame <= frame; });
  }

  void clear() {
    entries_.clear();
    displaced_.clear();
  }

  // True if the frame is one of the last kMaxDisplaced displaced or closed frames.
  bool was_displaced(std::uint64_t frame) const {
    return std::find(displaced_.begin(), displaced_.end(), frame) != displaced_.end();
  }

  // The entries in the order in which they were added.
  auto begin() const { return entries_.begin(); }
  auto end() const { return entries_.end(); }
  auto begin() { return entries_.begin(); }
  auto end() { return entries_.end(); }
  std::size_t size() const { return entries_.size(); }

 private:
  void remember(std::uint64_t frame) {
    displaced_.push_back(frame);
    if (displaced_.size() > kMaxDisplaced) displaced_.pop_front();
  }

  auto position(std::uint64_t frame) {
    return std::find_if(entries_.begin(), entries_.end(),
                        [&](const Entry& entry) { return entry.frame == frame; });
  }

  std::size_t capacity_;
  std::deque<Entry> entries_;
  std::deque<std::uint64_t> displaced_;
};

}  // namespace fivepipe::frames
