// Shows composited frames on the screen.
#pragma once
#include <memory>
#include <opencv2/core/mat.hpp>
#include <stdexcept>
#include <string>

namespace fivepipe::render {

struct WindowError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// A window in a thread of its own with its own GL context (GLFW): the caller's EGL context is never
// touched, and neither the screen's refresh nor a stalled display server holds up the caller. One
// at a time in a process.
class Window {
 public:
  // Throws WindowError, "no display: ..." where there is none.
  Window(const std::string& title, int width_px, int height_px);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  // Hands over the newest 8-bit BGR image, row 0 at the top, which must not be written to
  // afterwards; an older one that has not been shown yet is dropped. False once the window was
  // closed (q, Esc or its close button).
  bool show(const cv::Mat& image_bgr);

  // What is put on the screen, for tests: the window's pixels as 8-bit BGR, row 0 at the top; empty
  // before the first frame.
  cv::Mat screenshot() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace fivepipe::render
