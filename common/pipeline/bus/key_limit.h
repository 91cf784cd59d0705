// Bounds the memory that the keys of a writer take in a reader. Internal to bus.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <unordered_map>
#include <unordered_set>

struct dds_sample_info;

namespace fivepipe::bus::detail {

// A reader keeps an instance for each key while the key has a writer, some 650 bytes also after all
// samples are taken. A key is a name that the writer chooses, so a writer that invents names would
// fill the memory of every reader. The limit refuses the samples of a writer's further keys.
// Thread-safe: DDS calls accepts() in its receive threads.
class KeyLimit {
 public:
  // At most this many writers have keys of their own. Further ones share max_keys.
  static constexpr std::size_t kMaxWriters = 256;
  // Is no handle of a writer; see take_refused().
  static constexpr std::uint64_t kFurtherWriters = 0;

  explicit KeyLimit(std::size_t max_keys) : max_keys_(max_keys) {}  // > 0

  // Returns whether the reader may keep a sample. Handles: of the writer's publication and of the
  // key's instance. Counts refused samples.
  bool accepts(std::uint64_t writer, std::uint64_t instance);
  // Call when the key has no writer any more: the reader removes its instance.
  void forget(std::uint64_t instance);
  // Call for each sample or change of a key's state that is taken. DDS does not call the filter for
  // a key that is disposed without a sample; this function counts such keys, too, because the
  // reader keeps their instances (Cyclone DDS 0.10 has no call that removes one).
  void update(const dds_sample_info& taken);
  // Returns the numbers of refused samples since the last call, by writer: those of at most
  // kMaxWriters writers, and those of further ones under kFurtherWriters.
  std::map<std::uint64_t, std::uint64_t> take_refused();

 private:
  using Keys = std::unordered_set<std::uint64_t>;
  Keys& keys_of(std::uint64_t writer);

  const std::size_t max_keys_;
  std::mutex mutex_;
  std::unordered_map<std::uint64_t, Keys> keys_of_writer_;  // none is empty
  Keys keys_of_further_writers_;
  std::map<std::uint64_t, std::uint64_t> refused_;
};

}  // namespace fivepipe::bus::detail
