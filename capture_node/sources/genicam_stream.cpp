// The module fivepipe_genicam.so: images of GigE Vision and USB3 Vision cameras, by Aravis.
#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "capture_node/sources/genicam_camera.h"
#include "capture_node/sources/genicam_image.h"

namespace fivepipe::capture {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr int kBuffers = 4;
constexpr auto kPollPeriod = 100ms;
// A camera that sends nothing for this time, or for three periods, is opened again: the heartbeat
// of a GigE camera, by which Aravis notices a loss, takes up to 6 s. The first image may need
// longer.
constexpr auto kSilence = 1000ms, kFirstSilence = 5000ms;
constexpr double kSilentPeriods = 3, kMaxPeriod_s = 10;

struct Connection {
  ~Connection() {
    if (on_loss != 0) g_signal_handler_disconnect(arv_camera_get_device(camera.get()), on_loss);
    if (is_acquiring) arv_camera_stop_acquisition(camera.get(), nullptr);
    stream.reset();
  }
  OwnedObject<ArvCamera> camera;
  OwnedObject<ArvStream> stream;
  std::atomic<bool> is_control_lost = false;
  gulong on_loss = 0;
  bool is_acquiring = false;
};

// Aravis waits seconds for the answers of a camera that is gone. Nothing of this process depends on
// their end.
void close_apart(std::unique_ptr<Connection> connection) {
  if (connection)
    std::thread([owned = std::move(connection)]() mutable { owned.reset(); }).detach();
}

void set_value(ArvCamera* camera, double value, const char* key, double low, double high,
               void (*set)(ArvCamera*, double, GError**), std::string& why) {
  AravisError error;
  if (!(value >= low && value <= high)) {
    why = fmt::format("{} must be from {} to {} on this camera, is {}", key, low, high, value);
    return;
  }
  set(camera, value, error.out());
  if (error.is_set()) why = std::string("cannot set ") + key + ": " + error.text();
}

class GenicamStream final : public ImageStream {
 public:
  explicit GenicamStream(GenicamSettings settings) : settings_(std::move(settings)) {}
  GenicamStream(const GenicamStream&) = delete;
  GenicamStream& operator=(const GenicamStream&) = delete;

  std::optional<StreamFault> open() override {
    close_apart(std::move(connection_));
    auto connection = std::make_unique<Connection>();
    std::string why;
    connection->camera = opened_camera(settings_.camera, why);
    if (!connection->camera) return StreamFault{SourceFault::hardware_missing, why};
    ArvDevice* const device = arv_camera_get_device(connection->camera.get());
    if (ARV_IS_GV_DEVICE(device) && !arv_gv_device_is_controller(ARV_GV_DEVICE(device)))
      return StreamFault{SourceFault::hardware_failed,
                         "another program controls the camera: end it; after a crash of that "
                         "program the camera is free within seconds"};
    if (auto fault = size_fault(connection->camera.get())) return fault;
    configure(connection->camera.get(), why);
    if (why.empty()) start(*connection, why);
    if (!why.empty()) return StreamFault{SourceFault::hardware_failed, why};
    silence_ = silence_of(connection->camera.get());
    connection_ = std::move(connection);
    last_image_ = Clock::now();
    has_image_ = false;
    incomplete_.clear();
    return {};
  }

  NextImage next() override {
    ArvStream* const stream = connection_->stream.get();
    ArvBuffer* const buffer = newest_buffer(stream);
    if (buffer == nullptr) {
      const auto silence = has_image_ ? silence_ : kFirstSilence + silence_;
      if (connection_->is_control_lost) return lost("the camera no longer answers");
      if (Clock::now() - last_image_ > silence)
        return lost(incomplete_.empty() ? fmt::format("no image for {:g} s", silence.count() / 1e3)
                                        : incomplete_);
      return {NextImage::Status::none, {}, 0, incomplete_};
    }
    NextImage next = image_of(buffer);
    arv_stream_push_buffer(stream, buffer);
    if (next.status == NextImage::Status::image) {
      last_image_ = Clock::now();
      has_image_ = true;
      incomplete_.clear();
    }
    return next;
  }

 private:
  static NextImage lost(std::string why) {
    return {NextImage::Status::lost, {}, 0, std::move(why)};
  }

