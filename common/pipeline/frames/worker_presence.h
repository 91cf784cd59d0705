// Decides which reconstruction workers get tiles of the next frame. Each worker answers each frame
// that it handles by TileCosts, also if it owns no tile. A worker that owes an answer for much
// longer than the others is silent (killed, hung, out of reach): the others take its tiles, long
// before DDS or a supervisor misses its process.
#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

namespace fivepipe::frames {

class WorkerPresence {
 public:
  using Clock = std::chrono::steady_clock;

  explicit WorkerPresence(int workers);  // all are present

  // Reports that a frame has been published, with the worker of each tile.
  void published(std::uint64_t frame, std::span<const std::uint8_t> owners);
  // Reports that the worker has handled the frame. An answer to one of the newest kRecentFrames
  // makes an absent worker present. Ignores unknown frames and workers.
  void answered(std::uint64_t frame, int worker, Clock::time_point now);
  // Reports that the worker ends. It still sends the tiles of the frames before.
  void left(int worker);
  // Finds silent workers. The last present worker stays present.
  void update(Clock::time_point now);

  std::vector<int> present() const;  // ascending; all workers if none is present
  // Returns true for a worker that takes no part after it has answered.
  bool is_missing(int worker) const;
  // Returns the newest frame of which a silent worker owes tiles, if one became silent since the
  // last call: that frame and the earlier ones do not become complete.
  std::optional<std::uint64_t> take_lost();

  static constexpr std::size_t kRecentFrames = 4;
  // A worker is silent if its answer comes later than the first one to the same frame by more than
  // kPatienceFactor times the largest delay of the newest kDelays answers with tiles, within these
  // bounds; by kMaxPatience until there are so many answers; by kMinPatience if it has never
  // answered, because it may not run.
  static constexpr int kPatienceFactor = 3;
  static constexpr std::size_t kDelays = 16;
  static constexpr std::chrono::milliseconds kMinPatience{60}, kMaxPatience{500};

 private:
  struct Frame {
    std::uint64_t frame;
    std::vector<bool> owns, has_answered;  // by worker
    std::optional<Clock::time_point> first_answer;
  };
  Clock::duration patience(std::size_t worker) const;
  bool is_silent(int worker, Clock::time_point now) const;

  std::vector<bool> present_, has_ever_answered_;  // by worker
  std::deque<Frame> frames_;                       // the newest published ones, ascending
  std::deque<Clock::duration> delays_;  // of the newest answers with tiles after the first answer
  std::optional<std::uint64_t> lost_;
};

}  // namespace fivepipe::frames
