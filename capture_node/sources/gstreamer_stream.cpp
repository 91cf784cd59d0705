// The module fivepipe_gstreamer.so: images of a GStreamer pipeline. It uses only the core of
// GStreamer; elements, such as the appsink at the end, are reached by their properties and signals.
#include <gst/gst.h>

#include <chrono>
#include <cstring>

#include "capture_node/sources/stream_modules.h"
#include "common/base/realtime.h"

namespace fivepipe::capture {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// The sink keeps only the newest image.
constexpr const char* kSink =
    " ! videoconvert ! video/x-raw,format=BGR ! appsink name=fivepipe_sink max-buffers=1 drop=true";
constexpr GstClockTime kPollPeriod = 100 * GST_MSECOND;
// A live pipeline that delivers nothing for this time is opened again. Cameras need seconds for
// their first image.
constexpr auto kFirstSilence = 10s, kSilence = 5s;
// A stamp that is older is not the time of the image, but of another clock.
constexpr gint64 kMaxAge_ns = 5'000'000'000;

struct Unref {
  void operator()(void* object) const { gst_object_unref(object); }
  void operator()(GstSample* sample) const { gst_sample_unref(sample); }
  void operator()(GstMessage* message) const { gst_message_unref(message); }
  void operator()(GError* error) const { g_error_free(error); }
};
template <class T>
using Owned = std::unique_ptr<T, Unref>;

// "source: Could not open resource. (Connection refused)": the last line of the debug text is the
// cause.
std::string text_of(GstMessage* message) {
  GError* error = nullptr;
  gchar* debug = nullptr;
  gst_message_parse_error(message, &error, &debug);
  const Owned<GError> owned(error);
  std::string text = std::string(GST_MESSAGE_SRC_NAME(message)) + ": " + error->message;
  if (debug != nullptr) {
    const std::string lines = debug;
    const std::size_t last = lines.rfind('\n');
    if (last != std::string::npos) text += " (" + lines.substr(last + 1) + ")";
  }
  g_free(debug);
  return text;
}

// The pipeline for messages: its addresses lose user and password.
std::string without_passwords(std::string pipeline) {
  for (std::size_t at = pipeline.find("://"); at != std::string::npos;
       at = pipeline.find("://", at + 1)) {
    const std::size_t host = at + 3, end = pipeline.find_first_of("/\" ", host);
    const std::size_t user_end = pipeline.substr(0, end).rfind('@');
    if (user_end != std::string::npos && user_end >= host)
      pipeline.erase(host, user_end + 1 - host);
  }
  return pipeline;
}

class GstreamerStream final : public ImageStream {
 public:
  explicit GstreamerStream(std::string pipeline) : description_(std::move(pipeline)) {}
  ~GstreamerStream() override { close(); }
  GstreamerStream(const GstreamerStream&) = delete;
  GstreamerStream& operator=(const GstreamerStream&) = delete;

  std::optional<StreamFault> open() override {
    close();
    error_.clear();
    GError* error = nullptr;
    if (!gst_init_check(nullptr, nullptr, &error)) {
      const Owned<GError> owned(error);
      return StreamFault{
          SourceFault::not_decodable,
          std::string("GStreamer does not start: ") + (error ? error->message : "unknown reason")};
    }
    pipeline_.reset(gst_parse_launch((description_ + kSink).c_str(), &error));
    const Owned<GError> owned(error);
    if (error != nullptr || !pipeline_ || !GST_IS_BIN(pipeline_.get())) {
      const std::string why = error ? error->message : "it has no elements";
      close();
      return StreamFault{SourceFault::not_decodable,
                         "cannot build the pipeline \"" + without_passwords(description_) +
                             "\": " + why +
                             "; test it by gst-launch-1.0, and list the installed elements by "
                             "gst-inspect-1.0 (package gstreamer1.0-tools)"};
    }
    sink_.reset(gst_bin_get_by_name(GST_BIN(pipeline_.get()), "fivepipe_sink"));
    bus_.reset(gst_element_get_bus(pipeline_.get()));
    // Live sources deliver nothing before they play.
    if (gst_element_set_state(pipeline_.get(), GST_STATE_PAUSED) == GST_STATE_CHANGE_FAILURE) {
      const std::string why = bus_error();
      close();
      return StreamFault{SourceFault::hardware_failed,
                         "cannot start the pipeline: " + (why.empty() ? "unknown reason" : why)};
    }
    is_playing_ = is_live_ = has_image_ = false;
    last_image_ = Clock::now();
    return {};
  }

