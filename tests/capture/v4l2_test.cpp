// V4L2 cameras, with a scripted driver in place of OpenCV's.
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <set>
#include <thread>

#include "capture_node/capture.h"
#include "common/base/realtime.h"
#include "tests/support/capture/capture_rig.h"
#include "tests/support/process/open_files.h"
#include "tests/support/test_folder.h"

namespace fivepipe::capture {
namespace {

using namespace std::chrono_literals;

constexpr int kWidth_px = 64, kHeight_px = 48;
// A character device that every machine has and may open.
const std::string kDevice = "/dev/null";

cv::Mat picture(int level, int width_px = kWidth_px, int height_px = kHeight_px) {
  return {height_px, width_px, CV_8UC3, cv::Scalar::all(level)};
}

struct Reply {
  cv::Mat image;  // empty: the read fails with `error`
  int error = 0;
};

// Replaces the device behind cv::VideoCapture in this program.
class Driver {
 public:
  void reset() {
    const std::lock_guard lock(mutex_);
    replies_.clear();
    settings.clear();
    lacks_format = false;
    fourcc = cv::VideoWriter::fourcc('Y', 'U', 'Y', 'V');
    opened.clear();
    opens = true;
    kernel_stamp_ms = 0;
    endless_ = cv::Mat();
    open_error = 0;
    reads_ = 0;
    unplugged_.clear();
  }
  // The device fails from now on, or works again.
  void unplug(const std::string& device, bool is_unplugged) {
    const std::lock_guard lock(mutex_);
    if (is_unplugged)
      unplugged_.insert(device);
    else
      unplugged_.erase(device);
    changed_.notify_all();
  }
  bool open(const cv::VideoCapture* video, const std::string& device, int by_api) {
    const std::lock_guard lock(mutex_);
    api = by_api;
    devices_[video] = opened = device;
    if (unplugged_.contains(device)) errno = ENODEV;
    if (open_error != 0) errno = open_error;
    return opens && !unplugged_.contains(device);
  }
  bool set(int property, double value) {
    const std::lock_guard lock(mutex_);
    settings.emplace_back(property, value);
    if (property == cv::CAP_PROP_FOURCC && !lacks_format) fourcc = int(value);
    return true;
  }
  void push(const Reply& reply) {
    const std::lock_guard lock(mutex_);
    replies_.push_back(reply);
    changed_.notify_all();
  }
  // Delivers this image every millisecond from now on.
  void go_on(const cv::Mat& image = picture(1)) {
    const std::lock_guard lock(mutex_);
    endless_ = image;
    changed_.notify_all();
  }
  void pause() {
    const std::lock_guard lock(mutex_);
    endless_ = cv::Mat();
  }
  // Waits until no thread reads.
  void wait_until_left() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !waiting_; });
  }
  // Waits until the reader has taken all replies and reads the next.
  void wait_until_taken() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return replies_.empty() && waiting_; });
  }
  int reads() {
    const std::lock_guard lock(mutex_);
    return reads_;
  }
  bool read(const cv::VideoCapture* video, cv::OutputArray image) {
    std::unique_lock lock(mutex_);
    ++reads_;
    waiting_ = true;
    changed_.notify_all();
    const auto is_unplugged = [&] { return unplugged_.contains(devices_[video]); };
    changed_.wait(lock, [&] { return !replies_.empty() || !endless_.empty() || is_unplugged(); });
    waiting_ = false;
    changed_.notify_all();
    if (is_unplugged()) {
      errno = ENODEV;
      return false;
    }
    if (replies_.empty()) {
      const cv::Mat next = endless_;
      lock.unlock();
      std::this_thread::sleep_for(1ms);
      next.copyTo(image);
      return true;
    }
    const Reply reply = replies_.front();
    replies_.pop_front();
    if (reply.error != 0) errno = reply.error;
    if (reply.image.empty()) return false;
    reply.image.copyTo(image);
    return true;
  }

  std::vector<std::pair<int, double>> settings;  // arguments of set()
  bool lacks_format = false;                     // that is requested
  int fourcc = 0;                                // of the images
  std::string opened;                            // argument of open()
  int api = 0;
  bool opens = true;
  int open_error = 0;
  // Of the images, in the clock of the kernel.
  std::atomic<double> kernel_stamp_ms = 0;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Reply> replies_;
  bool waiting_ = false;
  cv::Mat endless_;  // empty: the reader waits for the next reply
  std::map<const cv::VideoCapture*, std::string> devices_;
  std::set<std::string> unplugged_;
  int reads_ = 0;
};
Driver& driver() {
  static Driver one;
  return one;
}

}  // namespace
}  // namespace fivepipe::capture

