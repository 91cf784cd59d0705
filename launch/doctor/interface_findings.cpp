#include "launch/doctor/interface_findings.h"

#include <fmt/format.h>

#include <algorithm>

namespace fivepipe::launch {

std::vector<Finding> interface_findings(const config::Host& own,
                                        const std::vector<config::Host>& hosts,
                                        const std::string& used,
                                        const std::vector<base::NetworkInterface>& interfaces,
                                        const RouteOf& route) {
  const auto has_address = [&](const base::NetworkInterface& one) {
    return std::ranges::count(one.addresses, own.address) > 0;
  };
  std::vector<Finding> findings;
  const auto found = std::ranges::find(interfaces, used, &base::NetworkInterface::name);
  if (found == interfaces.end() || !has_address(*found)) {
    const auto owner = std::ranges::find_if(interfaces, has_address);
    findings.push_back(
        {Verdict::warn,
         fmt::format("interface of host {}: {} lacks its address {}{}", own.name, used, own.address,
                     owner == interfaces.end() ? ", which this machine has not"
                                               : ", which " + owner->name + " has"),
         "the others send to this address: correct `address` or `interface` of the host, or leave "
         "out `interface`"});
  }
  for (const config::Host& host : hosts) {
    if (host.name == own.name) continue;
    if (const std::string leaves_by = route(host.address); !leaves_by.empty() && leaves_by != used)
      findings.push_back(
          {Verdict::warn,
           fmt::format("interface of host {}: {}, but packets to host {} ({}) leave by {}",
                       own.name, used, host.name, host.address, leaves_by),
           fmt::format("name the interface of the machines' network, or correct the route: ip "
                       "route get {}",
                       host.address)});
  }
  if (findings.empty())
    findings.push_back({Verdict::ok,
                        fmt::format("interface of host {}: {} ({})", own.name, used, own.address),
                        ""});
  return findings;
}

}  // namespace fivepipe::launch
