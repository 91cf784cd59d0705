// The sources whose streams are in modules: GStreamer pipelines, network cameras, GenICam cameras.
#include <stdexcept>

#include "capture_node/sources/image_source.h"
#include "capture_node/sources/live_source.h"
#include "capture_node/sources/stream_modules.h"

namespace fivepipe::capture {
namespace {

using namespace std::chrono_literals;

// A network camera negotiates its stream and sends a key frame; a GigE camera sends its description
// of several 100 KB. GStreamer lists its plugins at the first use.
constexpr auto kFirstImageTimeout = 10s;

template <class Function>
Function* loaded(const config::RigCamera& camera, const std::string& name,
                 const base::OptionalModule& module, const char* function) {
  try {
    return reinterpret_cast<Function*>(function_of(module, function));
  } catch (const std::runtime_error& error) {
    throw_problems({{camera.name, SourceFault::not_found, name + ": " + error.what()}});
  }
}

std::unique_ptr<ImageSource> open_pipeline(const config::RigCamera& camera, const std::string& name,
                                           const std::string& pipeline,
                                           const std::string& silence) {
  auto* const make =
      loaded<MakeGstreamerStream>(camera, name, kGstreamerModule, kMakeGstreamerStream);
  std::unique_ptr<ImageStream> stream;
  make(pipeline, stream);
  return open_live_source(camera, {name, kFirstImageTimeout, silence}, std::move(stream));
}

// The address without user and password, for messages.
std::string public_address(const std::string& url) {
  const std::size_t host = url.find("://") + 3, path = url.find('/', host),
                    user_end = url.substr(0, path).rfind('@');
  return user_end == std::string::npos ? url : url.substr(0, host) + url.substr(user_end + 1);
}

}  // namespace

std::unique_ptr<ImageSource> open_gstreamer_source(const config::RigCamera& camera,
                                                   const config::GstreamerSource& source) {
  return open_pipeline(camera, "gstreamer", source.pipeline,
                       "no error either; test the pipeline by gst-launch-1.0 and a sink such as "
                       "autovideosink");
}

// TCP: a camera that vanishes is noticed, and no packet is lost. latency=0: no buffer against
// packets in the wrong order, which TCP does not need.
std::unique_ptr<ImageSource> open_rtsp_source(const config::RigCamera& camera,
                                              const config::RtspSource& source) {
  return open_pipeline(camera, public_address(source.url),
                       "rtspsrc location=\"" + source.url +
                           "\" protocols=tcp latency=0 drop-on-latency=true ! "
                           "application/x-rtp,media=video ! decodebin",
                       "no error either; does the camera send video that GStreamer decodes? H.264 "
                       "and H.265 need the package gstreamer1.0-libav");
}

std::unique_ptr<ImageSource> open_genicam_source(const config::RigCamera& camera,
                                                 const config::GenicamSource& source) {
  auto* const make =
      loaded<MakeGenicamStream>(camera, source.camera, kGenicamModule, kMakeGenicamStream);
  std::unique_ptr<ImageStream> stream;
  make({source.camera, camera.source.width_px, camera.source.height_px, source.exposure_us,
        source.gain_db},
       stream);
  return open_live_source(camera,
                          {source.camera, kFirstImageTimeout,
                           "it is connected and sends nothing; does a firewall drop its UDP "
                           "packets? Is its packet size larger than the MTU of the network?"},
                          std::move(stream));
}

}  // namespace fivepipe::capture
