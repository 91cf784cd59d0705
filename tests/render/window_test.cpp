#include "render_node/output/window.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <opencv2/core.hpp>

#include "common/gl/objects.h"
#include "tests/support/checked_gl_context.h"
#include "tests/support/optional_package.h"
#include "tests/support/process/open_files.h"
#include "tests/support/virtual_display.h"

namespace fivepipe::render {
namespace {

// Shows the image and returns the window's pixels, once they show it.
cv::Mat shown(Window& window, const cv::Mat& image) {
  EXPECT_TRUE(window.show(image));
  cv::Mat seen;
  while (seen.empty() && window.show(image)) seen = window.screenshot();
  return window.screenshot();
}

// The part of the window that is not black.
cv::Rect bright_part(const cv::Mat& seen) {
  cv::Rect part(seen.cols, seen.rows, -seen.cols, -seen.rows);
  for (int v = 0; v < seen.rows; ++v)
    for (int u = 0; u < seen.cols; ++u)
      if (seen.at<cv::Vec3b>(v, u) != cv::Vec3b(0, 0, 0)) {
        const int right = std::max(part.x + part.width, u + 1),
                  bottom = std::max(part.y + part.height, v + 1);
        part.x = std::min(part.x, u);
        part.y = std::min(part.y, v);
        part.width = right - part.x;
        part.height = bottom - part.y;
      }
  return part;
}

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

// GLFW refuses a window without pixels, as it refuses one without a suitable OpenGL.
TEST(Window, ARefusedWindowIsAnErrorAndLeavesNoOpenFile) {
  const test::VirtualDisplay display;
  if (display.display().empty()) FIVEPIPE_SKIP_WITHOUT_PACKAGE("Xvfb is not installed");
  { const Window first("fivepipe", 64, 48); }  // libraries keep files open
  const std::size_t before = test::open_files();
  for (const bool has_pixels : {false, true}) {
    try {
      const Window window("fivepipe", has_pixels ? 64 : 0, 48);
      EXPECT_TRUE(has_pixels);
    } catch (const WindowError& error) {
      EXPECT_STREQ(error.what(), "no window: Invalid window size 0x48");
      EXPECT_FALSE(has_pixels);
    }
    EXPECT_EQ(test::open_files(), before) << has_pixels;
  }
}

TEST(Window, ShowsTheImageUprightAndKeepsTheCallersContext) {
  const test::VirtualDisplay display;
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

// The scaled sizes are 208.4, 320, 192 and 91.4 by 240, 123.6, 240 and 240 pixels.
TEST(Window, ScalesTheImageAndKeepsItsAspectRatio) {
  const test::VirtualDisplay display;
  if (display.display().empty()) FIVEPIPE_SKIP_WITHOUT_PACKAGE("Xvfb is not installed");
  Window window("fivepipe", 320, 240);
  EXPECT_TRUE(window.screenshot().empty()) << "before the first image";
  for (const auto& [size, part] : {std::pair{cv::Size(99, 114), cv::Rect(56, 0, 208, 240)},
                                   {cv::Size(88, 34), cv::Rect(0, 58, 320, 124)},
                                   {cv::Size(88, 110), cv::Rect(64, 0, 192, 240)},
                                   {cv::Size(40, 105), cv::Rect(114, 0, 91, 240)}}) {
    cv::Mat image(size, CV_8UC3, cv::Scalar(10, 20, 250));
    image.colRange(0, size.width / 2).setTo(cv::Scalar(250, 120, 10));
    image.row(0).setTo(cv::Scalar(90, 240, 30));
    const cv::Mat seen = shown(window, image);
    ASSERT_EQ(seen.size(), cv::Size(320, 240));
    EXPECT_EQ(bright_part(seen), part) << size;
    EXPECT_EQ(seen.at<cv::Vec3b>(part.y, part.x), cv::Vec3b(90, 240, 30));
    EXPECT_EQ(seen.at<cv::Vec3b>(part.y + part.height - 1, part.x), cv::Vec3b(250, 120, 10));
    EXPECT_EQ(seen.at<cv::Vec3b>(part.y + part.height - 1, part.x + part.width - 1),
              cv::Vec3b(10, 20, 250));
    // Linear interpolation between the halves.
    const auto* row = seen.ptr<cv::Vec3b>(part.y + part.height / 2);
    EXPECT_TRUE(std::any_of(row, row + 320, [](const cv::Vec3b& bgr) {
      return bgr[2] > 30 && bgr[2] < 230;
    })) << size;
  }
}

TEST(Window, ShowsAPartOfALargerImage) {
  const test::VirtualDisplay display;
  if (display.display().empty()) FIVEPIPE_SKIP_WITHOUT_PACKAGE("Xvfb is not installed");
  Window window("fivepipe", 64, 48);
  cv::Mat wide(48, 100, CV_8UC3);
  cv::randu(wide, 0, 255);
  const cv::Mat part = wide.colRange(20, 84);
  EXPECT_EQ(cv::norm(shown(window, part), part, cv::NORM_INF), 0);
}

TEST(Window, ReturnsTheKeysThatMoveParts) {
  const test::VirtualDisplay display;
  if (display.display().empty()) FIVEPIPE_SKIP_WITHOUT_PACKAGE("Xvfb is not installed");
  const cv::Mat image(48, 64, CV_8UC3, cv::Scalar(10, 20, 250));
  Window window("fivepipe", 64, 48);
  shown(window, image);
  EXPECT_TRUE(window.take_keys().empty());
  test::Keyboard keyboard;
  constexpr unsigned long kUp = 0xff52, kDown = 0xff54, kTab = 0xff09, kW = 0x77;
  for (const auto& [key, modifiers] :
       {std::pair{kUp, 0u}, {kW, 0u}, {kDown, keyboard.kShift}, {kTab, 0u}, {kDown, 0u}}) {
    keyboard.send(test::Keyboard::kPress, key, modifiers);
    keyboard.send(test::Keyboard::kRelease, key, modifiers);
  }
  using Keys = KeyPress::Key;
  const std::vector<KeyPress> expected{{Keys::up}, {Keys::down, true}, {Keys::next}, {Keys::down}};
  std::vector<KeyPress> seen;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (seen.size() < expected.size()) {
    ASSERT_LT(std::chrono::steady_clock::now(), deadline) << seen.size();
    shown(window, image);  // waits for the window's thread
    for (const KeyPress& press : window.take_keys()) seen.push_back(press);
  }
  EXPECT_TRUE(seen == expected);
  window.set_title("another title");
  EXPECT_EQ(shown(window, image).size(), image.size());
}

TEST(Window, QAndEscapeCloseIt) {
  const test::VirtualDisplay display;
  if (display.display().empty()) FIVEPIPE_SKIP_WITHOUT_PACKAGE("Xvfb is not installed");
  const cv::Mat image(48, 64, CV_8UC3, cv::Scalar(10, 20, 250));
  for (const unsigned long key : {0x71ul, 0xff1bul}) {  // XK_q, XK_Escape
    Window window("fivepipe", 64, 48);
    shown(window, image);
    test::Keyboard keyboard;
    keyboard.send(test::Keyboard::kPress, 0x77);  // XK_w
    keyboard.send(test::Keyboard::kRelease, 0x77);
    keyboard.send(test::Keyboard::kRelease, key);
    // Each of these waits for the window's thread, which handles the events in between.
    for (int i = 0; i < 5; ++i) EXPECT_EQ(shown(window, image).size(), image.size());
    keyboard.send(test::Keyboard::kPress, key);
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (window.show(image)) ASSERT_LT(std::chrono::steady_clock::now(), deadline);
    EXPECT_TRUE(window.screenshot().empty());
  }
}

}  // namespace
}  // namespace fivepipe::render
