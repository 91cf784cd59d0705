// Orders the callbacks of DDS and the life of the object that they use. Internal to bus.
#pragma once
#include <atomic>

namespace fivepipe::bus::detail {

// DDS passes an object to its own threads and ends all callbacks before it returns from the
// deletion of the entity. The locks that order these steps are inside of libddsc, where the thread
// sanitizer does not see them. It sees this counter: each pass() happens after the earlier ones.
// Call it at the end of the construction, at both ends of each callback, and at the beginning of
// the destruction.
class CallbackOrder {
 public:
  void pass() {
    // The sanitizer checks the memory of an addition before it orders it, but not that of a load.
    static_cast<void>(passed_.load(std::memory_order_acquire));
    passed_.fetch_add(1, std::memory_order_acq_rel);
  }

 private:
  std::atomic<unsigned> passed_{0};
};

// The two ends of a callback.
class Callback {
 public:
  explicit Callback(CallbackOrder& order) : order_(order) { order_.pass(); }
  ~Callback() { order_.pass(); }
  Callback(const Callback&) = delete;
  Callback& operator=(const Callback&) = delete;

 private:
  CallbackOrder& order_;
};

}  // namespace fivepipe::bus::detail
