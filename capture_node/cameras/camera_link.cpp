#include "capture_node/cameras/camera_link.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netinet/in.h>

#include <fstream>

namespace fivepipe::capture {
namespace {

namespace fs = std::filesystem;

// USB 2 gives at most 80 % of a bus to transfers of guaranteed rate. USB 3.0 sends 10 bits for 8.
constexpr double kUsableOfUsb = 0.8;
// Ethernet, IP, UDP and GVSP add 74 bytes to 1464 bytes of an image, with an MTU of 1500.
constexpr double kUsableOfEthernet = 0.95;

// Returns the number in a file; 0 if there is none.
double number_in(const fs::path& file) {
  double number = 0;
  std::ifstream(file) >> number;
  return number > 0 ? number : 0;
}

CameraLink link_of_bus(const fs::path& sys, int bus) {
  const std::string number = std::to_string(bus);
  return {"USB bus " + number, number_in(sys / "bus/usb/devices" / ("usb" + number) / "speed"),
          kUsableOfUsb};
}

}  // namespace

CameraLink usb_link(const fs::path& sys, const std::string& video) {
  std::error_code error;
  fs::path folder = fs::canonical(sys / "class/video4linux" / video / "device", error);
  if (error) return {};
  // The device of the camera is above its interface.
  for (; folder.has_relative_path(); folder = folder.parent_path())
    if (const double bus = number_in(folder / "busnum"); bus > 0) return link_of_bus(sys, int(bus));
  return {};
}

CameraLink usb_link_of_serial(const fs::path& sys, const std::string& serial) {
  std::error_code error;
  for (fs::directory_iterator entry(sys / "bus/usb/devices", error), end; !error && entry != end;
       entry.increment(error)) {
    std::string of_device;
    std::getline(std::ifstream(entry->path() / "serial"), of_device);
    if (const double bus = number_in(entry->path() / "busnum");
        bus > 0 && !serial.empty() && of_device == serial)
      return link_of_bus(sys, int(bus));
  }
  return {};
}

CameraLink network_link(const fs::path& sys, const std::string& address) {
  in_addr wanted{};
  ifaddrs* interfaces = nullptr;
  if (inet_pton(AF_INET, address.c_str(), &wanted) != 1 || getifaddrs(&interfaces) != 0) return {};
  CameraLink link;
  for (const ifaddrs* i = interfaces; i != nullptr && link.name.empty(); i = i->ifa_next) {
    if (i->ifa_addr == nullptr || i->ifa_netmask == nullptr || i->ifa_addr->sa_family != AF_INET)
      continue;
    const in_addr_t own = reinterpret_cast<const sockaddr_in*>(i->ifa_addr)->sin_addr.s_addr,
                    mask = reinterpret_cast<const sockaddr_in*>(i->ifa_netmask)->sin_addr.s_addr;
    if ((own & mask) != (wanted.s_addr & mask)) continue;
    // An alias such as eth0:1 is the same interface.
    const std::string name = std::string(i->ifa_name).substr(0, std::string(i->ifa_name).find(':'));
    link = {"network interface " + name, number_in(sys / "class/net" / name / "speed"),
            kUsableOfEthernet};
  }
  freeifaddrs(interfaces);
  return link;
}

}  // namespace fivepipe::capture
