// Recognises the writers of other deployments. Internal to bus.
#pragma once
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>

namespace fivepipe::bus::detail {

// The writers that one reader is matched with. A writer states its deployment in its user data
// (process_id.h). Thread-safe: DDS reports writers and samples in its own threads.
class Strangers {
 public:
  // deployment: that of the reader; empty: every writer is accepted.
  explicit Strangers(std::string deployment) : deployment_(std::move(deployment)) {}

  // Call when DDS has matched the reader, an entity, with the writer, and when the match has ended.
  void matched(std::int32_t reader, std::uint64_t writer);
  void unmatched(std::uint64_t writer);
  // Returns true if the writer is known to be of another deployment. Knows the newest kMaxEnded
  // writers that have ended, too: what they did to a key may not have been taken yet.
  bool contains(std::uint64_t writer) const;
  // Number of matched writers of the own deployment; nullopt if every writer is accepted.
  std::optional<int> own_writers() const;
  // Returns as contains(), and counts a sample of it.
  bool refuses(std::uint64_t writer);

  struct Refused {
    std::string deployment;  // empty: the writer states none
    std::uint64_t samples = 0;
  };
  static constexpr std::size_t kMaxEnded = 256;
  // At most this many writers are distinguished in one call of take_refused().
  static constexpr std::size_t kMaxRefused = 256;
  // Returns what has been refused since the last call, by writer; that of further ones under 0.
  std::map<std::uint64_t, Refused> take_refused();

 private:
  const std::string deployment_;
  mutable std::mutex mutex_;
  std::unordered_map<std::uint64_t, std::string> deployment_of_stranger_;  // matched writers
  std::unordered_set<std::uint64_t> own_;                                  // matched writers
  std::deque<std::uint64_t> ended_;  // strangers that were matched
  std::map<std::uint64_t, Refused> refused_;
};

}  // namespace fivepipe::bus::detail
