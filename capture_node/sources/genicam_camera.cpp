#include "capture_node/sources/genicam_camera.h"

#include <arpa/inet.h>

#include <algorithm>
#include <mutex>

namespace fivepipe::capture {
namespace {

std::string text_of(const char* text) { return text ? text : ""; }

bool is_ip_address(const std::string& text) {
  in_addr address;
  return inet_pton(AF_INET, text.c_str(), &address) == 1;
}

OwnedObject<ArvCamera> opened_by_id(const std::string& id, std::string& why) {
  AravisError error;
  OwnedObject<ArvCamera> camera(arv_camera_new(id.c_str(), error.out()));
  if (!camera)
    why = (error.is_set() ? error.text() : "the camera does not answer") +
          "; check its power, its cable and its address (`fivepipe cameras` lists the cameras that "
          "answer)";
  return camera;
}

// A camera has its name, model and serial number in its identifier, too.
bool is_called(const GenicamCamera& camera, const std::string& name) {
  return name == camera.name || name == camera.serial || name == camera.address ||
         name == camera.vendor + "-" + camera.serial;
}

}  // namespace

std::vector<GenicamCamera> discovered_cameras() {
  // Aravis keeps one list of cameras, whose texts are valid until its next update.
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  arv_update_device_list();
  std::vector<GenicamCamera> cameras;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    GenicamCamera camera;
    camera.name = text_of(arv_get_device_id(i));
    camera.vendor = text_of(arv_get_device_vendor(i));
    camera.model = text_of(arv_get_device_model(i));
    camera.serial = text_of(arv_get_device_serial_nbr(i));
    camera.protocol = text_of(arv_get_device_protocol(i));
    camera.address = text_of(arv_get_device_address(i));
    cameras.push_back(std::move(camera));
  }
  std::sort(cameras.begin(), cameras.end(),
            [](const GenicamCamera& a, const GenicamCamera& b) { return a.name < b.name; });
  return cameras;
}

OwnedObject<ArvCamera> opened_camera(const GenicamCamera& camera, std::string& why) {
  // Aravis looks up an unknown identifier as a host name, which may block.
  return opened_by_id(is_ip_address(camera.address) ? camera.address : camera.name, why);
}

OwnedObject<ArvCamera> opened_camera(const std::string& name, std::string& why) {
  if (is_ip_address(name)) return opened_by_id(name, why);
  const std::vector<GenicamCamera> cameras = discovered_cameras();
  for (const GenicamCamera& camera : cameras)
    if (is_called(camera, name)) return opened_camera(camera, why);
  why = "no such camera; ";
  if (cameras.empty()) {
    why += "no GenICam camera answers: check its power, cable and address (`fivepipe cameras`)";
    return nullptr;
  }
  why += "connected cameras:";
  for (const GenicamCamera& camera : cameras) why += " " + camera.name;
  return nullptr;
}

}  // namespace fivepipe::capture