// The linker takes these definitions instead of those in OpenCV's library.
namespace cv {
bool VideoCapture::open(const String& file, int api) {
  return fivepipe::capture::driver().open(this, file, api);
}
bool VideoCapture::set(int property, double value) {
  return fivepipe::capture::driver().set(property, value);
}
double VideoCapture::get(int property) const {
  if (property == CAP_PROP_FOURCC) return fivepipe::capture::driver().fourcc;
  EXPECT_EQ(property, int(CAP_PROP_POS_MSEC));
  return fivepipe::capture::driver().kernel_stamp_ms;
}
bool VideoCapture::read(OutputArray image) { return fivepipe::capture::driver().read(this, image); }
}  // namespace cv

namespace fivepipe::capture {
namespace {

class V4l2 : public testing::Test {
 protected:
  V4l2() { driver().reset(); }
  static config::RigCamera camera() {
    return test::table_camera("cam", {0, -1, 1}, kWidth_px, kHeight_px);
  }
  static config::V4l2Source v4l2(const std::string& format = "",
                                 std::optional<double> rate_hz = {}) {
    return {kDevice, config::LearnedBackground{"", 3}, format, rate_hz};
  }
  std::unique_ptr<ImageSource> opened(int first_level = 10) {
    driver().push({picture(first_level)});
    return open_v4l2_source(camera(), v4l2());
  }
  // Closes the source while the camera delivers.
  static void close(std::unique_ptr<ImageSource>& source) {
    driver().go_on();
    source.reset();
  }
  // Level of the next image; -1: missing.
  static int shown(ImageSource& source) {
    cv::Mat image;
    const ReadStatus status = test::read_next(source, image);
    EXPECT_NE(status, ReadStatus::end);
    return status == ReadStatus::image ? int(image.at<cv::Vec3b>(0, 0)[0]) : -1;
  }
  static SourceProblem problem(const config::V4l2Source& of = v4l2()) {
    try {
      auto source = open_v4l2_source(camera(), of);
      close(source);
    } catch (const HardwareMissing& missing) {
      EXPECT_EQ(missing.problems().size(), 1u);
      return missing.problems().at(0);
    } catch (const SourceError& error) {
      EXPECT_EQ(error.problems().size(), 1u);
      EXPECT_EQ(error.problems().at(0).fault, SourceFault::wrong_size);
      return error.problems().at(0);
    }
    ADD_FAILURE() << "no SourceError";
    return {};
  }
};

TEST_F(V4l2, RequestsTheSizeOfTheRigAndTheNewestImage) {
  const std::size_t before = test::open_files();
  auto source = opened();
  EXPECT_EQ(test::open_files(), before);
  EXPECT_EQ(driver().opened, kDevice);
  EXPECT_EQ(driver().api, int(cv::CAP_V4L2));
  EXPECT_EQ(driver().settings,
            (std::vector<std::pair<int, double>>{{cv::CAP_PROP_FRAME_WIDTH, kWidth_px},
                                                 {cv::CAP_PROP_FRAME_HEIGHT, kHeight_px},
                                                 {cv::CAP_PROP_BUFFERSIZE, 1}}));
  close(source);
}

// The size that a camera delivers depends on its format.
TEST_F(V4l2, RequestsTheFormatBeforeTheSizeAndTheRateAfterIt) {
  driver().push({picture(10)});
  auto source = open_v4l2_source(camera(), v4l2("MJPG", 60));
  EXPECT_EQ(driver().settings,
            (std::vector<std::pair<int, double>>{
                {cv::CAP_PROP_FOURCC, cv::VideoWriter::fourcc('M', 'J', 'P', 'G')},
                {cv::CAP_PROP_FRAME_WIDTH, kWidth_px},
                {cv::CAP_PROP_FRAME_HEIGHT, kHeight_px},
                {cv::CAP_PROP_BUFFERSIZE, 1},
                {cv::CAP_PROP_FPS, 60}}));
  close(source);
}

TEST_F(V4l2, ErrorOfAFormatThatTheCameraLacks) {
  driver().lacks_format = true;
  const SourceProblem found = problem(v4l2("MJPG"));
  EXPECT_EQ(found.fault, SourceFault::hardware_failed);
  EXPECT_EQ(found.what, "/dev/null: refuses the format MJPG; `fivepipe cameras` lists its formats");
  EXPECT_EQ(driver().reads(), 0);
}

TEST_F(V4l2, ReturnsTheNewestImageThatItHasNotReturnedBefore) {
  auto source = opened(10);
  for (const int level : {20, 30, 40}) driver().push({picture(level)});
  driver().wait_until_taken();
  EXPECT_EQ(shown(*source), 40);
  EXPECT_EQ(source->last_error(), "");
  std::thread later([] {
    std::this_thread::sleep_for(20ms);
    driver().push({picture(50)});
  });
  EXPECT_EQ(shown(*source), 50) << "waits for an image";
  later.join();
  close(source);
}

TEST_F(V4l2, TheStampIsThatOfTheKernelIfItIsPlausible) {
  using std::chrono::duration;
  using std::chrono::steady_clock;
  const auto kernel_ms = [] {
    return duration<double, std::milli>(steady_clock::now().time_since_epoch()).count();
  };
  auto source = opened();
  // 0: the driver sets no stamp.
  for (const double age_ms : {30.0, 900.0, -50.0, 5000.0, 0.0}) {
    driver().kernel_stamp_ms = age_ms == 0 ? 0 : kernel_ms() - age_ms;
    const std::int64_t before_ns = base::now_realtime_ns();
    driver().push({picture(20)});
    driver().wait_until_taken();
    EXPECT_EQ(shown(*source), 20);
    const std::int64_t after_ns = base::now_realtime_ns(), stamp_ns = source->stamp_ns();
    const double expected_ms = age_ms > 0 && age_ms < 1000 ? age_ms : 0;
    EXPECT_GE(1e-6 * double(stamp_ns - before_ns), -expected_ms - 1) << age_ms;
    EXPECT_LE(1e-6 * double(stamp_ns - after_ns), -expected_ms + 1) << age_ms;
  }
  close(source);
}

TEST_F(V4l2, AnImageOfAnotherSizeIsMissing) {
  auto source = opened();
  for (const auto& [width_px, height_px] :
       {std::pair{kWidth_px + 1, kHeight_px}, {kWidth_px, kHeight_px - 1}}) {
    driver().push({picture(20, width_px, height_px)});
    driver().wait_until_taken();
    EXPECT_EQ(shown(*source), -1);
    EXPECT_EQ(source->last_error(), "/dev/null: the size of the images has changed");
  }
  driver().push({picture(30)});
  driver().wait_until_taken();
  EXPECT_EQ(shown(*source), 30);
  close(source);
}

TEST_F(V4l2, AnUnpluggedCameraIsMissingUntilItComesBack) {
  auto source = opened();
  driver().push({picture(20), EBUSY});  // an earlier errno does not count
  driver().wait_until_taken();
  EXPECT_EQ(shown(*source), 20);
  driver().unplug(kDevice, true);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(shown(*source), -1);
    EXPECT_EQ(source->last_error(), "/dev/null: stopped delivering: No such device");
  }
  const auto start = std::chrono::steady_clock::now();
  const auto is_early = [&] { return std::chrono::steady_clock::now() - start < 10s; };
  while (source->last_error().find("connecting again") == std::string::npos && is_early())
    shown(*source);
  EXPECT_EQ(source->last_error(),
            "/dev/null: stopped delivering: No such device; connecting again: No such device");
  driver().unplug(kDevice, false);
  driver().go_on(picture(30));
  while (shown(*source) != 30 && is_early()) std::this_thread::sleep_for(1ms);
  EXPECT_TRUE(is_early());
  EXPECT_EQ(driver().settings.size(), 6u) << "the size is requested again";
  close(source);
}

// The driver gives a reason for a success, and none for the failure after it.
TEST_F(V4l2, TheErrnoOfAnEarlierImageIsNotTheReasonOfAFailure) {
  auto source = opened();
  driver().push({picture(20), EBUSY});
  driver().wait_until_taken();
  EXPECT_EQ(shown(*source), 20);
  driver().push({{}, 0});
  EXPECT_EQ(shown(*source), -1);
  EXPECT_EQ(source->last_error(),
            "/dev/null: stopped delivering: the device does not respond as a camera");
  close(source);
}

// A process without standard input gets descriptor 0 for its next file.
TEST_F(V4l2, OpensADeviceAsDescriptor0) {
  const int standard_input = dup(0);
  ::close(0);
  std::string error = "none";
  std::unique_ptr<ImageSource> source;
  try {
    source = opened();
  } catch (const SourceError& of_source) {
    error = of_source.what();
  }
  const bool is_free = dup(0) < 0;
  if (standard_input >= 0) {
    dup2(standard_input, 0);
    ::close(standard_input);
  }
  EXPECT_EQ(error, "none");
  EXPECT_TRUE(is_free) << "the device stays open";
  if (source) close(source);
}

TEST_F(V4l2, ACameraThatPausesIsMissingAfterHalfASecond) {
  auto source = opened();
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(shown(*source), -1);
  EXPECT_GE(std::chrono::steady_clock::now() - start, 500ms);
  EXPECT_EQ(source->last_error(), "/dev/null: no image within 0.5 s");
  driver().push({picture(60)});
  driver().wait_until_taken();
  EXPECT_EQ(shown(*source), 60);
  close(source);
}

TEST_F(V4l2, ClosingEndsTheReader) {
  auto source = opened();
  close(source);
  const int reads = driver().reads();
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(driver().reads(), reads);
}

TEST_F(V4l2, ClosingWaitsAtMostASecondForABlockedDriver) {
  auto source = opened();
  driver().wait_until_taken();
  const auto start = std::chrono::steady_clock::now();
  source.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - start, 5s) << "1 s, on a busy machine";
  driver().go_on();
  driver().wait_until_left();
}

