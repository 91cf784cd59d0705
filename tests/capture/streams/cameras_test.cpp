// What `fivepipe cameras` lists, with scripted V4L2 drivers and a folder in place of /sys.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdarg>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "capture_node/cameras/camera_link.h"
#include "capture_node/cameras/camera_report.h"
#include "capture_node/cameras/genicam_cameras.h"
#include "capture_node/cameras/v4l2_cameras.h"
#include "tests/support/test_folder.h"

namespace fivepipe::capture {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct DriverSize {
  std::uint32_t format;
  int width_px, height_px;
  std::vector<std::array<std::uint32_t, 2>> periods;  // numerator and denominator [s]
};
struct Driver {
  std::string card;
  std::uint32_t able = V4L2_CAP_VIDEO_CAPTURE;
  std::vector<DriverSize> sizes;
  bool is_stepwise = false;  // sizes and rates are those of the largest and the fastest
};

// By the name of the device file.
std::map<std::string, Driver>& drivers() {
  static std::map<std::string, Driver> all;
  return all;
}

std::vector<std::uint32_t> formats_of(const Driver& driver) {
  std::vector<std::uint32_t> formats;
  for (const DriverSize& size : driver.sizes)
    if (std::find(formats.begin(), formats.end(), size.format) == formats.end())
      formats.push_back(size.format);
  return formats;
}

std::vector<DriverSize> sizes_of(const Driver& driver, std::uint32_t format) {
  std::vector<DriverSize> sizes;
  for (const DriverSize& size : driver.sizes)
    if (size.format == format) sizes.push_back(size);
  return sizes;
}

bool answer(const Driver& driver, unsigned long request, void* argument) {
  if (request == VIDIOC_QUERYCAP) {
    auto& capability = *static_cast<v4l2_capability*>(argument);
    std::strcpy(reinterpret_cast<char*>(capability.card), driver.card.c_str());
    // Of the whole camera; those of this device node are in device_caps.
    capability.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_DEVICE_CAPS;
    capability.device_caps = driver.able;
    return true;
  }
  if (request == VIDIOC_ENUM_FMT) {
    auto& format = *static_cast<v4l2_fmtdesc*>(argument);
    const auto formats = formats_of(driver);
    if (format.type != V4L2_BUF_TYPE_VIDEO_CAPTURE || format.index >= formats.size()) return false;
    format.pixelformat = formats[format.index];
    return true;
  }
  if (request == VIDIOC_ENUM_FRAMESIZES) {
    auto& size = *static_cast<v4l2_frmsizeenum*>(argument);
    const auto sizes = sizes_of(driver, size.pixel_format);
    if (size.index >= sizes.size()) return false;
    const auto width = std::uint32_t(sizes[size.index].width_px),
               height = std::uint32_t(sizes[size.index].height_px);
    size.type = driver.is_stepwise ? V4L2_FRMSIZE_TYPE_STEPWISE : V4L2_FRMSIZE_TYPE_DISCRETE;
    if (driver.is_stepwise)
      size.stepwise = {16, width, 16, 16, height, 16};
    else
      size.discrete = {width, height};
    return true;
  }
  if (request == VIDIOC_ENUM_FRAMEINTERVALS) {
    auto& interval = *static_cast<v4l2_frmivalenum*>(argument);
    for (const DriverSize& size : sizes_of(driver, interval.pixel_format)) {
      if (size.width_px != int(interval.width) || size.height_px != int(interval.height)) continue;
      if (interval.index >= size.periods.size()) return false;
      const v4l2_fract period{size.periods[interval.index][0], size.periods[interval.index][1]};
      interval.type = driver.is_stepwise ? V4L2_FRMIVAL_TYPE_STEPWISE : V4L2_FRMIVAL_TYPE_DISCRETE;
      if (driver.is_stepwise)
        interval.stepwise = {period, {1, 1}, {1, 1000}};
      else
        interval.discrete = period;
      return true;
    }
  }
  return false;
}

}  // namespace
}  // namespace fivepipe::capture

// The linker takes this definition instead of that in the C library.
extern "C" int ioctl(int descriptor, unsigned long request, ...) noexcept {
  std::va_list arguments;
  va_start(arguments, request);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);
  std::error_code error;
  const std::filesystem::path file =
      std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(descriptor), error);
  const auto driver = fivepipe::capture::drivers().find(file.filename());
  if (driver != fivepipe::capture::drivers().end() &&
      fivepipe::capture::answer(driver->second, request, argument))
    return 0;
  errno = EINVAL;
  return -1;
}

