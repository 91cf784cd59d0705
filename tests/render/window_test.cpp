#include "render_node/window.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <opencv2/core.hpp>

#include "common/gl/objects.h"
#include "tests/support/checked_gl_context.h"
#include "tests/support/optional_package.h"

extern char** environ;

namespace fivepipe::render {
namespace {

// Runs a virtual X server during a test and sets DISPLAY to it. display() is empty if Xvfb is not
// installed.
class VirtualDisplay {
 public:
  VirtualDisplay() {
    int ends[2];
    if (pipe(ends) != 0) return;
    const std::string fd = std::to_string(ends[1]);
    const char* arguments[] = {"Xvfb",        "-displayfd", fd.c_str(), "-screen", "0",
                               "1024x768x24", "-nolisten",  "tcp",      nullptr};
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addclose(&actions, ends[0]);
    posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", 1, 0);
    if (posix_spawnp(&process_, "Xvfb", &actions, nullptr, const_cast<char**>(arguments),
                     environ) != 0)
      process_ = 0;
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    // Xvfb writes the newline separately; closing the pipe before it arrives would stop the server.
    std::string number;
    for (char c = 0; process_ && c != '\n' && read(ends[0], &c, 1) == 1;) number += c;
    close(ends[0]);
    if (!number.empty()) display_ = ":" + std::to_string(std::atoi(number.c_str()));
    setenv("DISPLAY", display_.c_str(), 1);
  }
  ~VirtualDisplay() {
    if (!process_) return;
    kill(process_, SIGTERM);
    waitpid(process_, nullptr, 0);
  }
  const std::string& display() const { return display_; }

 private:
  pid_t process_ = 0;
  std::string display_;
};

TEST(Window, WithoutADisplayTheErrorNamesIt) {
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  try {
    Window("fivepipe", 64, 48);
    FAIL() << "a window without a display";
  } catch (const WindowError& error) {
    EXPECT_EQ(std::string(error.what()).rfind("no display: ", 0), 0u) << error.what();
  }
}

TEST(Window, ShowsTheImageUprightAndKeepsTheCallersContext) {
  const VirtualDisplay display;
  if (display.display().empty()) FIVEPIPE_SKIP_WITHOUT_PACKAGE("Xvfb is not installed");
  test::CheckedGlContext context;
  const gl::GlFramebuffer framebuffer(8, 8, GL_RGBA8, gl::DepthBuffer::none);
  cv::Mat image(240, 320, CV_8UC3, cv::Scalar(200, 30, 10));
  image.rowRange(0, 20).setTo(cv::Scalar(10, 20, 250));
  {
    Window window("fivepipe", 320, 240);
    EXPECT_TRUE(window.show(image));
    cv::Mat seen;
    while (seen.empty()) seen = window.screenshot();
    ASSERT_EQ(seen.size(), image.size());
    EXPECT_EQ(cv::norm(seen, image, cv::NORM_INF), 0);

    const float green[] = {0, 1, 0, 1};
    framebuffer.bind();
    glClearBufferfv(GL_COLOR, 0, green);
    std::uint8_t rgba[4] = {};
    glReadPixels(3, 3, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
    EXPECT_EQ(rgba[1], 255);
  }
}

}  // namespace
}  // namespace fivepipe::render