TEST_F(V4l2, ErrorExplainsWhyTheDeviceDoesNotOpen) {
  driver().opens = false;
  for (const auto& [error, text] : std::vector<std::pair<int, std::string>>{
           {0, "the device does not respond as a camera"},
           {ENOSPC,
            "not enough USB bandwidth (ENOSPC): connect the cameras to separate USB controllers, "
            "or request format: MJPG, a lower rate_hz, or a smaller image (image_size_px in the "
            "rig)"},
           {EBUSY, "another program uses the device"},
           {EACCES, "no permission to open it: add the user to the group video"},
           {EPERM, "no permission to open it: add the user to the group video"},
           {EIO, "Input/output error"}}) {
    driver().open_error = error;
    errno = ENOENT;  // of an earlier call
    const SourceProblem found = problem();
    EXPECT_EQ(found.camera, "cam");
    EXPECT_EQ(found.fault, SourceFault::hardware_failed);
    EXPECT_EQ(found.what, "/dev/null: " + text);
  }
  EXPECT_EQ(driver().reads(), 0);
}

TEST_F(V4l2, ErrorExplainsWhyTheDeviceDeliversNoImages) {
  for (const auto& [error, text] : std::vector<std::pair<int, std::string>>{
           {0, "the device does not respond as a camera"}, {EIO, "Input/output error"}}) {
    driver().reset();
    driver().push({{}, error});
    const SourceProblem found = problem();
    EXPECT_EQ(found.fault, SourceFault::hardware_failed);
    EXPECT_EQ(found.what, "/dev/null: delivers no images: " + text);
    EXPECT_EQ(driver().reads(), 1);
  }
}

