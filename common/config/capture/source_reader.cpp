#include "common/config/capture/source_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "common/config/capture/image_path.h"

namespace fivepipe::config {
namespace {

constexpr Range kFirstFrame{0, kUnbounded};
// A screen whose colour is nearer to grey has no hue that noise does not change.
constexpr double kMinKeyRange = 0.2;
constexpr std::size_t kFourCharacters = 4;  // of a FOURCC
constexpr const char *kMatte = "matte", *kAlpha = "alpha", *kChroma = "chroma_key",
                     *kBackground = "background";

ChromaKey read_chroma_key(YamlMap map) {
  constexpr Range kHueAngle_deg{1, 90};
  ChromaKey key;
  key.rgb = map.rgb("rgb", key.rgb);
  key.max_angle_deg = map.number("max_angle_deg", kHueAngle_deg, key.max_angle_deg);
  key.min_chroma = map.number("min_chroma", {0, 1, true}, key.min_chroma);
  map.finish();
  const auto [least, most] = std::minmax_element(key.rgb.begin(), key.rgb.end());
  if (*most - *least < kMinKeyRange)
    map.problem(
        fmt::format("chroma_key: the colour [{}] is too grey: its largest and smallest "
                    "component must differ by at least {}",
                    fmt::join(key.rgb, ", "), kMinKeyRange));
  return key;
}

// Reads how objects are found. A video needs one of the keys; a camera learns its background unless
// it has another one.
ObjectKey read_object_key(YamlMap& map, bool is_video, bool is_here) {
  const std::vector<std::string> allowed =
      is_video ? std::vector<std::string>{kBackground, kMatte, kAlpha, kChroma}
               : std::vector<std::string>{kBackground, kChroma};
  std::vector<std::string> present;
  for (const std::string& key : allowed)
    if (map.has(key) && (key != kAlpha || map.flag(kAlpha))) present.push_back(key);
  if (present.size() > 1)
    map.problem_at(present[1], fmt::format("{} and {} are both set: a camera finds its objects in "
                                           "one way",
                                           present[0], present[1]));
  if (map.has(kChroma)) return read_chroma_key(map.map(kChroma));
  if (is_video && map.has(kMatte)) {
    MatteFile matte{read_image_path(map, kMatte, is_here)};
    if (is_single_picture(matte.file))
      map.problem_at(kMatte,
                     "matte must be a video or a sequence such as mask_%04d.png: one picture "
                     "is the mask of one frame");
    return matte;
  }
  if (is_video && map.has(kAlpha) && map.flag(kAlpha)) return AlphaChannel{};
  if (is_video && present.empty()) {
    map.problem(std::string("set one of ") + kBackground + ", " + kMatte + ", " + kAlpha + " and " +
                kChroma + ": how to find the objects in the images");
    map.has(kBackground);
    return LearnedBackground{};
  }
  LearnedBackground background;
  if (is_video || map.has(kBackground))
    background.file = read_image_path(map, kBackground, is_here);
  return background;
}

// Reads how the objects of a camera are found that delivers images while fivepipe runs.
ObjectKey read_live_key(YamlMap& map, bool is_here) {
  ObjectKey key = read_object_key(map, false, is_here);
  auto* const background = std::get_if<LearnedBackground>(&key);
  if (background && background->file.empty())
    background->frames =
        map.integer("background_frames", {1, kMaxLearningImages}, background->frames);
  else if (map.has("background_frames"))
    map.problem_at(
        "background_frames",
        "background_frames is only for a camera that learns its background at the start");
  return key;
}

V4l2Source read_v4l2(YamlMap& map, bool is_here) {
  V4l2Source source;
  source.device = map.text("v4l2");
  if (map.has("format")) {
    source.format = map.text("format");
    const bool is_printable = std::all_of(source.format.begin(), source.format.end(),
                                          [](char c) { return c >= ' ' && c <= '~'; });
    if (source.format.size() != kFourCharacters || !is_printable)
      map.problem_at("format",
                     "format must have four characters, such as MJPG or YUYV (`fivepipe cameras` "
                     "lists those of the camera)");
  }
  constexpr Range kRate_hz{kMinCameraRate_hz, 1000};
  if (map.has("rate_hz")) source.rate_hz = map.number("rate_hz", kRate_hz);
  source.key = read_live_key(map, is_here);
  return source;
}

GstreamerSource read_gstreamer(YamlMap& map, bool is_here) {
  GstreamerSource source;
  source.pipeline = map.text("gstreamer");
  if (source.pipeline.find_first_not_of(" \t\n") == std::string::npos)
    map.problem_at("gstreamer",
                   "gstreamer is empty: write the elements of a pipeline without its sink, such "
                   "as \"v4l2src device=/dev/video0\"");
  source.key = read_live_key(map, is_here);
  return source;
}

RtspSource read_rtsp(YamlMap& map, bool is_here) {
  RtspSource source;
  source.url = map.text("rtsp");
  const bool has_scheme = source.url.starts_with("rtsp://") || source.url.starts_with("rtsps://");
  const bool is_plain = std::all_of(source.url.begin(), source.url.end(), [](unsigned char c) {
    return c > ' ' && c < 0x7F && c != '"' && c != '\'' && c != '\\';
  });
  if (!has_scheme || !is_plain)
    map.problem_at("rtsp",
                   "rtsp must be an address such as rtsp://192.168.1.20:554/stream, without "
                   "quotes, spaces and other characters than ASCII (write them as %20)");
  source.key = read_live_key(map, is_here);
  return source;
}

GenicamSource read_genicam(YamlMap& map, bool is_here) {
  constexpr Range kExposure_us{1, kMaxExposure_us}, kGain_db{-100, 100};
  GenicamSource source;
  source.camera = map.text("genicam");
  if (source.camera.empty())
    map.problem_at("genicam",
                   "genicam is empty: write the name, the serial number or the address of the "
                   "camera (`fivepipe cameras` lists them)");
  if (map.has("exposure_us")) source.exposure_us = map.number("exposure_us", kExposure_us);
  if (map.has("gain_db")) source.gain_db = map.number("gain_db", kGain_db);
  source.key = read_live_key(map, is_here);
  return source;
}

VideoSource read_video(YamlMap& map, bool is_here) {
  VideoSource source;
  source.first_frame = map.integer("first_frame", kFirstFrame, 0);
  source.file = read_image_path(map, "video", is_here);
  source.key = read_object_key(map, true, is_here);
  return source;
}

}  // namespace

CameraSource read_source(YamlMap map, bool is_here) {
  std::vector<std::string> types;
  for (const char* type : {"video", "v4l2", "gstreamer", "rtsp", "genicam"})
    if (map.has(type)) types.push_back(type);
  if (types.size() > 1)
    map.problem_at(types[1], fmt::format("{} and {} are both set: a camera has one source",
                                         types[0], types[1]));
  const std::string type = types.empty() ? "video" : types.back();
  CameraSource source;
  if (type == "v4l2")
    source = read_v4l2(map, is_here);
  else if (type == "gstreamer")
    source = read_gstreamer(map, is_here);
  else if (type == "rtsp")
    source = read_rtsp(map, is_here);
  else if (type == "genicam")
    source = read_genicam(map, is_here);
  else
    source = read_video(map, is_here);
  map.finish();
  return source;
}

}  // namespace fivepipe::config
