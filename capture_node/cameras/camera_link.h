// The links of cameras, from sysfs.
#pragma once
#include <filesystem>
#include <string>

#include "capture_node/cameras/connected_camera.h"

namespace fivepipe::capture {

// Returns the USB bus of a V4L2 device such as "video0". `sys` is /sys. Without a name if the
// device is on no USB bus.
CameraLink usb_link(const std::filesystem::path& sys, const std::string& video);

// Returns the USB bus of the device with this serial number, which a USB3 Vision camera states as
// its own. Without a name if there is none.
CameraLink usb_link_of_serial(const std::filesystem::path& sys, const std::string& serial);

// Returns the network interface whose subnet contains the IPv4 address. Without a name if there is
// none.
CameraLink network_link(const std::filesystem::path& sys, const std::string& address);

}  // namespace fivepipe::capture