TEST_F(V4l2, ErrorOfAWrongSizeNamesBothSizes) {
  for (const auto& [width_px, height_px, text] :
       {std::tuple{65, 48, "65x48"}, {64, 47, "64x47"}, {32, 24, "32x24"}}) {
    driver().reset();
    // Every image has the wrong size, because opening tests the newest one.
    driver().go_on(picture(20, width_px, height_px));
    const SourceProblem found = problem();
    EXPECT_EQ(found.fault, SourceFault::wrong_size);
    EXPECT_EQ(found.what, "/dev/null: delivers images of " + std::string(text) +
                              " px, image_size_px of the rig is 64x48");
    const int reads = driver().reads();
    std::this_thread::sleep_for(20ms);
    EXPECT_EQ(driver().reads(), reads) << "the reader goes on";
  }
}

TEST_F(V4l2, DevicesAreListedByTheirPermanentNamesFirst) {
  const test::TestFolder folder;
  EXPECT_EQ(connected_devices(folder.path / "none"), "no V4L2 device is connected");
  for (const char* name : {"null", "audio", "v4l"}) std::ofstream(folder.path / name) << ' ';
  EXPECT_EQ(connected_devices(folder.path), "no V4L2 device is connected");
  std::filesystem::remove(folder.path / "v4l");
  std::filesystem::create_directories(folder.path / "v4l" / "by-id");
  for (const char* name : {"video1", "video10", "video0", "v4l/by-id/usb-b", "v4l/by-id/usb-a"})
    std::ofstream(folder.path / name) << ' ';
  const std::string dev = folder.path.string();
  EXPECT_EQ(connected_devices(folder.path), "connected devices: " + dev + "/v4l/by-id/usb-a " +
                                                dev + "/v4l/by-id/usb-b " + dev + "/video0 " + dev +
                                                "/video1 " + dev + "/video10");
}

