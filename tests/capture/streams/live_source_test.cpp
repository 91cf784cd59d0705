// Sources of cameras that deliver while fivepipe runs, with a scripted stream.
#include "capture_node/sources/live_source.h"

#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "tests/support/capture/capture_rig.h"

namespace fivepipe::capture {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr int kWidth_px = 64, kHeight_px = 48;

NextImage image(int level, int width_px = kWidth_px) {
  return {NextImage::Status::image, {kHeight_px, width_px, CV_8UC3, cv::Scalar::all(level)}, 7, ""};
}

// What a stream does next. The test and the reader thread share it.
struct Script {
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<NextImage> images;    // next() waits for one
  std::deque<StreamFault> faults;  // of the next calls of open()
  bool is_blocked = false;         // next() does not return
  std::atomic<int> opened = 0, closed = 0;
  std::atomic<bool> has_blocked = false;  // a call of next()

  void push(NextImage next) {
    const std::lock_guard lock(mutex);
    images.push_back(std::move(next));
    changed.notify_all();
  }
  void block(bool blocked) {
    const std::lock_guard lock(mutex);
    is_blocked = blocked;
    changed.notify_all();
  }
};

class ScriptedStream final : public ImageStream {
 public:
  explicit ScriptedStream(std::shared_ptr<Script> script) : script_(std::move(script)) {}
  ~ScriptedStream() override { ++script_->closed; }
  std::optional<StreamFault> open() override {
    const std::lock_guard lock(script_->mutex);
    ++script_->opened;
    if (script_->faults.empty()) return {};
    const StreamFault fault = script_->faults.front();
    script_->faults.pop_front();
    return fault;
  }
  NextImage next() override {
    std::unique_lock lock(script_->mutex);
    if (script_->is_blocked) script_->has_blocked = true;
    script_->changed.wait(lock, [&] { return !script_->is_blocked; });
    if (!script_->changed.wait_for(lock, 20ms, [&] { return !script_->images.empty(); }))
      return {NextImage::Status::none, {}, 0, hint};
    NextImage next = std::move(script_->images.front());
    script_->images.pop_front();
    if (next.why == "throws") throw std::runtime_error("conversion failed");
    return next;
  }
  std::string hint;

