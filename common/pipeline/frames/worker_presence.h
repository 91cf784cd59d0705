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
  // Reports that the worker has handled the frame. An answer to one of the newest kRecentFrames up
  // to the newest answered one makes an absent worker present. Ignores unknown frames and workers.
  void answered(std::uint64_t frame, int worker, Clock::time_point now);
  // Reports that the worker ends. It still sends the tiles of the frames before.
  void left(int worker);
  // Finds silent workers. The last present worker stays present.
  void update(Clock::time_point now);

  std::vector<int> present() const;  // ascending; all workers if none is present
  // Returns true for a worker that takes no part after it has answered: it is silent or has left.
  bool is_missing(int worker) const;
  bool has_left(int worker) const { return has_left_[std::size_t(worker)]; }
  // Returns the newest frame of which a worker owed tiles that became silent since the last call,
  // or that has left and whose time for them is over: the earlier frames do not become complete
  // either.
  std::optional<std::uint64_t> take_lost();

  static constexpr std::size_t kRecentFrames = 4;
  // A worker is silent if its answer comes later than the first one to the same frame by more than
  // kPatienceFactor times the largest delay of the newest answers with tiles, kDelaysPerWorker of
  // each worker, within kMinPatience and kMaxPatience; by at least kFirstPatience until there are
  // so many answers; by kMinPatience if it has never answered, because it may not run.
  static constexpr int kPatienceFactor = 3;
  static constexpr std::size_t kDelaysPerWorker = 8;
  static constexpr std::chrono::milliseconds kMinPatience{60}, kFirstPatience{500},
      kMaxPatience{5000};

 private:
  struct Frame {
    std::uint64_t frame;
    std::vector<bool> owns, has_answered;  // by worker
    std::optional<Clock::time_point> first_answer;
  };
  Clock::duration patience(std::size_t worker) const;
  std::size_t kept_delays() const { return kDelaysPerWorker * present_.size(); }
  void give_up_frames_of(std::size_t worker);
  bool is_silent(int worker, Clock::time_point now) const;

  std::vector<bool> present_, has_ever_answered_, has_left_, owes_after_leaving_;  // by worker
  std::deque<Frame> frames_;            // the newest published ones, ascending
  std::deque<Clock::duration> delays_;  // of the newest answers with tiles after the first answer
  std::optional<std::uint64_t> lost_;
};

}  // namespace fivepipe::frames