TEST_F(V4l2, ErrorOfAMissingDeviceListsTheConnectedOnes) {
  for (const auto& [device, path] : {std::pair<std::string, std::string>{"97", "/dev/video97"},
                                     {"/dev/no_camera", "/dev/no_camera"},
                                     {"", ""},
                                     {"1a", "1a"}}) {
    try {
      open_v4l2_source(camera(), {device, {}});
      FAIL() << "no SourceError";
    } catch (const HardwareMissing& missing) {
      EXPECT_EQ(missing.problems().at(0).fault, SourceFault::hardware_missing);
      EXPECT_EQ(missing.problems().at(0).what,
                path + ": no such camera; " + connected_devices("/dev"));
    }
  }
}

// The background is that of the images after the first one, which opening reads.
TEST_F(V4l2, CaptureLearnsTheEmptySceneFromTheFirstImages) {
  config::Rig rig;
  rig.cameras = {camera()};
  config::Viewer viewer;
  viewer.path = {{0, {0, -0.8, 0.8}, {0, 0, 0.2}}};
  config::CaptureConfig config;
  config.sources["cam"] = v4l2();
  driver().go_on(picture(50));
  Capture capture(rig, viewer, config, 30);
  driver().pause();
  driver().wait_until_taken();
  cv::Mat with_object = picture(50);
  with_object(cv::Rect(8, 8, 20, 16)).setTo(cv::Scalar(10, 200, 10));
  driver().push({with_object});
  driver().wait_until_taken();
  EXPECT_EQ(capture.capture(0, false).at(0).pixels.value().bounds(),
            (hull::PixelRect{8, 8, 28, 24}));
  driver().push({{}, EIO});
  const auto last = capture.capture(1, false);
  EXPECT_EQ(last.at(0).status, CaptureStatus::missing);
  EXPECT_EQ(last.at(0).reason, "/dev/null: stopped delivering: Input/output error");
}

TEST_F(V4l2, CaptureTakesTheEmptySceneFromTheConfiguredPicture) {
  const test::TestFolder folder;
  cv::imwrite((folder.path / "empty.png").string(), picture(50));
  config::Rig rig;
  rig.cameras = {camera()};
  config::Viewer viewer;
  viewer.path = {{0, {0, -0.8, 0.8}, {0, 0, 0.2}}};
  config::CaptureConfig config;
  config.sources["cam"] = config::V4l2Source{
      kDevice, config::LearnedBackground{(folder.path / "empty.png").string(), 3}};
  driver().go_on(picture(90));
  Capture capture(rig, viewer, config, 30);
  EXPECT_EQ(capture.capture(0, false).at(0).pixels.value().count(),
            std::size_t(kWidth_px * kHeight_px));
}

TEST_F(V4l2, CaptureReadsAsManyImagesOfTheEmptySceneAsConfigured) {
  config::Rig rig;
  rig.cameras = {camera()};
  for (const int frames : {0, 1}) {
    driver().reset();
    config::CaptureConfig config;
    config.sources["cam"] = config::V4l2Source{kDevice, config::LearnedBackground{"", frames}};
    driver().go_on();
    const auto learn = [&] { Capture(rig, {}, config, 30); };
    if (frames == 0)
      EXPECT_THROW(learn(), SourceError) << "no image of the empty scene is wanted";
    else
      EXPECT_NO_THROW(learn());
  }
}

