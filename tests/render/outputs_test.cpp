#include "render_node/output/outputs.h"
#include "tests/support/process/file_size_limit.h"
#include "tests/support/test_folder.h"

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <fstream>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

// A test that holds this mutex blocks all threads that query the free space of a disk.
static std::mutex statvfs_gate;
// The queries so far. 0: the standard library calls another function.
static std::atomic<int> statvfs_calls = 0;
extern "C" int statvfs(const char* path, struct statvfs* space) noexcept {
  const std::lock_guard wait(statvfs_gate);
  ++statvfs_calls;
  static const auto next =
      reinterpret_cast<int (*)(const char*, struct statvfs*)>(dlsym(RTLD_NEXT, "statvfs"));
  return next(path, space);
}

namespace fivepipe::render {
namespace {

namespace fs = std::filesystem;

class Outputs : public testing::Test {
 protected:
  const test::TestFolder test_folder_;
  const fs::path folder_ = test_folder_.path;
};

const cv::Size kSize(160, 120);

// Returns a grey image with a bright bar whose column encodes the frame number.
cv::Mat frame_image(int number) {
  cv::Mat image(kSize, CV_8UC3, cv::Scalar(90, 90, 90));
  image.colRange(4 * number, 4 * number + 4).setTo(cv::Scalar(230, 230, 230));
  return image;
}

template <typename Act>
std::string error_of(Act act) {
  try {
    act();
  } catch (const OutputError& error) {
    return error.what();
  }
  return "no error";
}

// By FFmpeg alone: GStreamer, which OpenCV tries next, may wait for ever for the first frame of a
// video without frames.
std::uint64_t frames_in(const fs::path& video) {
  cv::VideoCapture capture(video.string(), cv::CAP_FFMPEG);
  std::uint64_t frames = 0;
  while (capture.grab()) ++frames;
  return frames;
}

VideoOptions roomy() {
  VideoOptions options;
  options.queue_frames = 100;
  options.min_free_bytes = 1;
  return options;
}

TEST_F(Outputs, AVideoContainsEveryFrameInOrder) {
  constexpr int kFrames = 40;
  VideoFile video(folder_ / "v.mp4", kSize, roomy());
  for (int i = 0; i < kFrames; ++i) EXPECT_TRUE(video.add(frame_image(i)));
  video.finish(std::chrono::seconds(20));
  EXPECT_EQ(video.dropped(), 0u);

  cv::VideoCapture capture((folder_ / "v.mp4").string(), cv::CAP_FFMPEG);
  ASSERT_TRUE(capture.isOpened());
  EXPECT_NEAR(capture.get(cv::CAP_PROP_FPS), 30, 0.01);
  int frames = 0;
  for (cv::Mat image; capture.read(image); ++frames) {
    ASSERT_EQ(image.size(), kSize);
    // The coding is lossy; the bar is 140 levels brighter than its surroundings.
    EXPECT_GT(image.at<cv::Vec3b>(60, 4 * frames + 2)[1], 160) << frames;
    EXPECT_LT(image.at<cv::Vec3b>(60, (4 * frames + 80) % 160)[1], 160) << frames;
  }
  EXPECT_EQ(frames, kFrames);
}

TEST_F(Outputs, AddToAFullQueueDropsTheNewFrame) {
  VideoOptions options = roomy();
  options.queue_frames = 2;
  // Encoding this size takes milliseconds, add() takes microseconds.
  const cv::Size large(1280, 960);
  VideoFile video(folder_ / "v.mp4", large, options);
  cv::Mat noise(large, CV_8UC3);
  cv::randu(noise, 0, 255);
  std::uint64_t taken = 0;
  constexpr std::uint64_t kFrames = 50;
  for (std::uint64_t i = 0; i < kFrames; ++i) taken += video.add(noise);
  EXPECT_LT(taken, kFrames);
  video.finish(std::chrono::seconds(20));
  EXPECT_EQ(frames_in(folder_ / "v.mp4"), taken);
  EXPECT_EQ(video.dropped(), kFrames - taken);
}

TEST_F(Outputs, AddWaitsForRoomIfToldTo) {
  VideoOptions options = roomy();
  options.queue_frames = 2;
  const cv::Size large(1280, 960);
  VideoFile video(folder_ / "v.mp4", large, options);
  cv::Mat noise(large, CV_8UC3);
  cv::randu(noise, 0, 255);
  constexpr std::uint64_t kFrames = 20;
  for (std::uint64_t i = 0; i < kFrames; ++i) EXPECT_TRUE(video.add(noise, WhenFull::wait));
  video.finish(std::chrono::seconds(20));
  EXPECT_EQ(frames_in(folder_ / "v.mp4"), kFrames);
  EXPECT_EQ(video.dropped(), 0u);
}

TEST_F(Outputs, AddThatWaitsLeavesFewFramesForTheEnd) {
  const cv::Size large(1280, 960);
  VideoFile video(folder_ / "v.mp4", large, roomy());
  cv::Mat noise(large, CV_8UC3);
  cv::randu(noise, 0, 255);
  for (int i = 0; i < 12; ++i) EXPECT_TRUE(video.add(noise, WhenFull::wait));
  video.finish(std::chrono::milliseconds(0));
  EXPECT_LE(video.dropped(), VideoFile::kMaxAhead + 1) << "with the one that the encoder takes";
}

TEST_F(Outputs, FinishDropsTheFramesThatMissTheDeadline) {
  const cv::Size large(1280, 960);
  VideoFile video(folder_ / "v.mp4", large, roomy());
  cv::Mat noise(large, CV_8UC3);
  cv::randu(noise, 0, 255);
  constexpr std::uint64_t kFrames = 50;
  for (std::uint64_t i = 0; i < kFrames; ++i) EXPECT_TRUE(video.add(noise));
  video.finish(std::chrono::milliseconds(0));
  EXPECT_GT(video.dropped(), 0u);
  EXPECT_EQ(frames_in(folder_ / "v.mp4"), kFrames - video.dropped());
}

TEST_F(Outputs, DestructorFinishesVideo) {
  { VideoFile(folder_ / "v.mp4", kSize, roomy()).add(frame_image(1)); }
  cv::VideoCapture capture((folder_ / "v.mp4").string(), cv::CAP_FFMPEG);
  cv::Mat image;
  EXPECT_TRUE(capture.read(image));
}

TEST_F(Outputs, SecondFinishDoesNothingAndLaterFramesAreDropped) {
  VideoFile video(folder_ / "v.mp4", kSize, roomy());
  video.finish(std::chrono::seconds(20));
  video.finish(std::chrono::seconds(20));
  EXPECT_FALSE(video.add(frame_image(0)));
  EXPECT_EQ(video.dropped(), 1u);
}

TEST_F(Outputs, AFrameOfAnotherSizeOrTypeIsDropped) {
  VideoFile video(folder_ / "v.mp4", kSize, roomy());
  EXPECT_FALSE(video.add(cv::Mat(100, 100, CV_8UC3)));
  EXPECT_FALSE(video.add(cv::Mat(kSize, CV_8UC1)));
  EXPECT_FALSE(video.add(cv::Mat()));
  EXPECT_EQ(video.dropped(), 3u);
}

TEST_F(Outputs, ErrorExplainsUnwritableVideo) {
  const auto message = [&](const fs::path& file, cv::Size size,
                           const VideoOptions& options = roomy()) {
    return error_of([&] { VideoFile(file, size, options).wait_until_open(); });
  };
  EXPECT_NE(message(folder_ / "missing" / "v.mp4", kSize).find("missing does not exist"),
            std::string::npos);
  EXPECT_NE(message(folder_ / "v.mp4", {161, 120}).find("even, not 161x120"), std::string::npos);
  VideoOptions no_room = roomy();
  no_room.min_free_bytes = std::uintmax_t(1) << 60;
  EXPECT_NE(message(folder_ / "v.mp4", kSize, no_room).find("disk full"), std::string::npos);
  fs::create_directory(folder_ / "folder.mp4");
  EXPECT_NE(message(folder_ / "folder.mp4", kSize).find("folder.mp4"), std::string::npos);
}

TEST_F(Outputs, AVideoHasAnEvenSizeAndAPositiveFrameRate) {
  const auto message = [&](cv::Size size, double frame_rate_hz) {
    VideoOptions options = roomy();
    options.frame_rate_hz = frame_rate_hz;
    return error_of([&] { VideoFile(folder_ / "v.mp4", size, options); });
  };
  const std::string file = (folder_ / "v.mp4").string();
  for (const cv::Size size : {cv::Size(0, 120), {160, 0}, {-2, 120}, {160, -2}, {160, 121}})
    EXPECT_EQ(message(size, 30), file + ": a video's width and height must be even, not " +
                                     std::to_string(size.width) + "x" +
                                     std::to_string(size.height));
  for (const double rate_hz : {0.0, -1.0, std::nan("")})
    EXPECT_EQ(message(kSize, rate_hz), file + ": the frame rate is not above 0");
  EXPECT_EQ(message(kSize, 0.5), "no error");
  // The encoder may refuse a width of 2, but it is even.
  for (const cv::Size size : {cv::Size(2, 120), {160, 2}})
    EXPECT_EQ(message(size, 30).find("must be even"), std::string::npos) << size;
}

TEST_F(Outputs, AFullDiskIsNamedInMebibytes) {
  VideoOptions options = roomy();
  options.min_free_bytes = std::uintmax_t(1) << 60;
  const std::string message = error_of([&] { VideoFile(folder_ / "v.mp4", kSize, options); });
  const std::string needed = " MiB free, 1099511627776 MiB needed; free disk space";
  ASSERT_TRUE(message.ends_with(needed)) << message;
  const double free_mib = std::stod(message.substr(message.find("disk full: ") + 11));
  const double expected_mib = double(fs::space(folder_).available) / (1 << 20);
  EXPECT_LT(std::abs(std::log2(free_mib / expected_mib)), 0.5) << message;
}

// A video leaves 64 MiB free and queues one second at 30 Hz.
TEST_F(Outputs, OptionsHaveDefaults) {
  EXPECT_EQ(VideoOptions().frame_rate_hz, 30);
  EXPECT_EQ(VideoOptions().queue_frames, 30u);
  EXPECT_EQ(VideoOptions().min_free_bytes, std::uintmax_t(1) << 26);
}

// The frame in the encoder is not one of those that wait.
TEST_F(Outputs, AsManyFramesAsConfiguredWaitForABusyEncoder) {
  for (const std::size_t queue_frames : {1u, 4u}) {
    VideoOptions options = roomy();
    options.queue_frames = queue_frames;
    statvfs_calls = 0;
    VideoFile video(folder_ / "v.mp4", kSize, options);
    ASSERT_GT(statvfs_calls, 0) << "the replacement of statvfs is not in use";
    // The encoder queries the free space before it encodes a frame.
    std::unique_lock gate(statvfs_gate);
    std::size_t taken = 0;
    for (int i = 0; i < 10; ++i) taken += video.add(frame_image(i));
    EXPECT_EQ(taken, queue_frames + 1);
    gate.unlock();
    video.finish(std::chrono::seconds(20));
    EXPECT_EQ(frames_in(folder_ / "v.mp4"), taken);
    EXPECT_EQ(video.dropped(), 10 - taken);
  }
}

TEST_F(Outputs, OneFrameWaitsInAQueueOfOne) {
  VideoOptions options = roomy();
  options.queue_frames = 1;
  VideoFile video(folder_ / "v.mp4", kSize, options);
  EXPECT_TRUE(video.add(frame_image(1)));
  video.finish(std::chrono::seconds(20));
  EXPECT_EQ(frames_in(folder_ / "v.mp4"), 1u);
}

// The encoder must not slow down the nodes: neither its thread nor those of the codec. A thread of
// a lower priority stays as it is.
TEST_F(Outputs, TheEncoderHasALowPriority) {
  if (getpriority(PRIO_PROCESS, 0) >= 10) return;
  const auto threads = [] {
    std::set<id_t> ids;
    for (const auto& task : fs::directory_iterator("/proc/self/task"))
      ids.insert(id_t(std::stoul(task.path().filename())));
    return ids;
  };
  const std::set<id_t> before = threads();
  VideoFile video(folder_ / "v.mp4", kSize, roomy());
  video.wait_until_open();
  int encoders = 0;
  for (const id_t thread : threads()) {
    if (before.contains(thread)) continue;
    ++encoders;
    EXPECT_EQ(getpriority(PRIO_PROCESS, thread), 10);
  }
  EXPECT_GT(encoders, 1);
  EXPECT_LT(getpriority(PRIO_PROCESS, 0), 10);
}

TEST_F(Outputs, AFailedWriteOfTheEncoderEndsTheVideo) {
  VideoFile video(folder_ / "v.mp4", kSize, roomy());
  cv::Mat noise(kSize, CV_8UC3);
  cv::randu(noise, 0, 255);
  const test::FileSizeLimit limit(1000);  // has the effect of a full disk
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (video.dropped() == 0) {
    ASSERT_LT(std::chrono::steady_clock::now(), deadline);
    video.add(noise);
  }
  EXPECT_EQ(error_of([&] { video.finish(std::chrono::seconds(20)); }),
            (folder_ / "v.mp4").string() + ": cannot write it: File too large");
}

// The codec holds the frames back until the end.
TEST_F(Outputs, AFailedWriteAtTheEndIsAnError) {
  VideoFile video(folder_ / "v.mp4", kSize, roomy());
  EXPECT_TRUE(video.add(frame_image(1)));
  const test::FileSizeLimit limit(10);
  EXPECT_EQ(error_of([&] { video.finish(std::chrono::seconds(20)); }),
            (folder_ / "v.mp4").string() + ": cannot write it: File too large");
}

// Without its folder, the space on the disk is unknown.
TEST_F(Outputs, AfterAFailedWriteTheVideoDropsEveryFrameAndFinishThrows) {
  fs::create_directory(folder_ / "sub");
  VideoFile video(folder_ / "sub" / "v.mp4", kSize, roomy());
  video.wait_until_open();
  fs::remove_all(folder_ / "sub");
  EXPECT_TRUE(video.add(frame_image(1)));
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (video.dropped() == 0) ASSERT_LT(std::chrono::steady_clock::now(), deadline);
  EXPECT_FALSE(video.add(frame_image(2)));
  EXPECT_EQ(error_of([&] { video.finish(std::chrono::seconds(20)); }),
            (folder_ / "sub" / "v.mp4").string() + ": No such file or directory");
  EXPECT_EQ(video.dropped(), 2u);
  EXPECT_EQ(error_of([&] { video.finish(); }), "no error");  // a second call does nothing
}

// The frames that the codec holds back at that time are not lost.
TEST_F(Outputs, AVideoThatEndsOnAFullDiskHasAllFramesBeforeIt) {
  constexpr int kFrames = 30;
  fs::create_directory(folder_ / "sub");
  VideoFile video(folder_ / "sub" / "v.mp4", kSize, roomy());
  const int calls = statvfs_calls;
  for (int i = 0; i < kFrames; ++i) EXPECT_TRUE(video.add(frame_image(i)));
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (statvfs_calls < calls + kFrames) ASSERT_LT(std::chrono::steady_clock::now(), deadline);
  std::unique_lock gate(statvfs_gate);             // the last query has ended
  fs::rename(folder_ / "sub", folder_ / "moved");  // the next one fails
  gate.unlock();
  EXPECT_TRUE(video.add(frame_image(kFrames)));
  EXPECT_EQ(error_of([&] { video.finish(std::chrono::seconds(20)); }),
            (folder_ / "sub" / "v.mp4").string() + ": No such file or directory");
  EXPECT_EQ(video.dropped(), 1u);
  EXPECT_EQ(frames_in(folder_ / "moved" / "v.mp4"), kFrames);
}

TEST_F(Outputs, AVideoThatCannotBeOpenedDropsEveryFrameAndFinishThrows) {
  fs::create_directory(folder_ / "v.mp4");
  VideoFile video(folder_ / "v.mp4", kSize, roomy());
  video.add(frame_image(1));
  EXPECT_EQ(error_of([&] { video.finish(std::chrono::seconds(20)); }),
            (folder_ / "v.mp4").string() + ": cannot create it: Is a directory");
  EXPECT_FALSE(video.add(frame_image(2)));
  EXPECT_EQ(video.dropped(), 2u);
}

TEST_F(Outputs, AVideoThatHasDisappearedIsAnErrorIfItHadFrames) {
  for (const bool with_frame : {false, true}) {
    VideoFile video(folder_ / "v.mp4", kSize, roomy());
    video.wait_until_open();
    fs::remove(folder_ / "v.mp4");
    if (with_frame) video.add(frame_image(1));
    EXPECT_EQ(error_of([&] { video.finish(std::chrono::seconds(20)); }),
              with_frame ? (folder_ / "v.mp4").string() +
                               ": the encoder wrote nothing: No such file or directory"
                         : "no error");
  }
}

TEST_F(Outputs, AnEmptyVideoIsAnErrorIfItHadFrames) {
  VideoFile video(folder_ / "v.mp4", kSize, roomy());
  video.wait_until_open();
  video.add(frame_image(1));
  // The encoder writes into the file that had this name.
  fs::remove(folder_ / "v.mp4");
  std::ofstream(folder_ / "v.mp4").flush();
  EXPECT_EQ(error_of([&] { video.finish(std::chrono::seconds(20)); }),
            (folder_ / "v.mp4").string() + ": the encoder wrote nothing");
}

TEST_F(Outputs, AFailedStillNamesTheStepAndLeavesNoTemporaryFile) {
  const std::string file = (folder_ / "s.png").string();
  const auto message = [&] { return error_of([&] { write_png(file, frame_image(1)); }); };
  fs::create_directory(file);
  EXPECT_EQ(message(), file + ": cannot rename the temporary file: Is a directory");
  EXPECT_FALSE(fs::exists(file + ".part"));
  fs::create_directory(file + ".part");
  EXPECT_EQ(message(), file + ": cannot create it: Is a directory");
}

TEST_F(Outputs, AnUnwritableFolderIsNamed) {
  const fs::path folder = folder_ / "locked";
  fs::create_directory(folder);
  fs::permissions(folder, fs::perms(0555));
  // Root may write into any folder; access() tests the rights of the real user.
  const bool is_root = getuid() == 0;
  if (is_root) {
    ASSERT_EQ(setreuid(65534, 0), 0);
  }
  const std::string message = error_of([&] { write_png(folder / "s.png", frame_image(0)); });
  if (is_root) {
    ASSERT_EQ(setreuid(0, 0), 0);
  }
  EXPECT_EQ(message, (folder / "s.png").string() + ": folder " + folder.string() +
                         " is not writable: Permission denied");
}

TEST_F(Outputs, AStillIsExactAndReplacesThePreviousOne) {
  const fs::path file = folder_ / "still.png";
  for (int number : {3, 7}) {
    write_png(file, frame_image(number));
    EXPECT_EQ(cv::norm(cv::imread(file.string()), frame_image(number), cv::NORM_INF), 0);
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1)
      << "a temporary file remains";
}

TEST_F(Outputs, FailedStillKeepsOldFile) {
  EXPECT_NE(error_of([&] {
              write_png(folder_ / "missing" / "s.png", frame_image(0));
            }).find("missing does not exist"),
            std::string::npos);
  EXPECT_NE(error_of([&] { write_png(folder_ / "s.png", cv::Mat()); }).find("s.png: not an image"),
            std::string::npos);

  write_png(folder_ / "s.png", frame_image(1));
  // A write beyond a limit on file sizes fails like one to a full disk.
  cv::Mat noise(kSize, CV_8UC3);
  cv::randu(noise, 0, 255);
  const std::string message = error_of([&] {
    const test::FileSizeLimit limit(100);
    write_png(folder_ / "s.png", noise);
  });
  EXPECT_NE(message.find("s.png: cannot write it: File too large"), std::string::npos) << message;
  EXPECT_EQ(cv::norm(cv::imread((folder_ / "s.png").string()), frame_image(1), cv::NORM_INF), 0);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

}  // namespace
}  // namespace fivepipe::render
