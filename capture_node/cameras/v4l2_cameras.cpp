#include "capture_node/cameras/v4l2_cameras.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>

#include "capture_node/cameras/camera_link.h"
#include "common/base/text_table.h"

namespace fivepipe::capture {
namespace {

namespace fs = std::filesystem;

// Drivers list far fewer; bounds the loops if one of them repeats itself.
constexpr unsigned kMaxEntries = 256;

class Device {
 public:
  explicit Device(const fs::path& path) : descriptor_(::open(path.c_str(), O_RDWR | O_NONBLOCK)) {}
  ~Device() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  bool is_open() const { return descriptor_ >= 0; }
  template <class Argument>
  bool query(unsigned long request, Argument& argument) const {
    return ioctl(descriptor_, request, &argument) == 0;
  }

 private:
  int descriptor_;
};

template <std::size_t kSize>
std::string text_of(const __u8 (&bytes)[kSize]) {
  const char* const text = reinterpret_cast<const char*>(bytes);
  return {text, strnlen(text, kSize)};
}

std::string fourcc_text(std::uint32_t format) {
  std::string text;
  for (int byte = 0; byte < 4; ++byte) text += char(format >> (8 * byte) & 0x7F);
  while (text.ends_with(' ')) text.pop_back();
  return text;
}

int bits_per_pixel(std::uint32_t format) {
  switch (format) {
    case V4L2_PIX_FMT_GREY:
    case V4L2_PIX_FMT_SBGGR8:
    case V4L2_PIX_FMT_SGBRG8:
    case V4L2_PIX_FMT_SGRBG8:
    case V4L2_PIX_FMT_SRGGB8: return 8;
    case V4L2_PIX_FMT_NV12:
    case V4L2_PIX_FMT_YUV420:
    case V4L2_PIX_FMT_YVU420: return 12;
    case V4L2_PIX_FMT_YUYV:
    case V4L2_PIX_FMT_UYVY:
    case V4L2_PIX_FMT_Y16: return 16;
    case V4L2_PIX_FMT_RGB24:
    case V4L2_PIX_FMT_BGR24: return 24;
    default: return 0;
  }
}

double highest_rate_hz(const Device& device, std::uint32_t format, int width_px, int height_px) {
  double highest_hz = 0;
  for (unsigned i = 0; i < kMaxEntries; ++i) {
    v4l2_frmivalenum interval{};
    interval.index = i;
    interval.pixel_format = format;
    interval.width = std::uint32_t(width_px);
    interval.height = std::uint32_t(height_px);
    if (!device.query(VIDIOC_ENUM_FRAMEINTERVALS, interval)) break;
    const bool is_discrete = interval.type == V4L2_FRMIVAL_TYPE_DISCRETE;
    const v4l2_fract period_s = is_discrete ? interval.discrete : interval.stepwise.min;
    if (period_s.numerator > 0)
      highest_hz = std::max(highest_hz, double(period_s.denominator) / period_s.numerator);
    if (!is_discrete) break;
  }
  return highest_hz;
}

std::vector<CameraMode> modes_of(const Device& device) {
  std::vector<CameraMode> modes;
  for (unsigned f = 0; f < kMaxEntries; ++f) {
    v4l2_fmtdesc format{};
    format.index = f;
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (!device.query(VIDIOC_ENUM_FMT, format)) break;
    for (unsigned s = 0; s < kMaxEntries; ++s) {
      v4l2_frmsizeenum size{};
      size.index = s;
      size.pixel_format = format.pixelformat;
      if (!device.query(VIDIOC_ENUM_FRAMESIZES, size)) break;
      const bool is_discrete = size.type == V4L2_FRMSIZE_TYPE_DISCRETE;
      CameraMode mode{fourcc_text(format.pixelformat),
                      int(is_discrete ? size.discrete.width : size.stepwise.max_width),
                      int(is_discrete ? size.discrete.height : size.stepwise.max_height), 0,
                      bits_per_pixel(format.pixelformat)};
      mode.rate_hz = highest_rate_hz(device, format.pixelformat, mode.width_px, mode.height_px);
      modes.push_back(std::move(mode));
      if (!is_discrete) break;
    }
  }
  return modes;
}

// The permanent name of each device; the first in alphabetical order if it has several.
std::map<fs::path, std::string> permanent_names(const fs::path& dev) {
  std::map<fs::path, std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(dev / "v4l/by-id", error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code broken;
    const fs::path device = fs::canonical(entry->path(), broken);
    if (broken) continue;
    std::string& name = names[device.filename()];
    if (name.empty() || entry->path().string() < name) name = entry->path().string();
  }
  return names;
}

// The numbers of /dev/videoN, in increasing order.
std::vector<int> device_numbers(const fs::path& dev) {
  std::vector<int> numbers;
  std::error_code error;
  for (fs::directory_iterator entry(dev, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    constexpr std::size_t kPrefix = 5, kMaxDigits = 6;  // "video"
    if (name.starts_with("video") && name.size() > kPrefix && name.size() <= kPrefix + kMaxDigits &&
        name.find_first_not_of("0123456789", kPrefix) == std::string::npos)
      numbers.push_back(std::stoi(name.substr(kPrefix)));
  }
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

}  // namespace

std::vector<ConnectedCamera> v4l2_cameras(const fs::path& dev, const fs::path& sys) {
  const std::map<fs::path, std::string> permanent = permanent_names(dev);
  std::vector<ConnectedCamera> cameras;
  for (const int number : device_numbers(dev)) {
    const std::string video = "video" + std::to_string(number);
    const std::string path = (dev / video).string();
    ConnectedCamera camera;
    camera.key = "v4l2";
    const auto name = permanent.find(video);
    camera.value = name == permanent.end() ? path : name->second;
    if (camera.value != path) camera.facts.push_back("now " + path);
    camera.link = usb_link(sys, video);
    const Device device(path);
    if (!device.is_open()) {
      camera.title = "unknown";
      camera.facts.push_back(errno == EACCES
                                 ? "no permission to open it: add the user to the group video"
                                 : "cannot be opened: " + std::string(std::strerror(errno)));
      cameras.push_back(std::move(camera));
      continue;
    }
    v4l2_capability capability{};
    if (!device.query(VIDIOC_QUERYCAP, capability)) continue;
    const std::uint32_t able = (capability.capabilities & V4L2_CAP_DEVICE_CAPS)
                                   ? capability.device_caps
                                   : capability.capabilities;
    if (!(able & V4L2_CAP_VIDEO_CAPTURE)) continue;
    camera.title = base::printable(text_of(capability.card));
    camera.modes = modes_of(device);
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

}  // namespace fivepipe::capture