// A driver may deliver grey images of the right size.
TEST_F(V4l2, CaptureTakesNothingFromAnImageThatIsNotBgr) {
  const test::TestFolder folder;
  cv::imwrite((folder.path / "empty.png").string(), picture(50));
  config::Rig rig;
  rig.cameras = {camera()};
  config::Viewer viewer;
  viewer.path = {{0, {0, -0.8, 0.8}, {0, 0, 0.2}}};
  config::CaptureConfig config;
  config.sources["cam"] = config::V4l2Source{
      kDevice, config::LearnedBackground{(folder.path / "empty.png").string(), 3}};
  driver().go_on({kHeight_px, kWidth_px, CV_8UC1, cv::Scalar::all(200)});
  Capture capture(rig, viewer, config, 30);
  const CapturedCamera found = capture.capture(0, true).at(0);
  EXPECT_EQ(found.status, CaptureStatus::missing);
  EXPECT_EQ(found.reason, "the image is not 8-bit BGR of the size image_size_px");
  EXPECT_FALSE(found.pixels);
  EXPECT_FALSE(found.colour);
  EXPECT_TRUE(found.diagnostics.empty());
}

TEST_F(V4l2, CaptureNeedsAnImageOfTheEmptyScene) {
  config::Rig rig;
  rig.cameras = {camera()};
  config::CaptureConfig config;
  config.sources["cam"] = config::V4l2Source{kDevice, config::LearnedBackground{"", 2}};
  driver().push({picture(10)});
  driver().push({{}, EIO});
  try {
    Capture(rig, {}, config, 30);
    FAIL() << "no SourceError";
  } catch (const SourceError& error) {
    EXPECT_EQ(error.problems().at(0).fault, SourceFault::no_frames);
    EXPECT_STREQ(error.what(),
                 "cam: no image of the empty scene; /dev/null: stopped delivering: "
                 "Input/output error");
  }
}

TEST_F(V4l2, CaptureNeedsAllImagesOfTheEmptyScene) {
  config::Rig rig;
  rig.cameras = {camera()};
  config::CaptureConfig config;
  config.sources["cam"] = config::V4l2Source{kDevice, config::LearnedBackground{"", 400}};
  driver().go_on();
  std::thread later([] {
    while (driver().reads() < 50) std::this_thread::sleep_for(1ms);
    driver().unplug(kDevice, true);
  });
  try {
    Capture(rig, {}, config, 30);
    ADD_FAILURE() << "no SourceError";
  } catch (const SourceError& error) {
    EXPECT_EQ(error.problems().at(0).fault, SourceFault::no_frames);
    EXPECT_EQ(error.problems().at(0).what.rfind("only ", 0), 0u) << error.what();
    EXPECT_NE(error.problems().at(0).what.find(
                  " of 400 images of the empty scene; /dev/null: stopped delivering: No such"),
              std::string::npos)
        << error.what();
  }
  later.join();
}

// A silent camera delays one frame, not each of those until it is back.
TEST_F(V4l2, CaptureWaitsOnceForASilentCamera) {
  config::Rig rig;
  rig.cameras = {camera()};
  config::Viewer viewer;
  viewer.path = {{0, {0, -0.8, 0.8}, {0, 0, 0.2}}};
  config::CaptureConfig config;
  config.sources["cam"] = config::V4l2Source{kDevice, config::LearnedBackground{"", 1}};
  driver().go_on(picture(50));
  Capture capture(rig, viewer, config, 30);
  driver().pause();
  driver().wait_until_taken();
  const auto status = [&](int frame) { return capture.capture(frame, false).at(0).status; };
  int frame = 0;
  auto start = std::chrono::steady_clock::now();
  if (status(frame++) == CaptureStatus::captured) {  // the last image
    start = std::chrono::steady_clock::now();
    EXPECT_EQ(status(frame++), CaptureStatus::missing);
  }
  EXPECT_GE(std::chrono::steady_clock::now() - start, kImageTimeout);
  start = std::chrono::steady_clock::now();
  for (int i = 0; i < 10; ++i) EXPECT_EQ(status(frame++), CaptureStatus::missing);
  EXPECT_LT(std::chrono::steady_clock::now() - start, kImageTimeout);
  driver().push({picture(60)});
  driver().wait_until_taken();
  EXPECT_EQ(status(frame++), CaptureStatus::captured);
  start = std::chrono::steady_clock::now();
  EXPECT_EQ(status(frame++), CaptureStatus::missing);
  EXPECT_GE(std::chrono::steady_clock::now() - start, kImageTimeout) << "it may be slow";
  driver().go_on();
}

