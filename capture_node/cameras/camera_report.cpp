#include "capture_node/cameras/camera_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

namespace fivepipe::capture {
namespace {

bool is_same(const CameraMode& a, const CameraMode& b) {
  return a.format == b.format && a.width_px == b.width_px && a.height_px == b.height_px;
}

std::string mode_text(const CameraMode& mode) {
  std::string text = fmt::format("{} {}x{}", mode.format, mode.width_px, mode.height_px);
  if (mode.rate_hz > 0) text += fmt::format(" at {:.4g} Hz", mode.rate_hz);
  return text;
}

std::string bandwidth_text(const CameraMode& mode) {
  if (const auto needed = bandwidth_mbit_s(mode)) return fmt::format(": {:.0f} Mbit/s", *needed);
  return mode.rate_hz > 0 ? ": depends on the image" : "";
}

std::string link_text(const CameraLink& link) {
  if (!(link.speed_mbit_s > 0)) return link.name + ", of unknown speed";
  return fmt::format("{}, {:.0f} Mbit/s, of which images can have {:.0f}", link.name,
                     link.speed_mbit_s, link.usable * link.speed_mbit_s);
}

std::string verdict(const SharedMode& shared) {
  if (!shared.fits) return "";
  return *shared.fits ? ", fits" : ", does not fit";
}

std::string shared_text(const SharedLink& shared) {
  std::string text = fmt::format("{}: {} camera{}\n", link_text(shared.link), shared.cameras,
                                 shared.cameras == 1 ? "" : "s");
  for (const SharedMode& mode : shared.modes)
    text += fmt::format("  {}: {:.0f} Mbit/s{}{}\n", mode_text(mode.mode), mode.needed_mbit_s,
                        shared.cameras == 1 ? "" : " together", verdict(mode));
  if (shared.modes.empty()) text += "  no uncompressed mode of known rate that all of them have\n";
  return text;
}

// The modes of the first camera that the others have, too, at the highest rate of all.
std::vector<SharedMode> common_modes(const std::vector<const ConnectedCamera*>& cameras,
                                     const CameraLink& link) {
  std::vector<SharedMode> common;
  for (CameraMode mode : cameras.front()->modes) {
    const bool all_have_it =
        std::all_of(cameras.begin(), cameras.end(), [&](const ConnectedCamera* camera) {
          for (const CameraMode& other : camera->modes)
            if (is_same(mode, other)) {
              mode.rate_hz = std::min(mode.rate_hz, other.rate_hz);
              return true;
            }
          return false;
        });
    const auto of_one = bandwidth_mbit_s(mode);
    if (!all_have_it || !of_one) continue;
    const double needed = double(cameras.size()) * *of_one;
    common.push_back({mode, needed,
                      link.speed_mbit_s > 0
                          ? std::optional(needed <= link.usable * link.speed_mbit_s)
                          : std::nullopt});
  }
  std::stable_sort(common.begin(), common.end(), [](const SharedMode& a, const SharedMode& b) {
    return a.needed_mbit_s < b.needed_mbit_s;
  });
  return common;
}

}  // namespace

std::vector<SharedLink> shared_links(const std::vector<ConnectedCamera>& cameras) {
  std::map<std::string, std::vector<const ConnectedCamera*>> by_link;
  for (const ConnectedCamera& camera : cameras)
    if (!camera.link.name.empty()) by_link[camera.link.name].push_back(&camera);
  std::vector<SharedLink> links;
  for (const auto& [name, of_link] : by_link) {
    const CameraLink& link = of_link.front()->link;
    links.push_back({link, int(of_link.size()), common_modes(of_link, link)});
  }
  return links;
}

std::string report_text(const std::vector<ConnectedCamera>& cameras,
                        const std::vector<std::string>& notes) {
  std::string text;
  if (cameras.empty()) text = "no camera is connected\n";
  for (const ConnectedCamera& camera : cameras) {
    text += fmt::format("{}: {}\n  {}\n", camera.key, camera.value, camera.title);
    for (const std::string& fact : camera.facts) text += "  " + fact + "\n";
    for (const CameraMode& mode : camera.modes)
      text += "  " + mode_text(mode) + bandwidth_text(mode) + "\n";
    text += "\n";
  }
  for (const SharedLink& shared : shared_links(cameras)) text += shared_text(shared);
  for (const std::string& note : notes) text += note + "\n";
  return text;
}

nlohmann::json report_json(const std::vector<ConnectedCamera>& cameras,
                           const std::vector<std::string>& notes) {
  const auto json_of = [](const CameraMode& mode) {
    nlohmann::json json{{"format", mode.format},
                        {"width_px", mode.width_px},
                        {"height_px", mode.height_px},
                        {"rate_hz", mode.rate_hz}};
    if (const auto needed = bandwidth_mbit_s(mode)) json["bandwidth_mbit_s"] = *needed;
    return json;
  };
  nlohmann::json json{
      {"cameras", nlohmann::json::array()}, {"links", nlohmann::json::array()}, {"notes", notes}};
  for (const ConnectedCamera& camera : cameras) {
    nlohmann::json of_camera{{"key", camera.key},        {"value", camera.value},
                             {"title", camera.title},    {"facts", camera.facts},
                             {"link", camera.link.name}, {"modes", nlohmann::json::array()}};
    for (const CameraMode& mode : camera.modes) of_camera["modes"].push_back(json_of(mode));
    json["cameras"].push_back(std::move(of_camera));
  }
  for (const SharedLink& shared : shared_links(cameras)) {
    nlohmann::json of_link{{"name", shared.link.name},
                           {"speed_mbit_s", shared.link.speed_mbit_s},
                           {"cameras", shared.cameras},
                           {"modes", nlohmann::json::array()}};
    for (const SharedMode& mode : shared.modes) {
      nlohmann::json of_mode = json_of(mode.mode);
      of_mode["bandwidth_mbit_s"] = mode.needed_mbit_s;
      if (mode.fits) of_mode["fits"] = *mode.fits;
      of_link["modes"].push_back(std::move(of_mode));
    }
    json["links"].push_back(std::move(of_link));
  }
  return json;
}

}  // namespace fivepipe::capture