namespace fivepipe::capture {
namespace {

class Cameras : public testing::Test {
 protected:
  Cameras() {
    drivers().clear();
    fs::create_directories(dev_ / "v4l/by-id");
    fs::create_directories(sys_ / "class/video4linux");
  }
  void write(const fs::path& file, const std::string& text) const {
    fs::create_directories(file.parent_path());
    std::ofstream(file) << text;
  }
  // A device on a USB bus; bus 0: on none.
  void add(int number, Driver driver, int bus, const std::string& speed = "480",
           const std::string& permanent = "") {
    const std::string video = "video" + std::to_string(number);
    write(dev_ / video, "");
    if (!permanent.empty()) fs::create_symlink("../../" + video, dev_ / "v4l/by-id" / permanent);
    const fs::path root = sys_ / "devices/pci0000:00/usb" / std::to_string(bus),
                   device = root / ("1-" + std::to_string(number)),
                   interface = device / "interface";
    fs::create_directories(interface);
    if (bus > 0) {
      write(device / "busnum", std::to_string(bus) + "\n");
      write(sys_ / "bus/usb/devices" / ("usb" + std::to_string(bus)) / "speed", speed + "\n");
    }
    fs::create_directories(sys_ / "class/video4linux" / video);
    fs::create_symlink(interface, sys_ / "class/video4linux" / video / "device");
    drivers()[video] = std::move(driver);
  }
  std::vector<ConnectedCamera> listed() const { return v4l2_cameras(dev_, sys_); }

