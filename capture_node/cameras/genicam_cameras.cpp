#include "capture_node/cameras/genicam_cameras.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <stdexcept>

#include "capture_node/cameras/camera_link.h"
#include "capture_node/sources/genicam_image.h"
#include "common/base/text_table.h"

namespace fivepipe::capture {

ConnectedCamera connected_camera(const GenicamCamera& found, const std::filesystem::path& sys) {
  ConnectedCamera camera;
  camera.key = "genicam";
  camera.value = base::printable(found.name);
  camera.title = base::printable(found.vendor + " " + found.model);
  camera.facts.push_back(
      base::printable(fmt::format("serial number {}, {}{}", found.serial, found.protocol,
                                  found.address.empty() ? "" : ", address " + found.address)));
  if (!found.why_unknown.empty()) {
    camera.facts.push_back("cannot be opened: " + found.why_unknown);
  } else {
    camera.facts.push_back(
        fmt::format("sensor {}x{}", found.sensor_width_px, found.sensor_height_px));
    camera.facts.push_back(fmt::format("pixel formats: {}", fmt::join(found.pixel_formats, ", ")));
  }
  for (const std::string& name : found.pixel_formats)
    if (const auto format = format_named(name))
      camera.modes.push_back({name, found.sensor_width_px, found.sensor_height_px, found.rate_hz,
                              bits_per_pixel(*format)});
  camera.link = network_link(sys, found.address);
  if (camera.link.name.empty()) camera.link = usb_link_of_serial(sys, found.serial);
  return camera;
}

std::vector<ConnectedCamera> genicam_cameras(const std::filesystem::path& sys,
                                             std::vector<std::string>& notes) {
  std::vector<GenicamCamera> found;
  try {
    reinterpret_cast<ListGenicamCameras*>(function_of(kGenicamModule, kListGenicamCameras))(found);
  } catch (const std::runtime_error& error) {
    notes.push_back(std::string("GenICam cameras were not searched: ") + error.what());
  }
  std::vector<ConnectedCamera> cameras;
  for (const GenicamCamera& camera : found) cameras.push_back(connected_camera(camera, sys));
  return cameras;
}

}  // namespace fivepipe::capture
