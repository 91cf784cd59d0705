// GenICam cameras as sources.
#include <malloc.h>
#include <unistd.h>

#include <cmath>
#include <thread>

#include "capture_node/cameras/genicam_cameras.h"
#include "capture_node/sources/image_source.h"
#include "capture_node/sources/stream_modules.h"
#include "common/base/realtime.h"
#include "tests/support/capture/capture_rig.h"
#include "tests/support/capture/loopback_cameras.h"
#include "tests/support/capture/own_network.h"
#include "tests/support/optional_package.h"
#include "tests/support/process/memory.h"
#include "tests/support/sanitizer.h"
#include "tests/support/test_folder.h"

namespace fivepipe::capture {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr int kWidth_px = 64, kHeight_px = 48;
const std::string kFirst = "127.0.0.1", kSecond = "127.0.0.2";

class Genicam : public testing::Test {
 protected:
  void SetUp() override {
    if (!exists(kGenicamModule))
      FIVEPIPE_SKIP_WITHOUT_PACKAGE("built without Aravis (libaravis-dev)");
    static const bool is_own_network = test::enter_own_network({kFirst, kSecond});
    if (!is_own_network)
      FIVEPIPE_SKIP_WITHOUT_PACKAGE("CAP_SYS_ADMIN (root), to give the test a network of its own");
    cameras_.start(kFirst, "A1", 90);
    cameras_.start(kSecond, "B2", 180);
  }
  static config::RigCamera camera(const std::string& name = "cam", int width_px = kWidth_px) {
    return test::table_camera(name, {0, -1, 1}, width_px, kHeight_px);
  }
  static std::unique_ptr<ImageSource> opened(config::GenicamSource source) {
    return open_genicam_source(camera(), source);
  }
  // Reads until an image comes, and returns whether it does.
  static bool comes_within(Clock::duration time, ImageSource& source, cv::Mat& image) {
    for (const auto until = Clock::now() + time; Clock::now() < until;) {
      if (test::read_next(source, image) == ReadStatus::image) return true;
      std::this_thread::sleep_for(5ms);
    }
    return false;
  }
  // Returns the colour of the next image, which is uniform; (0, 0, 0) if there is none within 2 s,
  // or longer with a sanitizer: a machine with other work may delay an image by more than the 0.5 s
  // of one reading.
  static cv::Vec3b colour(ImageSource& source) {
    cv::Mat image;
    if (!comes_within(2s * test::kSlowdown, source, image)) {
      ADD_FAILURE() << source.last_error();
      return {0, 0, 0};
    }
    EXPECT_EQ(image.type(), CV_8UC3);
    const cv::Vec3b first = image.at<cv::Vec3b>(0, 0);
    for (int v = 0; v < image.rows; ++v)
      for (int u = 0; u < image.cols; ++u) EXPECT_EQ(image.at<cv::Vec3b>(v, u), first);
    return first;
  }
  static bool comes_back(ImageSource& source) {
    cv::Mat image;
    return comes_within(test::kCameraIsBack, source, image);
  }
  static SourceProblem problem(const config::GenicamSource& source, int width_px = kWidth_px) {
    try {
      open_genicam_source(camera("cam", width_px), source);
    } catch (const SourceError& error) {
      return error.problems().at(0);
    }
    ADD_FAILURE() << "no SourceError";
    return {};
  }
  const test::TestFolder folder_;
  test::LoopbackCameras cameras_{folder_.path};
};

// Red is the time at which the camera made the image, in ms modulo 256.
double stamp_error_ms(const cv::Vec3b& bgr, std::int64_t stamp_ns) {
  const double stamp_ms = std::fmod(1e-6 * double(stamp_ns % 256'000'000'000), 256);
  return std::fmod(stamp_ms - bgr[2] + 256, 256);
}

TEST_F(Genicam, TwoCamerasDeliverTheirImagesWithTheirStamps) {
  const auto first = opened({kFirst, {}, {}, {}}), second = opened({kSecond, {}, {}, {}});
  std::int64_t last_ns = 0;
  for (int i = 0; i < 10; ++i) {
    const cv::Vec3b of_first = colour(*first), of_second = colour(*second);
    EXPECT_EQ(of_first[0], 90);
    EXPECT_EQ(of_second[0], 180);
    EXPECT_LT(stamp_error_ms(of_first, first->stamp_ns()), 50);
    EXPECT_LT(stamp_error_ms(of_second, second->stamp_ns()), 50);
    EXPECT_LT(std::abs(1e-9 * double(base::now_realtime_ns() - first->stamp_ns())), 0.5);
    EXPECT_GT(first->stamp_ns(), last_ns);
    last_ns = first->stamp_ns();
  }
}

TEST_F(Genicam, ACameraIsSelectedByNameSerialNumberOrAddress) {
  for (const std::string name : {"B2", "Aravis-Fake-B2", "127.0.0.2"})
    EXPECT_EQ(colour(*opened({name, {}, {}, {}}))[0], 180) << name;
}

TEST_F(Genicam, AKilledCameraIsMissingWithinASecondAndComesBack) {
  const auto first = opened({kFirst, {}, {}, {}}), second = opened({"B2", {}, {}, {}});
  EXPECT_EQ(colour(*second)[0], 180);
  cameras_.kill("B2");
  const auto killed = Clock::now();
  cv::Mat image;
  while (test::read_next(*second, image) == ReadStatus::image && Clock::now() < killed + 5s)
    continue;
  EXPECT_LT(Clock::now() - killed, 1s);
  EXPECT_EQ(second->last_error().rfind("B2: ", 0), 0u) << second->last_error();
  for (const auto until = Clock::now() + 3s; Clock::now() < until;) {
    EXPECT_EQ(colour(*first)[0], 90) << "the other camera goes on: " << first->last_error();
    const auto start = Clock::now();
    EXPECT_EQ(test::read_next(*second, image), ReadStatus::missing);
    EXPECT_LT(Clock::now() - start, 700ms);
  }
  EXPECT_EQ(second->last_error().rfind("B2: stopped delivering: ", 0), 0u) << second->last_error();
  cameras_.start(kSecond, "B2", 200);
  EXPECT_TRUE(comes_back(*second)) << second->last_error();
  EXPECT_EQ(colour(*second)[0], 200);
}

TEST_F(Genicam, ReconnectingKeepsTheMemoryLevel) {
  const auto source = opened({kSecond, {}, {}, {}});
  std::size_t after_first = 0;
  for (int round = 0; round < 4; ++round) {
    cameras_.kill("B2");
    cameras_.start(kSecond, "B2", 180);
    ASSERT_TRUE(comes_back(*source)) << source->last_error();
    for (int i = 0; i < 25; ++i) colour(*source);
    malloc_trim(0);  // the memory that ended threads have freed
    if (round == 0) after_first = test::resident_bytes(getpid());
  }
  // Aravis reads the description of the camera, 100 KB, and makes 10 threads in each round.
  EXPECT_LT(test::resident_bytes(getpid()), after_first + 20'000'000);
}

TEST_F(Genicam, ExposureAndGainAreSet) {
  const cv::Vec3b as_set = colour(*opened({kFirst, 5000, 7, {}}));
  EXPECT_EQ(as_set[1], 50 + 7);
  EXPECT_EQ(colour(*opened({kFirst, 12000, 0, {}}))[1], 120);
}

TEST_F(Genicam, ErrorStatesTheRangeOfTheCamera) {
  const SourceProblem found = problem({kFirst, 1.5e9, {}, {}});
  EXPECT_EQ(found.fault, SourceFault::hardware_failed);
  EXPECT_EQ(found.what.rfind("127.0.0.1: exposure_us must be from ", 0), 0u) << found.what;
}

TEST_F(Genicam, ErrorOfAMissingCameraListsTheConnectedOnes) {
  const SourceProblem found = problem({"no_camera", {}, {}, {}});
  EXPECT_EQ(found.fault, SourceFault::hardware_missing);
  EXPECT_EQ(found.what,
            "no_camera: no such camera; connected cameras: Aravis-Fake-A1 Aravis-Fake-B2");
}

TEST_F(Genicam, ErrorOfAWrongSizeNamesBothSizes) {
  const SourceProblem found = problem({kFirst, {}, {}, {}}, 5000);
  EXPECT_EQ(found.fault, SourceFault::wrong_size);
  EXPECT_EQ(found.what,
            "127.0.0.1: its images can have 1x1 to 2048x2048 px with its present offset, "
            "image_size_px of the rig is 5000x48");
}

TEST_F(Genicam, ErrorOfACameraThatAnotherProgramControls) {
  const auto owner = opened({kFirst, {}, {}, {}});
  const SourceProblem found = problem({kFirst, {}, {}, {}});
  EXPECT_EQ(found.fault, SourceFault::hardware_failed);
  EXPECT_NE(found.what.find("another program controls the camera"), std::string::npos)
      << found.what;
  EXPECT_EQ(colour(*owner)[0], 90) << owner->last_error();
}

TEST_F(Genicam, ClosesWithinASecondAndTheCameraIsFree) {
  auto source = opened({kFirst, {}, {}, {}});
  const auto start = Clock::now();
  source.reset();
  EXPECT_LT(Clock::now() - start, 1100ms);
  EXPECT_EQ(colour(*opened({kFirst, {}, {}, {}}))[0], 90);
}

TEST_F(Genicam, CamerasAreListed) {
  std::vector<std::string> notes, values;
  const auto cameras = genicam_cameras("/sys", notes);
  EXPECT_TRUE(notes.empty());
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_EQ(cameras[0].value, "Aravis-Fake-A1");
  EXPECT_EQ(cameras[1].value, "Aravis-Fake-B2");
  EXPECT_EQ(cameras[1].facts.at(0), "serial number B2, GigEVision, address 127.0.0.2");
  EXPECT_EQ(cameras[1].facts.at(1), "sensor 2048x2048");
  EXPECT_NE(cameras[1].facts.at(2).find("BayerRG8"), std::string::npos);
  EXPECT_EQ(cameras[1].link.name, "network interface lo");
  ASSERT_FALSE(cameras[1].modes.empty());
  EXPECT_EQ(cameras[1].modes[0].rate_hz, 25);
}

}  // namespace
}  // namespace fivepipe::capture
