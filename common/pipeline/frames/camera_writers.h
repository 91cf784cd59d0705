// Decides which process sends the messages of a camera. A restarted capture_node has another
// writer; messages of the process before it may still arrive, and those of a peer at any time.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>

namespace fivepipe::frames {

class CameraWriters {
 public:
  // A reader holds at most 8 samples of a camera (bus.cpp). A writer that sends more after its
  // replacement is alive.
  static constexpr std::size_t kMaxHeld = 8;
  // The current writer is silent if another one sends this many messages meanwhile.
  static constexpr std::size_t kMaxSilence = 16;
  // Remembered writers of a camera. Forgets the one that was first seen first.
  static constexpr std::size_t kMaxKnown = 64;

  struct Verdict {
    bool is_current;                        // false: drop the message
    std::optional<std::uint64_t> replaced;  // the writer whose place this one has just taken
  };
  // Call it for each message. writer: bus::Sample::writer(). The current writer of a camera is
  //   - one that sends its first message: a restarted process. All cameras of the replaced writer
  //     then expect the new one;
  //   - or one that was replaced and is alive: the new one was another process, whose messages are
  //     dropped from then on;
  //   - or any that goes on while the current one is silent.
  Verdict judge(std::size_t camera, std::uint64_t writer) {
    Camera& of = cameras_[camera];
    if (!of.current || of.current == writer) {
      of.others = 0;
      if (!of.current) of.remember(writer);
      of.current = writer;
      return {true, {}};
    }
    const std::uint64_t current = *of.current;
    if (!of.knows(writer)) {
      for (auto& [number, other] : cameras_)
        if (other.current == current) other.replace_by(writer);
      return {true, current};
    }
    const bool is_alive = writer == of.previous && ++of.late > kMaxHeld;
    if (!is_alive && ++of.others <= kMaxSilence) return {false, {}};
    of.current = writer;
    of.previous.reset();
    of.others = 0;
    return {true, current};
  }

 private:
  struct Camera {
    std::optional<std::uint64_t> current;
    std::optional<std::uint64_t> previous;  // replaced by a new writer
    std::size_t late = 0;                   // messages of `previous` since then
    std::size_t others = 0;  // messages of other writers since the current one's last
    std::deque<std::uint64_t> known;

    bool knows(std::uint64_t writer) const {
      return std::find(known.begin(), known.end(), writer) != known.end();
    }
    void remember(std::uint64_t writer) {
      known.push_back(writer);
      if (known.size() > kMaxKnown) known.pop_front();
    }
    void replace_by(std::uint64_t writer) {
      if (!knows(writer)) remember(writer);
      previous = current;
      current = writer;
      late = others = 0;
    }
  };
  std::map<std::size_t, Camera> cameras_;
};

}  // namespace fivepipe::frames