// The camera pauses for longer than a read waits.
TEST_F(V4l2, CaptureWaitsForACameraIfConfigured) {
  const test::TestFolder folder;
  cv::imwrite((folder.path / "empty.png").string(), picture(50));
  config::Rig rig;
  rig.cameras = {camera()};
  config::Viewer viewer;
  viewer.path = {{0, {0, -0.8, 0.8}, {0, 0, 0.2}}};
  config::CaptureConfig config;
  config.lost_camera = config::LostCamera::wait;
  config.sources["cam"] = config::V4l2Source{
      kDevice, config::LearnedBackground{(folder.path / "empty.png").string(), 3}};
  driver().push({picture(50)});
  Capture capture(rig, viewer, config, 30);
  driver().wait_until_taken();
  std::vector<std::string> reasons;
  capture.set_go_on_waiting([&](const std::string& name, const std::string& reason) {
    reasons.push_back(name + ": " + reason);
    driver().go_on(picture(90));
    return true;
  });
  EXPECT_EQ(capture.capture(0, false).at(0).status, CaptureStatus::captured);
  EXPECT_EQ(reasons, std::vector<std::string>{"cam: /dev/null: no image within 0.5 s"});
  driver().pause();
  driver().wait_until_taken();
  capture.set_go_on_waiting([](const std::string&, const std::string&) { return false; });
  while (capture.capture(1, false).at(0).status == CaptureStatus::captured) {
  }
  driver().go_on();
}

// The camera is unplugged for a second while the other one goes on.
TEST_F(V4l2, TheImagesAfterAWaitAreOfOneTime) {
  const std::string other = "/dev/zero";
  config::Rig rig;
  rig.cameras = {camera(), camera()};
  rig.cameras[1].name = "other";
  config::Viewer viewer;
  viewer.path = {{0, {0, -0.8, 0.8}, {0, 0, 0.2}}};
  config::CaptureConfig config;
  config.lost_camera = config::LostCamera::wait;
  config.sources["cam"] = config::V4l2Source{kDevice, config::LearnedBackground{"", 1}};
  config.sources["other"] = config::V4l2Source{other, config::LearnedBackground{"", 1}};
  driver().go_on();
  Capture capture(rig, viewer, config, 30);
  driver().unplug(other, true);
  while (capture.capture(0, false)[1].status == CaptureStatus::captured) {
  }
  const auto start = std::chrono::steady_clock::now();
  std::set<std::string> waits_for;
  capture.set_go_on_waiting([&](const std::string& name, const std::string&) {
    waits_for.insert(name);
    if (std::chrono::steady_clock::now() - start > 1s) driver().unplug(other, false);
    return true;
  });
  const auto set = capture.capture(1, false);
  EXPECT_EQ(waits_for, std::set<std::string>{"other"});
  EXPECT_GE(std::chrono::steady_clock::now() - start, 1s);
  for (const CapturedCamera& one : set) EXPECT_EQ(one.status, CaptureStatus::captured);
  EXPECT_LT(std::abs(1e-9 * double(set[0].image_stamp_ns - set[1].image_stamp_ns)), 0.5);
}

