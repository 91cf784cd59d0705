// GStreamer pipelines and network cameras as sources.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmath>
#include <thread>

#include "capture_node/capture.h"
#include "capture_node/sources/image_source.h"
#include "capture_node/sources/stream_modules.h"
#include "common/base/realtime.h"
#include "tests/support/capture/capture_rig.h"
#include "tests/support/optional_package.h"
#include "tests/support/process.h"
#include "tests/support/test_folder.h"

namespace fivepipe::capture {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr int kWidth_px = 64, kHeight_px = 48;
const cv::Vec3b kRed{0, 0, 255}, kGreen{0, 255, 0}, kBlue{255, 0, 0};

config::RigCamera camera(int width_px = kWidth_px) {
  return test::table_camera("cam", {0, -1, 1}, width_px, kHeight_px);
}

// A test picture. `source`: properties of videotestsrc.
std::string test_picture(const std::string& source, int rate_hz = 30, int width_px = kWidth_px) {
  return "videotestsrc " + source + " ! video/x-raw,width=" + std::to_string(width_px) +
         ",height=" + std::to_string(kHeight_px) + ",framerate=" + std::to_string(rate_hz) + "/1";
}

bool has_colour(const cv::Mat& image, const cv::Vec3b& bgr, int tolerance_levels) {
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u)
      for (int c = 0; c < 3; ++c)
        if (std::abs(image.at<cv::Vec3b>(v, u)[c] - bgr[c]) > tolerance_levels) return false;
  return !image.empty();
}

// Reads until an image comes; false after 20 s.
bool reads_image(ImageSource& source, cv::Mat& image) {
  for (const auto until = Clock::now() + 20s; Clock::now() < until;)
    if (test::read_next(source, image) == ReadStatus::image) return true;
  return false;
}

// Reads until no image comes; returns the status, or `image` after 20 s.
ReadStatus status_after_images(ImageSource& source) {
  cv::Mat image;
  for (const auto until = Clock::now() + 20s; Clock::now() < until;)
    if (const ReadStatus status = test::read_next(source, image); status != ReadStatus::image)
      return status;
  return ReadStatus::image;
}

SourceProblem problem_of(const std::string& pipeline, bool& is_hardware) {
  try {
    open_gstreamer_source(camera(), {pipeline, {}});
  } catch (const HardwareMissing& error) {
    is_hardware = true;
    return error.problems().at(0);
  } catch (const SourceError& error) {
    is_hardware = false;
    return error.problems().at(0);
  }
  ADD_FAILURE() << "no SourceError";
  return {};
}

class Gstreamer : public testing::Test {
 protected:
  void SetUp() override {
    if (!exists(kGstreamerModule))
      FIVEPIPE_SKIP_WITHOUT_PACKAGE("built without GStreamer (libgstreamer1.0-dev)");
    try {
      open_gstreamer_source(camera(), {test_picture("is-live=true"), {}});
    } catch (const SourceError& error) {
      const std::string what = error.what();
      if (what.find("no element") != std::string::npos)
        FIVEPIPE_SKIP_WITHOUT_PACKAGE("gstreamer1.0-plugins-base: " + what);
      FAIL() << what;
    }
  }
};

TEST_F(Gstreamer, DeliversTheImagesOfThePipeline) {
  for (const auto& [pattern, colour] :
       {std::pair{"red", kRed}, {"green", kGreen}, {"blue", kBlue}}) {
    const auto source = open_gstreamer_source(
        camera(), {test_picture(std::string("is-live=true pattern=") + pattern), {}});
    cv::Mat image;
    ASSERT_TRUE(reads_image(*source, image));
    EXPECT_EQ(image.type(), CV_8UC3);
    EXPECT_TRUE(has_colour(image, colour, 3)) << pattern << image.at<cv::Vec3b>(0, 0);
  }
}

// GStreamer pads rows to multiples of 4 bytes.
TEST_F(Gstreamer, RowsOfAnyWidthAreInPlace) {
  const auto source =
      open_gstreamer_source(camera(63), {test_picture("is-live=true pattern=red", 30, 63), {}});
  cv::Mat image;
  ASSERT_TRUE(reads_image(*source, image));
  EXPECT_EQ(image.cols, 63);
  EXPECT_TRUE(has_colour(image, kRed, 3));
}

// The pipeline delays each image by 150 ms after it was taken.
TEST_F(Gstreamer, TheStampIsTheTimeAtWhichTheImageWasTaken) {
  constexpr double kDelay_ms = 150, kPeriod_ms = 200;
  const auto source = open_gstreamer_source(
      camera(), {test_picture("is-live=true", 5) + " ! identity sleep-time=150000", {}});
  cv::Mat image;
  std::int64_t last_ns = 0;
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(reads_image(*source, image));
    const double age_ms = 1e-6 * double(base::now_realtime_ns() - source->stamp_ns());
    EXPECT_GE(age_ms, kDelay_ms - 1);
    EXPECT_LE(age_ms, kDelay_ms + 150) << "on a busy machine";
    if (last_ns != 0) {
      const double periods = 1e-6 * double(source->stamp_ns() - last_ns) / kPeriod_ms;
      EXPECT_GE(periods, 0.9);
      EXPECT_NEAR(periods, std::round(periods), 0.1) << "the times of the camera, not of arrival";
    }
    last_ns = source->stamp_ns();
  }
}