  // The exposure bounds the rate of a camera that does not report one.
  static std::chrono::milliseconds silence_of(ArvCamera* camera) {
    AravisError no_rate, no_exposure;
    const double rate_hz = arv_camera_get_frame_rate(camera, no_rate.out()),
                 exposure_us = arv_camera_get_exposure_time(camera, no_exposure.out());
    double period_s = 0;
    if (!no_rate.is_set() && rate_hz > 0) period_s = 1 / rate_hz;
    if (!no_exposure.is_set()) period_s = std::max(period_s, 1e-6 * exposure_us);
    period_s = std::min(period_s, kMaxPeriod_s);
    return std::max(kSilence, std::chrono::milliseconds(int(1e3 * kSilentPeriods * period_s)));
  }

  // Aravis does not check the size that it sets.
  std::optional<StreamFault> size_fault(ArvCamera* camera) const {
    AravisError error;
    int min_width_px = 0, max_width_px = 0, min_height_px = 0, max_height_px = 0;
    arv_camera_get_width_bounds(camera, &min_width_px, &max_width_px, error.out());
    if (!error.is_set())
      arv_camera_get_height_bounds(camera, &min_height_px, &max_height_px, error.out());
    const bool is_possible =
        settings_.width_px >= min_width_px && settings_.width_px <= max_width_px &&
        settings_.height_px >= min_height_px && settings_.height_px <= max_height_px;
    if (error.is_set() || is_possible) return {};
    return StreamFault{
        SourceFault::wrong_size,
        fmt::format("its images can have {}x{} to {}x{} px with its present offset, image_size_px "
                    "of the rig is {}x{}",
                    min_width_px, min_height_px, max_width_px, max_height_px, settings_.width_px,
                    settings_.height_px)};
  }

  // Free-running, with the size of the rig if the camera can have it; opening tests the size of the
  // first image. `why` is empty on success.
  void configure(ArvCamera* camera, std::string& why) const {
    AravisError error;
    arv_camera_stop_acquisition(camera, error.out());  // of a program that crashed
    arv_camera_clear_triggers(camera, error.out());    // cameras without triggers refuse
    arv_camera_set_acquisition_mode(camera, ARV_ACQUISITION_MODE_CONTINUOUS, error.out());
    guint count = 0;
    gint64* const formats = arv_camera_dup_available_pixel_formats(camera, &count, error.out());
    const std::vector<std::int64_t> available(formats, formats + count);
    g_free(formats);
    const auto format = best_format(arv_camera_get_pixel_format(camera, error.out()), available);
    if (!format) {
      why =
          "it has no pixel format that fivepipe reads: Mono8, Bayer of 8 bits, YUV422 of 8 bits, "
          "RGB8 or BGR8";
      return;
    }
    arv_camera_set_pixel_format(camera, ArvPixelFormat(*format), error.out());
    if (error.is_set()) {
      why = "cannot set the pixel format " + name_of(*format) + ": " + error.text();
      return;
    }
    arv_camera_set_region(camera, -1, -1, settings_.width_px, settings_.height_px, error.out());
    if (settings_.exposure_us) set_exposure(camera, why);
    if (why.empty() && settings_.gain_db) set_gain(camera, why);
  }

  void set_exposure(ArvCamera* camera, std::string& why) const {
    AravisError error;
    if (arv_camera_is_exposure_auto_available(camera, error.out()))
      arv_camera_set_exposure_time_auto(camera, ARV_AUTO_OFF, error.out());
    double low = 0, high = 0;
    arv_camera_get_exposure_time_bounds(camera, &low, &high, error.out());
    if (error.is_set())
      why = "exposure_us: the camera has no exposure time: " + error.text();
    else
      set_value(camera, *settings_.exposure_us, "exposure_us", low, high,
                arv_camera_set_exposure_time, why);
  }

  void set_gain(ArvCamera* camera, std::string& why) const {
    AravisError error;
    if (arv_camera_is_gain_auto_available(camera, error.out()))
      arv_camera_set_gain_auto(camera, ARV_AUTO_OFF, error.out());
    double low = 0, high = 0;
    arv_camera_get_gain_bounds(camera, &low, &high, error.out());
    if (error.is_set())
      why = "gain_db: the camera has no gain: " + error.text();
    else
      set_value(camera, *settings_.gain_db, "gain_db", low, high, arv_camera_set_gain, why);
  }

