// Messages of Cyclone DDS about peers that it refuses. Internal to bus.
#pragma once
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace fivepipe::bus::detail {

// Cyclone DDS logs a refused peer each time the peer announces itself, which is once per second.
// Passes each text on once per kPeriod, with the number of the texts before it that it did not pass
// on; texts that differ only in the identifiers of participants count as one. Peers choose parts of
// the texts, so it distinguishes at most kMaxTexts of them. Not thread-safe.
class RefusalLog {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kPeriod{60};
  static constexpr std::size_t kMaxTexts = 16;

  // Returns the line to log, with an explanation if the reason is known; nullopt if a text like it
  // was logged less than kPeriod ago.
  std::optional<std::string> line_for(const std::string& text, Clock::time_point now);

 private:
  std::map<std::string, Clock::time_point> logged_;
  std::uint64_t suppressed_ = 0;
};

// Sends the messages of Cyclone DDS of this process through a RefusalLog to stderr, from now on.
void limit_dds_log();

}  // namespace fivepipe::bus::detail