TEST_F(Gstreamer, TheNewestImageReplacesOlderOnes) {
  const auto source = open_gstreamer_source(camera(), {test_picture("is-live=true", 100), {}});
  cv::Mat image;
  for (int i = 0; i < 3; ++i) {
    std::this_thread::sleep_for(500ms);
    ASSERT_EQ(test::read_next(*source, image), ReadStatus::image);
    EXPECT_LT(1e-6 * double(base::now_realtime_ns() - source->stamp_ns()), 150);
  }
}

// A file is played at its rate, to its end.
TEST_F(Gstreamer, APipelineThatIsNotLiveEnds) {
  const auto start = Clock::now();
  const auto source = open_gstreamer_source(camera(), {test_picture("num-buffers=10", 10), {}});
  EXPECT_EQ(status_after_images(*source), ReadStatus::end);
  EXPECT_GE(Clock::now() - start, 800ms);
  cv::Mat image;
  EXPECT_EQ(test::read_next(*source, image), ReadStatus::end);
}

TEST_F(Gstreamer, ALiveStreamThatEndsOrFailsIsMissingAndComesBack) {
  for (const auto& [pipeline, why] :
       {std::pair<std::string, std::string>{test_picture("is-live=true num-buffers=8"),
                                            "the stream has ended"},
        {test_picture("is-live=true") + " ! identity name=camera error-after=8", "camera: "}}) {
    const auto source = open_gstreamer_source(camera(), {pipeline, {}});
    cv::Mat image;
    for (int round = 0; round < 3; ++round) {
      EXPECT_EQ(status_after_images(*source), ReadStatus::missing) << pipeline;
      EXPECT_EQ(source->last_error().rfind("gstreamer: stopped delivering: " + why, 0), 0u)
          << source->last_error();
      ASSERT_TRUE(reads_image(*source, image)) << pipeline;
    }
  }
}

// It would start again at its first image.
TEST_F(Gstreamer, AFileThatFailsStaysMissing) {
  const auto source = open_gstreamer_source(
      camera(), {test_picture("") + " ! identity name=file error-after=8", {}});
  EXPECT_TRUE(source->is_live());
  EXPECT_EQ(status_after_images(*source), ReadStatus::missing);
  cv::Mat image;
  for (const auto until = Clock::now() + 1500ms; Clock::now() < until;)
    ASSERT_EQ(test::read_next(*source, image), ReadStatus::missing);
  EXPECT_FALSE(source->is_live());
}

TEST_F(Gstreamer, ErrorExplainsAWrongPipeline) {
  bool is_hardware = true;
  const SourceProblem found = problem_of("no_such_element ! videoscale", is_hardware);
  EXPECT_FALSE(is_hardware);
  EXPECT_EQ(found.camera, "cam");
  EXPECT_EQ(found.fault, SourceFault::not_decodable);
  EXPECT_EQ(found.what.rfind("gstreamer: cannot build the pipeline \"no_such_element ! "
                             "videoscale\": no element \"no_such_element\"",
                             0),
            0u)
      << found.what;
  EXPECT_NE(found.what.find("gst-launch-1.0"), std::string::npos);
  for (const char* pipeline : {"videotestsrc ! fakesink", "videotestsrc pattern=none", "!", "( "}) {
    is_hardware = true;
    EXPECT_EQ(problem_of(pipeline, is_hardware).fault, SourceFault::not_decodable) << pipeline;
    EXPECT_FALSE(is_hardware) << pipeline;
  }
}

TEST_F(Gstreamer, ErrorExplainsAMissingDevice) {
  bool is_hardware = false;
  const SourceProblem found = problem_of("filesrc location=/no/such ! decodebin", is_hardware);
  EXPECT_TRUE(is_hardware);
  EXPECT_NE(found.what.find("No such file"), std::string::npos) << found.what;
}

TEST_F(Gstreamer, ErrorOfAWrongSizeNamesBothSizes) {
  bool is_hardware = true;
  const SourceProblem found = problem_of(test_picture("is-live=true", 30, 80), is_hardware);
  EXPECT_EQ(found.fault, SourceFault::wrong_size);
  EXPECT_EQ(found.what,
            "gstreamer: delivers images of 80x48 px, image_size_px of the rig is 64x48");
}