 private:
  std::shared_ptr<Script> script_;
};

class LiveSources : public testing::Test {
 protected:
  static config::RigCamera camera() {
    return test::table_camera("cam", {0, -1, 1}, kWidth_px, kHeight_px);
  }
  std::unique_ptr<ImageSource> opened(LiveSourceSettings settings = {.name = "device"}) {
    return open_live_source(camera(), std::move(settings),
                            std::make_unique<ScriptedStream>(script_));
  }
  // Level of the next image; -1: missing, -2: end.
  static int shown(ImageSource& source) {
    cv::Mat read;
    const ReadStatus status = test::read_next(source, read);
    if (status != ReadStatus::image) return status == ReadStatus::missing ? -1 : -2;
    return int(read.at<cv::Vec3b>(0, 0)[0]);
  }
  // Reads until the level is shown; false after 10 s.
  static bool comes(ImageSource& source, int level) {
    for (const auto until = Clock::now() + 10s; Clock::now() < until;)
      if (shown(source) == level) return true;
    return false;
  }
  SourceProblem problem(LiveSourceSettings settings = {.name = "device"}) {
    try {
      opened(std::move(settings));
    } catch (const SourceError& error) {
      return error.problems().at(0);
    }
    ADD_FAILURE() << "no SourceError";
    return {};
  }
  const std::shared_ptr<Script> script_ = std::make_shared<Script>();
};

TEST_F(LiveSources, ALostCameraIsMissingAtOnceAndComesBack) {
  script_->push(image(10));
  const auto source = opened();
  EXPECT_EQ(source->stamp_ns(), 7);
  {
    const std::lock_guard lock(script_->mutex);
    script_->faults = {{SourceFault::hardware_missing, "no such camera"}};
  }
  script_->push({NextImage::Status::lost, {}, 0, "cable pulled"});
  EXPECT_EQ(shown(*source), -1);
  const auto start = Clock::now();
  EXPECT_EQ(shown(*source), -1);
  EXPECT_LT(Clock::now() - start, 250ms) << "a known loss is no reason to wait";
  EXPECT_EQ(source->last_error(), "device: stopped delivering: cable pulled");
  while (script_->opened < 2) std::this_thread::sleep_for(1ms);
  while (source->last_error().find("connecting") == std::string::npos) shown(*source);
  EXPECT_EQ(source->last_error(),
            "device: stopped delivering: cable pulled; connecting again: no such camera");
  script_->push(image(20));
  EXPECT_TRUE(comes(*source, 20));
  EXPECT_EQ(script_->opened, 3) << "one attempt failed";
  EXPECT_EQ(script_->closed, 0) << "the stream itself opens again";
}

TEST_F(LiveSources, AttemptsAreHalfASecondApart) {
  script_->push(image(10));
  const auto source = opened();
  {
    const std::lock_guard lock(script_->mutex);
    for (int i = 0; i < 3; ++i)
      script_->faults.push_back({SourceFault::hardware_missing, "no such camera"});
  }
  const auto start = Clock::now();
  script_->push({NextImage::Status::lost, {}, 0, "cable pulled"});
  script_->push(image(20));
  EXPECT_TRUE(comes(*source, 20));
  EXPECT_EQ(script_->opened, 5);
  EXPECT_GE(Clock::now() - start, 1900ms);
}

TEST_F(LiveSources, AnExceptionOfTheStreamIsALoss) {
  script_->push(image(10));
  const auto source = opened();
  script_->push({NextImage::Status::none, {}, 0, "throws"});
  script_->push(image(30));
  while (source->last_error().empty()) shown(*source);
  EXPECT_EQ(source->last_error(), "device: stopped delivering: conversion failed");
  EXPECT_TRUE(comes(*source, 30));
}

TEST_F(LiveSources, TheLastImageComesBeforeTheEnd) {
  script_->push(image(10));
  const auto source = opened();
  script_->push(image(20));
  script_->push({NextImage::Status::end, {}, 0, ""});
  while (script_->closed == 0) std::this_thread::sleep_for(1ms);
  EXPECT_EQ(shown(*source), 20);
  EXPECT_EQ(shown(*source), -2);
  EXPECT_EQ(shown(*source), -2);
  EXPECT_EQ(script_->opened, 1);
}

TEST_F(LiveSources, FaultsOfOpeningAreThrown) {
  script_->faults = {{SourceFault::not_decodable, "wrong text"}};
  SourceProblem found = problem();
  EXPECT_EQ(found.camera, "cam");
  EXPECT_EQ(found.fault, SourceFault::not_decodable);
  EXPECT_EQ(found.what, "device: wrong text");
  EXPECT_EQ(script_->closed, 1);
  script_->push({NextImage::Status::end, {}, 0, ""});
  found = problem();
  EXPECT_EQ(found.fault, SourceFault::no_frames);
  script_->push({NextImage::Status::lost, {}, 0, "nobody there"});
  found = problem();
  EXPECT_EQ(found.fault, SourceFault::hardware_failed);
  EXPECT_EQ(found.what, "device: delivers no images: nobody there");
  found = problem({"device", 100ms, "is it switched on?"});
  EXPECT_EQ(found.fault, SourceFault::hardware_failed);
  EXPECT_EQ(found.what, "device: delivers no images: is it switched on?");
  EXPECT_EQ(script_->closed, 4) << "each stream is closed";
}

TEST_F(LiveSources, APauseIsExplainedByTheHintOfTheStream) {
  script_->push(image(10));
  auto stream = std::make_unique<ScriptedStream>(script_);
  stream->hint = "packets are lost";
  const auto source = open_live_source(camera(), {.name = "device"}, std::move(stream));
  EXPECT_EQ(shown(*source), -1);
  EXPECT_EQ(source->last_error(), "device: no image within 0.5 s: packets are lost");
}

TEST_F(LiveSources, ReadDoesNotWait) {
  script_->push(image(10));
  const auto source = opened();
  const auto start = Clock::now();
  cv::Mat bgr;
  EXPECT_EQ(source->read(0, bgr), ReadStatus::missing) << "opening has read the first image";
  source->wait_for_image(start);
  EXPECT_LT(Clock::now() - start, 250ms);
  script_->push(image(20));
  source->wait_for_image(Clock::now() + 10s);
  EXPECT_EQ(source->read(0, bgr), ReadStatus::image);
  EXPECT_LT(Clock::now() - start, 5s);
}

// Ten blocked drivers end in the time of one.
TEST_F(LiveSources, StopLetsSeveralBlockedSourcesEndTogether) {
  std::vector<std::shared_ptr<Script>> scripts;
  std::vector<std::unique_ptr<ImageSource>> sources;
  for (int i = 0; i < 10; ++i) {
    scripts.push_back(std::make_shared<Script>());
    scripts.back()->push(image(10));
    sources.push_back(open_live_source(camera(), {.name = "device"},
                                       std::make_unique<ScriptedStream>(scripts.back())));
    scripts.back()->block(true);
  }
  for (const auto& script : scripts)
    while (!script->has_blocked) std::this_thread::sleep_for(1ms);
  const auto start = Clock::now();
  for (const auto& source : sources) source->stop();
  EXPECT_LT(Clock::now() - start, 500ms) << "stop() does not wait";
  sources.clear();
  EXPECT_LT(Clock::now() - start, 1900ms);
  for (const auto& script : scripts) {
    EXPECT_EQ(script->closed, 0);
    script->block(false);
    for (const auto until = Clock::now() + 10s; script->closed < 1 && Clock::now() < until;)
      std::this_thread::sleep_for(1ms);
    EXPECT_EQ(script->closed, 1) << "its thread ends by itself";
  }
}

}  // namespace
}  // namespace fivepipe::capture