// Capture segments two cameras at a time, which takes long here. The images are of one time
// nevertheless.
TEST_F(V4l2, TheImagesOfManyCamerasAreOfOneTime) {
  constexpr auto kSegmentation = 60ms;
  config::Rig rig;
  config::CaptureConfig config;
  for (const char* const device : {"/dev/null", "/dev/zero", "/dev/full", "/dev/random"}) {
    rig.cameras.push_back(camera());
    rig.cameras.back().name = device;
    config.sources[device] = config::V4l2Source{device, config::LearnedBackground{"", 1}};
  }
  config::Viewer viewer;
  viewer.path = {{0, {0, -0.8, 0.8}, {0, 0, 0.2}}};
  driver().go_on();
  Capture capture(rig, viewer, config, 30);
  capture.set_observer([&](const config::RigCamera&, const cv::Mat&, const Segmentation&) {
    std::this_thread::sleep_for(kSegmentation);
  });
  const auto set = capture.capture(0, false);
  const auto [earliest, latest] = std::minmax_element(
      set.begin(), set.end(), [](const CapturedCamera& a, const CapturedCamera& b) {
        return a.image_stamp_ns < b.image_stamp_ns;
      });
  EXPECT_LT(std::chrono::nanoseconds(latest->image_stamp_ns - earliest->image_stamp_ns),
            kSegmentation / 2);
}

// In each frame, although images arrive.
TEST_F(V4l2, CaptureNamesAChangedSizeInEachFrame) {
  const test::TestFolder folder;
  cv::imwrite((folder.path / "empty.png").string(), picture(50));
  config::Rig rig;
  rig.cameras = {camera()};
  config::CaptureConfig config;
  config.sources["cam"] = config::V4l2Source{
      kDevice, config::LearnedBackground{(folder.path / "empty.png").string(), 3}};
  config::Viewer viewer;
  viewer.path = {{0, {0, -0.8, 0.8}, {0, 0, 0.2}}};
  driver().push({picture(50)});
  Capture capture(rig, viewer, config, 30);
  driver().wait_until_taken();
  for (int frame = 0; frame < 4; ++frame) {
    std::thread later([] {
      std::this_thread::sleep_for(30ms);
      driver().push({picture(50, kWidth_px, 2 * kHeight_px)});
    });
    EXPECT_EQ(capture.capture(frame, false).at(0).reason,
              kDevice + ": the size of the images has changed")
        << frame;
    later.join();
  }
  driver().go_on();
}

TEST_F(V4l2, ACameraThatSendsTheSameImageIsFrozen) {
  config::Rig rig;
  rig.cameras = {camera()};
  config::CaptureConfig config;
  config.sources["cam"] = config::V4l2Source{kDevice, config::LearnedBackground{"", 1}};
  config::Viewer viewer;
  viewer.path = {{0, {0, -0.8, 0.8}, {0, 0, 0.2}}};
  driver().go_on();
  Capture capture(rig, viewer, config, 30);
  const auto is_frozen = [&](int frame) {
    const auto set = capture.capture(frame, false);
    return std::any_of(
        set[0].diagnostics.begin(), set[0].diagnostics.end(),
        [](const std::string& text) { return text.starts_with("frozen: it sends the same"); });
  };
  const auto start = std::chrono::steady_clock::now();
  EXPECT_FALSE(is_frozen(0));
  int frame = 1;
  while (!is_frozen(frame) && std::chrono::steady_clock::now() - start < 10s) ++frame;
  EXPECT_GE(std::chrono::steady_clock::now() - start, 1s);
  EXPECT_LT(std::chrono::steady_clock::now() - start, 10s);
  driver().go_on(picture(2));
  const int reads = driver().reads();
  while (driver().reads() < reads + 2) std::this_thread::yield();
  EXPECT_FALSE(is_frozen(frame + 1));
}

TEST_F(V4l2, CaptureTakesTheStampOfTheImage) {
  config::Rig rig;
  rig.cameras = {camera()};
  config::CaptureConfig config;
  config.sources["cam"] = config::V4l2Source{kDevice, config::LearnedBackground{"", 1}};
  config::Viewer viewer;
  viewer.path = {{0, {0, -0.8, 0.8}, {0, 0, 0.2}}};
  driver().go_on();
  Capture capture(rig, viewer, config, 30);
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  driver().kernel_stamp_ms = std::chrono::duration<double, std::milli>(now).count() - 500;
  const std::int64_t before_ns = base::now_realtime_ns();
  const int reads = driver().reads();
  while (driver().reads() < reads + 2) std::this_thread::yield();  // a whole image since then
  const auto set = capture.capture(0, false);
  EXPECT_LT(set[0].image_stamp_ns, before_ns - 400'000'000);
  EXPECT_GT(set[0].image_stamp_ns, before_ns - 600'000'000);
}

}  // namespace
}  // namespace fivepipe::capture
