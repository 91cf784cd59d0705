// Bounds the memory that the keys of a writer take in a reader. Internal to bus.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <unordered_map>
#include <unordered_set>

namespace fivepipe::bus::detail {

// A reader keeps an instance for each key while the key has a writer, some 650 bytes also after all
// samples are taken. A key is a name that the writer chooses, so a writer that invents names would
// fill the memory of every reader. The limit refuses the samples of a writer's further keys.
// Thread-safe: DDS calls accepts() in its receive threads.
class KeyLimit {
 public:
  // More than a deployment has cameras, objects, viewers and nodes. HullTile has a key for each
  // tile of a view (render_node/tile_assembler.cpp).
  static constexpr std::size_t kMaxKeysPerWriter = 1024, kMaxTileKeysPerWriter = 4096;
  // At most this many writers are remembered; then the oldest are forgotten.
  static constexpr std::size_t kMaxWriters = 256;

  explicit KeyLimit(std::size_t max_keys = kMaxKeysPerWriter) : max_keys_(max_keys) {}

  // Returns whether the reader may keep a sample. Handles: of the writer's publication and of the
  // key's instance. Counts refused samples. DDS does not ask for a key that is disposed without a
  // sample: the bus calls this when it takes the change of state, so that such keys count, too. The
  // reader keeps their instances (Cyclone DDS 0.10 has no call that removes one).
  bool accepts(std::uint64_t writer, std::uint64_t instance);
  // Call when the key has no writer any more: the reader removes its instance.
  void forget(std::uint64_t instance);
  // Returns the numbers of refused samples since the last call, by writer.
  std::map<std::uint64_t, std::uint64_t> take_refused();

 private:
  using Keys = std::unordered_set<std::uint64_t>;
  const std::size_t max_keys_;
  std::mutex mutex_;
  std::unordered_map<std::uint64_t, Keys> keys_of_writer_;
  std::deque<std::uint64_t> writers_;  // the keys of keys_of_writer_, oldest first
  std::map<std::uint64_t, std::uint64_t> refused_;
};

}  // namespace fivepipe::bus::detail
