// Shows composited frames in a window.
#pragma once
#include <memory>
#include <opencv2/core/mat.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace fivepipe::render {

struct WindowError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// A press or a repeat of a key that the caller handles: arrow up or the number pad's +, arrow down
// or its -, Tab.
struct KeyPress {
  enum class Key { up, down, next } key;
  bool shift = false;
  auto operator<=>(const KeyPress&) const = default;
};

// A window with its own thread and GL context (GLFW). It does not touch the caller's EGL context,
// and neither vertical sync nor a stalled display server blocks the caller. A process can have one
// window at a time.
class Window {
 public:
  // Throws WindowError; its text starts with "no display: " if there is no display.
  Window(const std::string& title, int width_px, int height_px);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  // Sets the image to show next: 8-bit BGR, row 0 at the top. The caller must not modify it
  // afterwards. The window has no queue: the image replaces one that has not been shown yet.
  // Returns false after the user has closed the window (q, Esc or its close button).
  bool show(const cv::Mat& image_bgr);

  // Returns the keys pressed since the last call; at most kMaxKeys, the newest are dropped.
  std::vector<KeyPress> take_keys();
  static constexpr std::size_t kMaxKeys = 64;
  void set_title(const std::string& title);

  // Returns the pixels of the window as 8-bit BGR, row 0 at the top; empty before the first frame.
  // For tests.
  cv::Mat screenshot() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace fivepipe::render
