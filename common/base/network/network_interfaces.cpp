#include "common/base/network/network_interfaces.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

#include <algorithm>
#include <cerrno>
#include <memory>
#include <system_error>

namespace fivepipe::base {

std::vector<NetworkInterface> network_interfaces() {
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0)
    throw std::system_error(errno, std::generic_category(), "cannot read the network interfaces");
  const std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> owner(list, freeifaddrs);
  std::vector<NetworkInterface> interfaces;
  for (const ifaddrs* entry = list; entry; entry = entry->ifa_next) {
    const std::string name = entry->ifa_name;
    auto found = std::find_if(interfaces.begin(), interfaces.end(),
                              [&](const NetworkInterface& known) { return known.name == name; });
    if (found == interfaces.end())
      found = interfaces.insert(interfaces.end(), {name, {}, (entry->ifa_flags & IFF_UP) != 0});
    if (!entry->ifa_addr || entry->ifa_addr->sa_family != AF_INET) continue;
    char text[INET_ADDRSTRLEN];
    const auto* const address = reinterpret_cast<const sockaddr_in*>(entry->ifa_addr);
    if (inet_ntop(AF_INET, &address->sin_addr, text, sizeof text))
      found->addresses.emplace_back(text);
  }
  return interfaces;
}

std::string text_of(const std::vector<NetworkInterface>& interfaces) {
  std::string text;
  for (const NetworkInterface& one : interfaces) {
    text += (text.empty() ? "" : ", ") + one.name + " (";
    for (std::size_t i = 0; i < one.addresses.size(); ++i)
      text += (i == 0 ? "" : ", ") + one.addresses[i];
    if (one.addresses.empty()) text += "no address";
    text += one.is_up ? ")" : "; down)";
  }
  return text;
}

FoundInterface find_interface(const std::string& name_or_address) {
  const std::vector<NetworkInterface> interfaces = network_interfaces();
  for (const NetworkInterface& one : interfaces) {
    if (one.name != name_or_address && std::ranges::count(one.addresses, name_or_address) == 0)
      continue;
    if (one.is_up) return {one.name, ""};
    return {"", "the network interface " + one.name + " is down; enable it: ip link set " +
                    one.name + " up"};
  }
  return {"", "this machine has no network interface '" + name_or_address + "'; it has " +
                  text_of(interfaces)};
}

}  // namespace fivepipe::base
