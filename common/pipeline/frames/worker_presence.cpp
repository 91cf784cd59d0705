#include "common/pipeline/frames/worker_presence.h"

#include <algorithm>
#include <utility>

namespace fivepipe::frames {
namespace {

// As many as can be in flight.
constexpr std::size_t kMaxFrames = 64;

}  // namespace

WorkerPresence::WorkerPresence(int workers)
    : present_(std::size_t(workers), true),
      has_ever_answered_(std::size_t(workers)),
      has_left_(std::size_t(workers)),
      owes_after_leaving_(std::size_t(workers)) {}

std::vector<int> WorkerPresence::present() const {
  std::vector<int> workers;
  const bool any = std::count(present_.begin(), present_.end(), true) > 0;
  for (std::size_t w = 0; w < present_.size(); ++w)
    if (present_[w] || !any) workers.push_back(int(w));
  return workers;
}

bool WorkerPresence::is_missing(int worker) const {
  return has_ever_answered_[std::size_t(worker)] && !present_[std::size_t(worker)];
}

void WorkerPresence::published(std::uint64_t frame, std::span<const std::uint8_t> owners) {
  std::vector<bool> owns(present_.size());
  for (const std::uint8_t owner : owners)
    if (owner < owns.size()) owns[owner] = true;
  frames_.push_back({frame, std::move(owns), std::vector<bool>(present_.size()), {}});
  if (frames_.size() > kMaxFrames) frames_.pop_front();
}

void WorkerPresence::answered(std::uint64_t frame, int worker, Clock::time_point now) {
  const auto found = std::find_if(frames_.begin(), frames_.end(),
                                  [&](const Frame& kept) { return kept.frame == frame; });
  if (found == frames_.end() || worker < 0 || worker >= int(present_.size())) return;
  const std::size_t w = std::size_t(worker);
  if (!found->first_answer) found->first_answer = now;
  if (found->owns[w] && !found->has_answered[w]) {
    delays_.push_back(now - *found->first_answer);
    if (delays_.size() > kept_delays()) delays_.pop_front();
  }
  found->has_answered[w] = has_ever_answered_[w] = true;
  const auto newest = std::find_if(frames_.rbegin(), frames_.rend(), [](const Frame& kept) {
                        return kept.first_answer.has_value();
                      }).base();  // one after it
  if (std::size_t(newest - found) <= kRecentFrames) {
    present_[w] = true;
    has_left_[w] = false;
  }
}

void WorkerPresence::left(int worker) {
  if (worker < 0 || worker >= int(present_.size())) return;
  const std::size_t w = std::size_t(worker);
  present_[w] = false;
  has_left_[w] = owes_after_leaving_[w] = true;
}

WorkerPresence::Clock::duration WorkerPresence::patience(std::size_t worker) const {
  if (!has_ever_answered_[worker]) return kMinPatience;
  if (delays_.empty()) return kFirstPatience;
  return std::clamp<Clock::duration>(
      kPatienceFactor * *std::max_element(delays_.begin(), delays_.end()),
      delays_.size() < kept_delays() ? kFirstPatience : kMinPatience, kMaxPatience);
}

bool WorkerPresence::is_silent(int worker, Clock::time_point now) const {
  // A worker that has answered a later frame has dropped the earlier ones.
  for (auto frame = frames_.rbegin(); frame != frames_.rend(); ++frame) {
    if (frame->has_answered[std::size_t(worker)]) return false;
    if (frame->owns[std::size_t(worker)] && frame->first_answer &&
        now - *frame->first_answer > patience(std::size_t(worker)))
      return true;
  }
  return false;
}

void WorkerPresence::update(Clock::time_point now) {
  for (std::size_t w = 0; w < present_.size(); ++w) {
    const bool is_last = std::count(present_.begin(), present_.end(), true) < 2;
    if (!(owes_after_leaving_[w] || (present_[w] && !is_last)) || !is_silent(int(w), now)) continue;
    present_[w] = owes_after_leaving_[w] = false;
    give_up_frames_of(w);
  }
}

void WorkerPresence::give_up_frames_of(std::size_t worker) {
  for (const Frame& frame : frames_)
    if (frame.owns[worker]) lost_ = std::max(lost_.value_or(0), frame.frame);
}

std::optional<std::uint64_t> WorkerPresence::take_lost() {
  return std::exchange(lost_, std::nullopt);
}

}  // namespace fivepipe::frames
