#include "render_node/output/window.h"

#include <epoxy/gl.h>
// Include epoxy before GLFW, which otherwise includes the system's GL header.
#include <GLFW/glfw3.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <mutex>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <thread>
#include <utility>

#include "common/gl/objects.h"

namespace fivepipe::render {
namespace {

// The window reacts to a key press within this time while no frame arrives.
constexpr double kEventWait_s = 0.02;

std::string glfw_error() {
  const char* description = nullptr;
  glfwGetError(&description);
  return description ? description : "no reason given";
}

struct WindowDeleter {
  void operator()(GLFWwindow* window) const {
    glfwDestroyWindow(window);
    glfwTerminate();
  }
};
using GlfwWindow = std::unique_ptr<GLFWwindow, WindowDeleter>;

GlfwWindow opened(const std::string& title, int width_px, int height_px) {
  if (!glfwInit()) throw WindowError("no display: " + glfw_error());
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  GlfwWindow window(glfwCreateWindow(width_px, height_px, title.c_str(), nullptr, nullptr));
  if (!window) {
    const std::string reason = glfw_error();
    glfwTerminate();
    throw WindowError("no window: " + reason);
  }
  glfwMakeContextCurrent(window.get());
  glfwSwapInterval(1);
  return window;
}

std::optional<KeyPress> key_press(int key, int mods) {
  const bool shift = (mods & GLFW_MOD_SHIFT) != 0;
  switch (key) {
    case GLFW_KEY_UP:
    case GLFW_KEY_KP_ADD: return KeyPress{KeyPress::Key::up, shift};
    case GLFW_KEY_DOWN:
    case GLFW_KEY_KP_SUBTRACT: return KeyPress{KeyPress::Key::down, shift};
    case GLFW_KEY_TAB: return KeyPress{KeyPress::Key::next, shift};
    default: return std::nullopt;
  }
}

// Draws the image into the window: scaled to fit, aspect ratio kept, black borders.
void blit(const gl::GlTexture& image, int window_width_px, int window_height_px) {
  gl::GlName<gl::delete_framebuffer> source([] {
    GLuint name = 0;
    glCreateFramebuffers(1, &name);
    return name;
  }());
  glNamedFramebufferTexture(source.get(), GL_COLOR_ATTACHMENT0, image.get(), 0);
  const double scale = std::min(double(window_width_px) / image.width_px(),
                                double(window_height_px) / image.height_px());
  const int width = int(image.width_px() * scale + 0.5),
            height = int(image.height_px() * scale + 0.5);
  const int left = (window_width_px - width) / 2, bottom = (window_height_px - height) / 2;
  const float black[] = {0, 0, 0, 1};
  glClearNamedFramebufferfv(0, GL_COLOR, 0, black);
  // Row 0 of the texture is the top of the image; row 0 of the window is its bottom.
  glBlitNamedFramebuffer(source.get(), 0, 0, image.height_px(), image.width_px(), 0, left, bottom,
                         left + width, bottom + height, GL_COLOR_BUFFER_BIT, GL_LINEAR);
}

// Reads the back buffer. Call before swapping the buffers; the content is undefined afterwards.
cv::Mat back_buffer(int width_px, int height_px) {
  cv::Mat rgba(height_px, width_px, CV_8UC4), bgr;
  glReadBuffer(GL_BACK);
  glReadPixels(0, 0, width_px, height_px, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data);
  cv::flip(rgba, rgba, 0);
  cv::cvtColor(rgba, bgr, cv::COLOR_RGBA2BGR);
  return bgr;
}

}  // namespace

struct Window::State {
  mutable std::mutex mutex;
  cv::Mat next;  // the newest image that has not been shown; empty if there is none
  bool ending = false, closed = false;
  std::optional<std::promise<cv::Mat>> screenshot_wanted;
  std::vector<KeyPress> keys;             // since the last take_keys()
  std::optional<std::string> next_title;  // not set yet
  std::thread thread;

