// A queue from any number of producer threads to one consumer thread, bounded by a cost.
#pragma once
#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <limits>
#include <mutex>
#include <optional>
#include <utility>

namespace fivepipe::base {

// The caller chooses the unit of the cost: items, bytes, ... An item counts from its push until the
// consumer calls pop() for the next one, so the cost includes the item in progress. The queue
// accepts an item of any cost as long as cost() < max_cost.
//
// All functions may be called from any thread, pop() from the consumer only. A class that owns the
// consumer thread declares it after the queue, and calls close() before it joins the thread.
template <class T>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::size_t max_cost) : max_cost_(max_cost) {}  // > 0
  BoundedQueue(const BoundedQueue&) = delete;
  BoundedQueue& operator=(const BoundedQueue&) = delete;

  // Never waits. Returns false, and drops the item, if the queue is full or closed.
  bool try_push(T item, std::size_t cost = 1) {
    const std::scoped_lock lock(mutex_);
    return append(std::move(item), cost);
  }

  // Waits for room: until the cost is below max_cost and `limit`. Returns false, and drops the
  // item, if the queue is closed.
  bool push(T item, std::size_t cost = 1,
            std::size_t limit = std::numeric_limits<std::size_t>::max()) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || cost_ < std::min(max_cost_, limit); });
    return append(std::move(item), cost);
  }

  // Waits for the next item. Returns nullopt once the queue is closed and empty.
  std::optional<T> pop() {
    std::unique_lock lock(mutex_);
    cost_ -= std::exchange(cost_in_progress_, 0);
    changed_.notify_all();
    changed_.wait(lock, [this] { return closed_ || !queue_.empty(); });
    if (queue_.empty()) return std::nullopt;
    Entry entry = std::move(queue_.front());
    queue_.pop_front();
    cost_in_progress_ = entry.cost;
    return std::move(entry.item);
  }

  // Refuses further items; pop() still returns the queued ones.
  void close() {
    const std::scoped_lock lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }

  // Removes the queued items, but not the one in progress, and returns them in their order.
  std::deque<T> clear() {
    const std::scoped_lock lock(mutex_);
    std::deque<T> items;
    for (Entry& entry : queue_) {
      cost_ -= entry.cost;
      items.push_back(std::move(entry.item));
    }
    queue_.clear();
    changed_.notify_all();
    return items;
  }

  // The cost of the queued items and of the one in progress.
  std::size_t cost() const {
    const std::scoped_lock lock(mutex_);
    return cost_;
  }
  // The number of queued items, without the one in progress.
  std::size_t size() const {
    const std::scoped_lock lock(mutex_);
    return queue_.size();
  }

  void wait_until_full_or_closed() const {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return closed_ || cost_ >= max_cost_; });
  }

 private:
  struct Entry {
    T item;
    std::size_t cost;
  };

  bool append(T&& item, std::size_t cost) {
    if (closed_ || cost_ >= max_cost_) return false;
    queue_.push_back({std::move(item), cost});
    cost_ += cost;
    changed_.notify_all();
    return true;
  }

  const std::size_t max_cost_;
  mutable std::mutex mutex_;  // guards the members below
  mutable std::condition_variable changed_;
  std::deque<Entry> queue_;
  std::size_t cost_ = 0, cost_in_progress_ = 0;
  bool closed_ = false;
};

}  // namespace fivepipe::base
