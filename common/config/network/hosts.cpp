#include "common/config/network/hosts.h"

#include <arpa/inet.h>

#include <algorithm>
#include <cctype>

#include "common/base/machine.h"
#include "common/base/network/network_interfaces.h"
#include "common/config/yaml/config_error.h"

namespace fivepipe::config {
namespace {

// Of one machine: not 0.0.0.0, and neither multicast nor broadcast.
bool is_ipv4(const std::string& text) {
  in_addr address{};
  if (inet_pton(AF_INET, text.c_str(), &address) != 1) return false;
  const std::uint32_t bits = ntohl(address.s_addr);
  constexpr std::uint32_t kMulticast = 0xe0000000;
  return bits != 0 && bits < kMulticast;
}

// The names of Linux's interfaces have at most 15 characters; these are safe in XML.
bool is_interface(const std::string& text) {
  constexpr std::size_t kMaxLength = 15;
  return text.size() <= kMaxLength && std::all_of(text.begin(), text.end(), [](unsigned char c) {
           return std::isalnum(c) || c == '_' || c == '-' || c == '.' || c == ':' || c == '@';
         });
}

}  // namespace

std::vector<Host> read_hosts(YamlMap& map) {
  std::vector<Host> hosts;
  if (!map.has("hosts")) return hosts;
  YamlMap by_name = map.map("hosts");
  for (const std::string& name : by_name.keys()) {
    YamlMap keys = by_name.map(name);
    Host host{name, keys.text("address"), keys.text("interface", "")};
    if (!host.address.empty() && !is_ipv4(host.address))
      keys.problem_at("address",
                      "address must be an IPv4 address such as 192.168.10.11, is " + host.address);
    if (!is_interface(host.interface))
      keys.problem_at("interface",
                      "interface must be a name such as enp3s0 (`ip address` lists "
                      "those of a machine), is " +
                          host.interface);
    for (const Host& other : hosts)
      if (!host.address.empty() && other.address == host.address)
        keys.problem_at("address", "hosts " + other.name + " and " + name +
                                       " have the same address " + host.address);
    keys.finish();
    hosts.push_back(std::move(host));
  }
  return hosts;
}

const Host& own_host(const std::vector<Host>& hosts, const std::string& name,
                     const std::filesystem::path& file) {
  const std::vector<base::NetworkInterface> interfaces = base::network_interfaces();
  const auto is_here = [&](const Host& host) {
    return std::any_of(interfaces.begin(), interfaces.end(), [&](const auto& one) {
      return std::ranges::count(one.addresses, host.address) > 0;
    });
  };
  const auto named = [&](const std::string& wanted) {
    return std::find_if(hosts.begin(), hosts.end(),
                        [&](const Host& host) { return host.name == wanted; });
  };
  auto found = named(name.empty() ? base::host_name() : name);
  if (found == hosts.end() && name.empty())
    found = std::find_if(hosts.begin(), hosts.end(), is_here);
  if (found != hosts.end()) return *found;
  std::string known;
  for (const Host& host : hosts)
    known += (known.empty() ? "" : ", ") + host.name + " (" + host.address + ")";
  throw ConfigError(
      {{file, 0, 0,
        (name.empty() ? "this machine, " + base::host_name() + " with the interfaces " +
                            base::text_of(interfaces) + ", is none of the deployment's hosts"
                      : "the deployment has no host " + name) +
            "; choose one of them with --host: " + known +
            (name.empty() ? "; to observe from this machine, add it to `hosts`, without nodes"
                          : "")}});
}

}  // namespace fivepipe::config