TEST_F(Gstreamer, ClosesWithinASecond) {
  auto source = open_gstreamer_source(camera(), {test_picture("is-live=true", 1), {}});
  const auto start = Clock::now();
  source.reset();
  EXPECT_LT(Clock::now() - start, 900ms);
}

// The whole capture: a chroma key, and a background that is learned from the first images.
TEST_F(Gstreamer, CaptureFindsObjectsInItsImages) {
  config::Rig rig;
  rig.cameras = {camera()};
  config::Viewer viewer;
  viewer.path = {{0, {0, -0.8, 0.8}, {0, 0, 0.2}}};
  const auto object_pixels = [&](const std::string& pattern, const config::ObjectKey& key) {
    config::CaptureConfig config;
    config.sources["cam"] =
        config::GstreamerSource{test_picture("is-live=true pattern=" + pattern), key};
    Capture capture(rig, viewer, config, 30);
    const CapturedCamera found = capture.capture(0, false).at(0);
    EXPECT_EQ(found.status, CaptureStatus::captured) << found.reason;
    EXPECT_NEAR(1e-9 * double(base::now_realtime_ns() - found.image_stamp_ns), 0.2, 0.3);
    return found.pixels ? int(found.pixels->count()) : -1;
  };
  EXPECT_EQ(object_pixels("green", config::ChromaKey{}), 0);
  EXPECT_EQ(object_pixels("red", config::ChromaKey{}), kWidth_px * kHeight_px);
  EXPECT_EQ(object_pixels("green", config::LearnedBackground{"", 5}), 0);
}

// A camera with RTSP on the loopback interface.
class Rtsp : public Gstreamer {
 protected:
  void SetUp() override {
    Gstreamer::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    port_ = free_port();
    start_server();
    if (const auto code = server_->wait_for_end(0ms); code && *code == 3)
      FIVEPIPE_SKIP_WITHOUT_PACKAGE("gir1.2-gst-rtsp-server-1.0, python3-gi: " + server_->said());
    ASSERT_NE(server_->said().find("ready"), std::string::npos) << server_->said();
  }
  static int free_port() {
    const int listener = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    bind(listener, reinterpret_cast<sockaddr*>(&address), size);
    getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
    close(listener);
    return ntohs(address.sin_port);
  }
  void start_server() {
    server_ = std::make_unique<test::Program>(
        std::vector<std::string>{FIVEPIPE_SOURCE_DIR "/tests/support/programs/rtsp_server.py",
                                 std::to_string(port_),
                                 "( " + test_picture("is-live=true pattern=red") +
                                     ",format=I420 ! jpegenc ! rtpjpegpay name=pay0 )"},
        folder_.path / "server.log");
    for (const auto until = Clock::now() + 20s; Clock::now() < until;) {
      if (server_->said().find("ready") != std::string::npos || server_->wait_for_end(10ms)) return;
    }
  }
  config::RtspSource source(const std::string& user = "") const {
    return {"rtsp://" + user + "127.0.0.1:" + std::to_string(port_) + "/camera", {}};
  }
  const test::TestFolder folder_;
  int port_ = 0;
  std::unique_ptr<test::Program> server_;
};

TEST_F(Rtsp, AKilledServerIsMissingWithinASecondAndComesBack) {
  const auto camera_source = open_rtsp_source(camera(), source());
  cv::Mat image;
  ASSERT_TRUE(reads_image(*camera_source, image));
  EXPECT_TRUE(has_colour(image, kRed, 24)) << "JPEG" << image.at<cv::Vec3b>(0, 0);
  const double age_ms = 1e-6 * double(base::now_realtime_ns() - camera_source->stamp_ns());
  EXPECT_GE(age_ms, 0);
  EXPECT_LE(age_ms, 500);
  server_->signal(SIGKILL);
  const auto killed = Clock::now();
  EXPECT_EQ(status_after_images(*camera_source), ReadStatus::missing);
  EXPECT_LT(Clock::now() - killed, 1s);
  EXPECT_EQ(camera_source->last_error().rfind(
                "rtsp://127.0.0.1:" + std::to_string(port_) + "/camera: ", 0),
            0u)
      << camera_source->last_error();
  server_->wait_for_end(5s);
  start_server();
  EXPECT_TRUE(reads_image(*camera_source, image)) << camera_source->last_error();
}

TEST_F(Rtsp, ErrorsDoNotShowThePassword) {
  server_->signal(SIGKILL);
  server_->wait_for_end(5s);
  try {
    open_rtsp_source(camera(), source("user:secret@"));
    FAIL() << "no exception";
  } catch (const HardwareMissing& error) {
    const std::string what = error.what();
    EXPECT_EQ(what.rfind("cam: rtsp://127.0.0.1:" + std::to_string(port_) + "/camera: ", 0), 0u)
        << what;
    EXPECT_EQ(what.find("secret"), std::string::npos) << what;
  }
}

}  // namespace
}  // namespace fivepipe::capture