  void run(const std::string& title, int width_px, int height_px, std::promise<void> ready);
  void show_frames(GLFWwindow* window);
  void press(GLFWwindow* window, int key, int action, int mods);
};

void Window::State::press(GLFWwindow* window, int key, int action, int mods) {
  if (action == GLFW_RELEASE) return;
  if (action == GLFW_PRESS && (key == GLFW_KEY_Q || key == GLFW_KEY_ESCAPE))
    glfwSetWindowShouldClose(window, GLFW_TRUE);
  const std::lock_guard lock(mutex);
  if (const auto press = key_press(key, mods); press && keys.size() < kMaxKeys)
    keys.push_back(*press);
}

void Window::State::run(const std::string& title, int width_px, int height_px,
                        std::promise<void> ready) {
  GlfwWindow window;
  try {
    window = opened(title, width_px, height_px);
  } catch (...) {
    ready.set_exception(std::current_exception());
    return;
  }
  ready.set_value();
  show_frames(window.get());
  const std::lock_guard lock(mutex);
  closed = true;
  if (screenshot_wanted) screenshot_wanted->set_value({});
  screenshot_wanted.reset();
}

void Window::State::show_frames(GLFWwindow* window) {
  glfwSetWindowUserPointer(window, this);
  glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int, int action, int mods) {
    static_cast<State*>(glfwGetWindowUserPointer(w))->press(w, key, action, mods);
  });
  std::optional<gl::GlTexture> texture;
  while (!glfwWindowShouldClose(window)) {
    cv::Mat image;
    std::optional<std::promise<cv::Mat>> screenshot;
    std::optional<std::string> new_title;
    {
      const std::lock_guard lock(mutex);
      if (ending) return;
      std::swap(image, next);
      std::swap(screenshot, screenshot_wanted);
      std::swap(new_title, next_title);
    }
    if (new_title) glfwSetWindowTitle(window, new_title->c_str());
    int width_px = 0, height_px = 0;
    glfwGetFramebufferSize(window, &width_px, &height_px);
    if (!image.empty() && width_px > 0 && height_px > 0) {
      if (!texture || texture->width_px() != image.cols || texture->height_px() != image.rows)
        texture.emplace(image.cols, image.rows, GL_RGB8);
      texture->upload(GL_BGR, GL_UNSIGNED_BYTE, image.data);
    }
    if (texture && (!image.empty() || screenshot)) {
      blit(*texture, width_px, height_px);
      if (screenshot) screenshot->set_value(back_buffer(width_px, height_px));
      glfwSwapBuffers(window);
    } else if (screenshot) {
      screenshot->set_value({});
    }
    glfwWaitEventsTimeout(kEventWait_s);
  }
}

Window::Window(const std::string& title, int width_px, int height_px)
    : state_(std::make_unique<State>()) {
  std::promise<void> ready;
  std::future<void> opened_or_not = ready.get_future();
  state_->thread = std::thread(
      [state = state_.get(), title, width_px, height_px, promise = std::move(ready)]() mutable {
        state->run(title, width_px, height_px, std::move(promise));
      });
  try {
    opened_or_not.get();
  } catch (...) {
    state_->thread.join();
    throw;
  }
}

Window::~Window() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->ending = true;
    if (!state_->closed) glfwPostEmptyEvent();
  }
  state_->thread.join();
}

bool Window::show(const cv::Mat& image_bgr) {
  const std::lock_guard lock(state_->mutex);
  if (state_->closed) return false;
  state_->next = image_bgr.isContinuous() ? image_bgr : image_bgr.clone();
  glfwPostEmptyEvent();
  return true;
}

std::vector<KeyPress> Window::take_keys() {
  const std::lock_guard lock(state_->mutex);
  return std::exchange(state_->keys, {});
}

void Window::set_title(const std::string& title) {
  const std::lock_guard lock(state_->mutex);
  if (state_->closed) return;
  state_->next_title = title;
  glfwPostEmptyEvent();
}

cv::Mat Window::screenshot() const {
  std::future<cv::Mat> picture;
  {
    const std::lock_guard lock(state_->mutex);
    if (state_->closed) return {};
    picture = state_->screenshot_wanted.emplace().get_future();
  }
  return picture.get();
}

}  // namespace fivepipe::render