  const test::TestFolder folder_;
  const fs::path dev_ = folder_.path / "dev", sys_ = folder_.path / "sys";
};

const Driver kWebcam{"Webcam C1",
                     V4L2_CAP_VIDEO_CAPTURE,
                     {{V4L2_PIX_FMT_MJPEG, 1920, 1080, {{1, 30}}},
                      {V4L2_PIX_FMT_YUYV, 640, 480, {{1, 15}, {1, 30}, {1, 10}}},
                      {V4L2_PIX_FMT_YUYV, 1280, 720, {{1, 10}}}}};

TEST_F(Cameras, ReportsNamesModesAndBandwidthOfAV4l2Camera) {
  add(2, kWebcam, 1, "480", "usb-webcam-b");
  fs::create_symlink("../../video2", dev_ / "v4l/by-id/usb-webcam-a");
  const std::string by_id = (dev_ / "v4l/by-id/usb-webcam-a").string();
  EXPECT_EQ(report_text(listed(), {"a note"}),
            "v4l2: " + by_id + "\n  Webcam C1\n  now " + (dev_ / "video2").string() +
                "\n"
                "  MJPG 1920x1080 at 30 Hz: depends on the image\n"
                "  YUYV 640x480 at 30 Hz: 147 Mbit/s\n"
                "  YUYV 1280x720 at 10 Hz: 147 Mbit/s\n\n"
                "USB bus 1, 480 Mbit/s, of which images can have 384: 1 camera\n"
                "  YUYV 640x480 at 30 Hz: 147 Mbit/s, fits\n"
                "  YUYV 1280x720 at 10 Hz: 147 Mbit/s, fits\n"
                "a note\n");
}

// The second camera has no mode of 1280x720 and is slower.
TEST_F(Cameras, CamerasOfOneBusShareItsBandwidth) {
  Driver second = kWebcam;
  second.sizes.pop_back();
  second.sizes[1].periods = {{1, 25}};
  add(0, kWebcam, 3);
  add(1, second, 3);
  add(2, kWebcam, 3);
  add(4, kWebcam, 4, "5000");
  const auto links = shared_links(listed());
  ASSERT_EQ(links.size(), 2u);
  EXPECT_EQ(links[0].cameras, 3);
  ASSERT_EQ(links[0].modes.size(), 1u);
  EXPECT_EQ(links[0].modes[0].mode.rate_hz, 25);
  EXPECT_DOUBLE_EQ(links[0].modes[0].needed_mbit_s, 3 * 25e-6 * 640 * 480 * 16);
  EXPECT_EQ(links[0].modes[0].fits, true);
  EXPECT_EQ(links[1].cameras, 1);
  EXPECT_EQ(links[1].link.speed_mbit_s, 5000);
  add(5, kWebcam, 3);
  EXPECT_EQ(shared_links(listed())[0].modes[0].fits, false) << "four need 492 Mbit/s";
  EXPECT_THAT(report_text(listed(), {}),
              HasSubstr("USB bus 3, 480 Mbit/s, of which images can have 384: 4 cameras\n"
                        "  YUYV 640x480 at 25 Hz: 492 Mbit/s together, does not fit\n"));
}

TEST_F(Cameras, AnUnknownSpeedHasNoVerdict) {
  add(0, kWebcam, 1, "unknown");
  add(1, kWebcam, 0);
  const auto cameras = listed();
  EXPECT_EQ(cameras.at(1).link.name, "") << "no USB camera";
  EXPECT_THAT(report_text(cameras, {}), HasSubstr("USB bus 1, of unknown speed: 1 camera\n"
                                                  "  YUYV 640x480 at 30 Hz: 147 Mbit/s\n"));
}

TEST_F(Cameras, SizesAndRatesInStepsAreTheLargestAndTheFastest) {
  add(0, {"Grabber", V4L2_CAP_VIDEO_CAPTURE, {{V4L2_PIX_FMT_GREY, 1024, 768, {{1, 60}}}}, true}, 1);
  const auto cameras = listed();
  ASSERT_EQ(cameras.at(0).modes.size(), 1u);
  const CameraMode& mode = cameras[0].modes[0];
  EXPECT_EQ(mode.format, "GREY");
  EXPECT_EQ(mode.width_px, 1024);
  EXPECT_EQ(mode.height_px, 768);
  EXPECT_EQ(mode.rate_hz, 60);
  EXPECT_DOUBLE_EQ(bandwidth_mbit_s(mode).value(), 60e-6 * 1024 * 768 * 8);
}

// A camera has a second device node, for metadata; other files are no devices.
TEST_F(Cameras, OnlyDevicesThatDeliverImagesAreListed) {
  add(10, kWebcam, 1);
  add(9, kWebcam, 1);
  add(11, {"Webcam C1", V4L2_CAP_META_CAPTURE, {}}, 1);
  for (const char* name : {"video", "videoX", "video1x", "audio0"}) write(dev_ / name, "");
  write(dev_ / "video7", "");  // answers no request
  std::vector<std::string> values;
  for (const ConnectedCamera& camera : listed()) values.push_back(camera.value);
  EXPECT_THAT(values, ElementsAre((dev_ / "video9").string(), (dev_ / "video10").string()));
}

TEST_F(Cameras, ADeviceThatCannotBeOpenedIsListedWithTheReason) {
  fs::create_directories(dev_ / "video3");  // a folder cannot be opened for writing
  const auto cameras = listed();
  ASSERT_EQ(cameras.size(), 1u);
  EXPECT_THAT(cameras[0].facts, ElementsAre("cannot be opened: Is a directory"));
}

TEST_F(Cameras, ReportsThatNothingIsConnected) {
  EXPECT_EQ(report_text(listed(), {}), "no camera is connected\n");
  EXPECT_EQ(v4l2_cameras(folder_.path / "none", sys_).size(), 0u);
  EXPECT_EQ(report_json({}, {"a note"}).dump(), R"({"cameras":[],"links":[],"notes":["a note"]})");
}

// The address is in the network of the loopback interface, whose speed is unknown to /sys.
TEST_F(Cameras, DescribesAGenicamCamera) {
  GenicamCamera found{.name = "Maker-Model-7",
                      .vendor = "Maker",
                      .model =
                          "Mo\x1b"
                          "del",
                      .serial = "7",
                      .protocol = "GigEVision",
                      .address = "127.0.0.5",
                      .sensor_width_px = 1000,
                      .sensor_height_px = 500,
                      .rate_hz = 20,
                      .pixel_formats = {"Mono8", "Mono12", "RGB8"},
                      .why_unknown = ""};
  write(sys_ / "class/net/lo/speed", "1000\n");
  EXPECT_EQ(report_text({connected_camera(found, sys_)}, {}),
            "genicam: Maker-Model-7\n  Maker Mo?del\n"
            "  serial number 7, GigEVision, address 127.0.0.5\n"
            "  sensor 1000x500\n"
            "  pixel formats: Mono8, Mono12, RGB8\n"
            "  Mono8 1000x500 at 20 Hz: 80 Mbit/s\n"
            "  RGB8 1000x500 at 20 Hz: 240 Mbit/s\n\n"
            "network interface lo, 1000 Mbit/s, of which images can have 950: 1 camera\n"
            "  Mono8 1000x500 at 20 Hz: 80 Mbit/s, fits\n"
            "  RGB8 1000x500 at 20 Hz: 240 Mbit/s, fits\n");
  const auto json = report_json({connected_camera(found, sys_)}, {});
  EXPECT_EQ(json["cameras"][0]["key"], "genicam");
  EXPECT_EQ(json["cameras"][0]["modes"][1]["bandwidth_mbit_s"], 240.0);
  EXPECT_EQ(json["links"][0]["speed_mbit_s"], 1000.0);
  EXPECT_EQ(json["links"][0]["modes"][0]["fits"], true);
  found.why_unknown = "access denied";
  found.pixel_formats.clear();
  EXPECT_THAT(report_text({connected_camera(found, sys_)}, {}),
              HasSubstr("  cannot be opened: access denied\n"));
  found.address = "USB3";
  write(sys_ / "bus/usb/devices/2-1/serial", "7\n");
  write(sys_ / "bus/usb/devices/2-1/busnum", "2\n");
  write(sys_ / "bus/usb/devices/usb2/speed", "5000\n");
  EXPECT_EQ(connected_camera(found, sys_).link.name, "USB bus 2");
  EXPECT_EQ(connected_camera(found, sys_).link.speed_mbit_s, 5000);
  for (const char* serial : {"", "8", "70"}) {
    found.serial = serial;
    EXPECT_EQ(connected_camera(found, sys_).link.name, "") << serial;
  }
  for (const char* address : {"", "eth0", "203.0.113.9.1"})
    EXPECT_EQ(network_link(sys_, address).name, "") << address;
}

}  // namespace
}  // namespace fivepipe::capture