  static void start(Connection& connection, std::string& why) {
    ArvCamera* const camera = connection.camera.get();
    AravisError error;
    connection.stream.reset(arv_camera_create_stream(camera, nullptr, nullptr, error.out()));
    if (!connection.stream) {
      why = "cannot receive its images: " + error.text();
      return;
    }
    const guint payload = arv_camera_get_payload(camera, error.out());
    if (error.is_set()) {
      why = "cannot read the size of its images in bytes: " + error.text();
      return;
    }
    for (int i = 0; i < kBuffers; ++i)
      arv_stream_push_buffer(connection.stream.get(), arv_buffer_new_allocate(payload));
    connection.on_loss = g_signal_connect(
        arv_camera_get_device(camera), "control-lost",
        G_CALLBACK(+[](ArvDevice*, std::atomic<bool>* is_lost) { *is_lost = true; }),
        &connection.is_control_lost);
    arv_camera_start_acquisition(camera, error.out());
    if (error.is_set())
      why = "cannot start: " + error.text();
    else
      connection.is_acquiring = true;
  }

  // Waits for a buffer, and gives all but the newest complete one back.
  static ArvBuffer* newest_buffer(ArvStream* stream) {
    ArvBuffer* newest = arv_stream_timeout_pop_buffer(
        stream, std::chrono::duration_cast<std::chrono::microseconds>(kPollPeriod).count());
    while (newest != nullptr) {
      ArvBuffer* const later = arv_stream_try_pop_buffer(stream);
      if (later == nullptr) break;
      const bool is_better = arv_buffer_get_status(later) == ARV_BUFFER_STATUS_SUCCESS ||
                             arv_buffer_get_status(newest) != ARV_BUFFER_STATUS_SUCCESS;
      arv_stream_push_buffer(stream, is_better ? newest : later);
      if (is_better) newest = later;
    }
    return newest;
  }

  NextImage image_of(ArvBuffer* buffer) {
    NextImage next;
    if (arv_buffer_get_status(buffer) != ARV_BUFFER_STATUS_SUCCESS) {
      incomplete_ =
          "its images arrive incomplete: packets are lost; increase the MTU of the network and "
          "net.core.rmem_max, or lower the rate";
      next.why = incomplete_;
      return next;
    }
    std::size_t size = 0;
    const void* const bytes = arv_buffer_get_image_data(buffer, &size);
    gint padding = 0, rows_of_padding = 0;
    arv_buffer_get_image_padding(buffer, &padding, &rows_of_padding);
    next.bgr = bgr_of(std::uint32_t(arv_buffer_get_image_pixel_format(buffer)),
                      arv_buffer_get_image_width(buffer), arv_buffer_get_image_height(buffer),
                      bytes, size, padding);
    if (next.bgr.empty()) return lost("an image of another pixel format than the one requested");
    next.status = NextImage::Status::image;
    // CLOCK_REALTIME at which the first packet arrived: at the end of the exposure.
    next.taken_ns = std::int64_t(arv_buffer_get_system_timestamp(buffer));
    return next;
  }

  GenicamSettings settings_;
  std::unique_ptr<Connection> connection_;
  Clock::time_point last_image_;
  bool has_image_ = false;
  std::chrono::milliseconds silence_ = kSilence;
  std::string incomplete_;  // since the last image
};

void add_details(GenicamCamera& listed) {
  const OwnedObject<ArvCamera> camera = opened_camera(listed, listed.why_unknown);
  if (!camera) return;
  AravisError error;
  arv_camera_get_sensor_size(camera.get(), &listed.sensor_width_px, &listed.sensor_height_px,
                             error.out());
  listed.rate_hz = arv_camera_get_frame_rate(camera.get(), error.out());
  guint count = 0;
  const char** const formats =
      arv_camera_dup_available_pixel_formats_as_strings(camera.get(), &count, error.out());
  for (guint i = 0; i < count; ++i) listed.pixel_formats.emplace_back(formats[i]);
  g_free(formats);
}

}  // namespace
}  // namespace fivepipe::capture

extern "C" void fivepipe_make_genicam_stream(
    const fivepipe::capture::GenicamSettings& settings,
    std::unique_ptr<fivepipe::capture::ImageStream>& stream) {
  stream = std::make_unique<fivepipe::capture::GenicamStream>(settings);
}

extern "C" void fivepipe_list_genicam_cameras(
    std::vector<fivepipe::capture::GenicamCamera>& cameras) {
  cameras = fivepipe::capture::discovered_cameras();
  for (fivepipe::capture::GenicamCamera& camera : cameras) fivepipe::capture::add_details(camera);
}
