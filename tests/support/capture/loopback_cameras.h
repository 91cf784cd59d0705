// GigE Vision cameras of Aravis on loopback addresses, each a process
// (programs/genicam_camera.cpp).
#pragma once
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/process.h"

namespace fivepipe::test {

class LoopbackCameras {
 public:
  enum class Image { uniform, square };  // see programs/genicam_camera.cpp

  // The programs write their logs to `folder`.
  explicit LoopbackCameras(std::filesystem::path folder, Image image = Image::uniform)
      : folder_(std::move(folder)), image_(image) {}

  // Starts a camera whose images have this blue, or starts it again.
  void start(const std::string& address, const std::string& serial, int blue) {
    using Clock = std::chrono::steady_clock;
    using namespace std::chrono_literals;
    auto& program = programs_[serial];
    program.reset();
    std::vector<std::string> words{FIVEPIPE_BINARY_DIR "/genicam_camera", address, serial,
                                   std::to_string(blue)};
    if (image_ == Image::square) words.push_back("square");
    program = std::make_unique<Program>(words, folder_ / (serial + ".log"));
    for (const auto until = Clock::now() + 20s;
         program->said().find("ready") == std::string::npos && Clock::now() < until;)
      std::this_thread::sleep_for(5ms);
    ASSERT_NE(program->said().find("ready"), std::string::npos) << program->said();
  }
  // Has the effect of pulling the camera's cable.
  void kill(const std::string& serial) {
    programs_.at(serial)->signal(SIGKILL);
    programs_.at(serial)->wait_for_end(std::chrono::seconds(5));
  }

 private:
  std::filesystem::path folder_;
  Image image_;
  std::map<std::string, std::unique_ptr<Program>> programs_;  // by serial number
};

// Time in which a restarted camera is back: Aravis waits 3 s for an answer, and some tries fail
// while the old connection ends.
inline constexpr std::chrono::seconds kCameraIsBack{20};

}  // namespace fivepipe::test
