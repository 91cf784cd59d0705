#include "common/base/network/network_interfaces.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
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
      found = interfaces.insert(
          interfaces.end(),
          {name, {}, (entry->ifa_flags & IFF_UP) != 0, (entry->ifa_flags & IFF_LOOPBACK) != 0});
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
  in_addr address{};
  const bool is_address = inet_pton(AF_INET, name_or_address.c_str(), &address) == 1;
  return {"", std::string("this machine has no network interface ") +
                  (is_address ? "with address " + name_or_address : "'" + name_or_address + "'") +
                  "; it has " + text_of(interfaces)};
}

std::string route_interface(const std::string& address) {
  struct {
    nlmsghdr header{};
    rtmsg route{};
    rtattr attribute{};
    in_addr to{};
  } request;
  static_assert(sizeof request == NLMSG_LENGTH(sizeof(rtmsg)) + RTA_LENGTH(sizeof(in_addr)));
  request.header.nlmsg_len = sizeof request;
  request.header.nlmsg_type = RTM_GETROUTE;
  request.header.nlmsg_flags = NLM_F_REQUEST;
  request.route.rtm_family = AF_INET;
  request.route.rtm_dst_len = 32;  // bits: one machine
  request.attribute.rta_type = RTA_DST;
  request.attribute.rta_len = RTA_LENGTH(sizeof(in_addr));
  if (inet_pton(AF_INET, address.c_str(), &request.to) != 1) return "";
  const int kernel = socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
  if (kernel < 0) return "";
  alignas(nlmsghdr) std::array<char, 4096> bytes{};
  const bool is_sent = send(kernel, &request, sizeof request, 0) == ssize_t(sizeof request);
  const ssize_t size = is_sent ? recv(kernel, bytes.data(), bytes.size(), 0) : -1;
  close(kernel);
  const auto* const answer = reinterpret_cast<const nlmsghdr*>(bytes.data());
  if (size < ssize_t(NLMSG_LENGTH(sizeof(rtmsg))) || answer->nlmsg_type != RTM_NEWROUTE ||
      ssize_t(answer->nlmsg_len) > size)
    return "";
  // From here on as RTM_RTA() and RTA_NEXT(), without their casts.
  std::size_t at = NLMSG_LENGTH(sizeof(rtmsg));
  while (at + sizeof(rtattr) <= answer->nlmsg_len) {
    rtattr attribute{};
    std::memcpy(&attribute, bytes.data() + at, sizeof attribute);
    if (attribute.rta_len < sizeof attribute || at + attribute.rta_len > answer->nlmsg_len) break;
    unsigned index = 0;
    if (attribute.rta_type == RTA_OIF && attribute.rta_len == RTA_LENGTH(sizeof index)) {
      std::memcpy(&index, bytes.data() + at + RTA_LENGTH(0), sizeof index);
      std::array<char, IF_NAMESIZE> name{};
      return if_indextoname(index, name.data()) ? name.data() : "";
    }
    at += RTA_ALIGN(attribute.rta_len);
  }
  return "";
}

}  // namespace fivepipe::base