  NextImage next() override {
    if (!is_playing_) {
      const GstStateChangeReturn change =
          gst_element_get_state(pipeline_.get(), nullptr, nullptr, kPollPeriod);
      if (const std::string why = bus_error(); !why.empty()) return lost(why);
      if (change == GST_STATE_CHANGE_FAILURE) return lost("cannot start the pipeline");
      if (change == GST_STATE_CHANGE_ASYNC) {
        if (Clock::now() - last_image_ > kFirstSilence)
          return lost("the pipeline does not start within " +
                      std::to_string(kFirstSilence.count()) + " s");
        return {};
      }
      play(change == GST_STATE_CHANGE_NO_PREROLL);
    }
    GstSample* pulled = nullptr;
    g_signal_emit_by_name(sink_.get(), "try-pull-sample", kPollPeriod, &pulled);
    if (const Owned<GstSample> sample(pulled); sample) {
      last_image_ = Clock::now();
      has_image_ = true;
      bus_error();  // the images before an error come first
      return image_of(sample.get());
    }
    if (const std::string why = bus_error(); !why.empty()) {
      NextImage next = lost(why);
      // A file would start again at its beginning.
      if (!is_live_) next.status = NextImage::Status::failed;
      return next;
    }
    gboolean is_eos = FALSE;
    g_object_get(sink_.get(), "eos", &is_eos, nullptr);
    if (is_eos)
      return is_live_ ? lost("the stream has ended") : NextImage{NextImage::Status::end, {}, 0, ""};
    const auto silence = has_image_ ? kSilence : kFirstSilence;
    if (is_live_ && Clock::now() - last_image_ > silence)
      return lost("no image for " + std::to_string(silence.count()) + " s");
    return {};
  }

 private:
  static NextImage lost(std::string why) {
    return {NextImage::Status::lost, {}, 0, std::move(why)};
  }

  // The images of a live pipeline are delivered as they arrive, those of others at their times.
  void play(bool is_live) {
    is_live_ = is_live;
    g_object_set(sink_.get(), "sync", gboolean(!is_live), nullptr);
    gst_element_set_state(pipeline_.get(), GST_STATE_PLAYING);
    is_playing_ = true;
    last_image_ = Clock::now();
  }

  // Takes all messages, which would pile up. Returns the text of the pipeline's first error; empty
  // if there was none.
  std::string bus_error() {
    while (const Owned<GstMessage> message{gst_bus_pop(bus_.get())})
      if (GST_MESSAGE_TYPE(message.get()) == GST_MESSAGE_ERROR && error_.empty())
        error_ = text_of(message.get());
    return error_;
  }

  NextImage image_of(GstSample* sample) {
    int width_px = 0, height_px = 0;
    if (const GstCaps* caps = gst_sample_get_caps(sample)) {
      const GstStructure* format = gst_caps_get_structure(caps, 0);
      gst_structure_get_int(format, "width", &width_px);
      gst_structure_get_int(format, "height", &height_px);
    }
    GstBuffer* const buffer = gst_sample_get_buffer(sample);
    GstMapInfo map;
    if (width_px <= 0 || height_px <= 0 || !gst_buffer_map(buffer, &map, GST_MAP_READ))
      return lost("an image without size or content");
    NextImage next;
    // GStreamer's default layout: rows begin at multiples of 4 bytes.
    const std::size_t row = 3 * std::size_t(width_px), stride = (row + 3) / 4 * 4;
    if (map.size >= stride * std::size_t(height_px - 1) + row) {
      next.status = NextImage::Status::image;
      next.bgr = cv::Mat(height_px, width_px, CV_8UC3, map.data, stride).clone();
      next.taken_ns = taken_ns(gst_sample_get_segment(sample), GST_BUFFER_PTS(buffer));
    } else {
      next = lost("an image that is too short");
    }
    gst_buffer_unmap(buffer, &map);
    return next;
  }

  // The time at which the image entered the pipeline: its running time, from the pipeline's clock
  // to CLOCK_REALTIME; the present time if it has none.
  std::int64_t taken_ns(const GstSegment* segment, GstClockTime pts) const {
    const std::int64_t now_ns = base::now_realtime_ns();
    const Owned<GstClock> clock(gst_element_get_clock(pipeline_.get()));
    const GstClockTime running = gst_segment_to_running_time(segment, GST_FORMAT_TIME, pts),
                       base = gst_element_get_base_time(pipeline_.get());
    if (!clock || !GST_CLOCK_TIME_IS_VALID(pts) || !GST_CLOCK_TIME_IS_VALID(running) ||
        !GST_CLOCK_TIME_IS_VALID(base))
      return now_ns;
    const auto age_ns = gint64(gst_clock_get_time(clock.get())) - gint64(base + running);
    return age_ns >= 0 && age_ns <= kMaxAge_ns ? now_ns - age_ns : now_ns;
  }

  // May block while a driver or a server does.
  void close() {
    if (pipeline_) gst_element_set_state(pipeline_.get(), GST_STATE_NULL);
    sink_.reset();
    bus_.reset();
    pipeline_.reset();
  }

  std::string description_, error_;
  Owned<GstElement> pipeline_, sink_;
  Owned<GstBus> bus_;
  bool is_playing_ = false, is_live_ = false, has_image_ = false;
  Clock::time_point last_image_;
};

}  // namespace
}  // namespace fivepipe::capture

extern "C" void fivepipe_make_gstreamer_stream(
    const std::string& pipeline, std::unique_ptr<fivepipe::capture::ImageStream>& stream) {
  stream = std::make_unique<fivepipe::capture::GstreamerStream>(pipeline);
}
