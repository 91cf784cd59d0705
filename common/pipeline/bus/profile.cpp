#include "common/pipeline/bus/profile.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string_view>

#include "common/base/network/network_interfaces.h"
#include "common/base/readable_file.h"
#include "common/base/regex.h"
#include "common/pipeline/bus/bus.h"
#include "common/pipeline/bus/shipped_profiles.h"

namespace fivepipe::bus {
namespace {

std::string file_text(const std::string& path) {
  if (const auto why = base::why_unreadable(path))
    throw BusError(path + ", which CYCLONEDDS_URI names: " + *why);
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

// Texts in the profiles that reach other machines.
constexpr std::string_view kInterface = "<Interfaces>${interface}</Interfaces>",
                           kPeers = "<Peers>${peers}</Peers>";

// The XML of a shipped profile; nullptr: there is none.
const char* shipped(const std::string& name) {
  for (const auto& [known, xml] : kShippedProfiles)
    if (known == name) return xml;
  return nullptr;
}

// The element <NetworkInterface> of this machine's interface with this name or address.
std::string interface_xml(const std::string& wanted) {
  const base::FoundInterface found = base::find_interface(wanted);
  if (found.name.empty()) throw BusError(found.problem);
  // An interface may have several addresses.
  const char* const key = found.name == wanted ? "name" : "address";
  return std::string("<NetworkInterface ") + key + "=\"" + wanted + "\"/>";
}

// Replaces the content of an element that occurs once.
std::string replaced(std::string xml, std::string_view element, const std::string& content) {
  const std::string_view::size_type begin = element.find('$'), end = element.find("</");
  const std::size_t at = xml.find(element);
  return xml.replace(at + begin, end - begin, content);
}

}  // namespace

std::vector<std::string> profile_names() {
  std::vector<std::string> names;
  for (const auto& [name, xml] : kShippedProfiles) names.push_back(name);
  return names;
}

bool reaches_other_machines(const std::string& profile) {
  const char* xml = shipped(profile);
  return xml && std::string_view(xml).find(kInterface) != std::string_view::npos;
}

std::string profile_xml(const Network& network) {
  if (const char* uri = std::getenv("CYCLONEDDS_URI"); uri && *uri) {
    const std::string text = uri;
    return text.starts_with("file://") ? file_text(text.substr(7)) : text;
  }
  const char* xml = shipped(network.profile);
  if (!xml) {
    std::string known;
    for (const std::string& name : profile_names()) known += (known.empty() ? "" : ", ") + name;
    throw BusError("unknown network profile '" + network.profile + "'; choose one of: " + known);
  }
  if (!reaches_other_machines(network.profile)) return xml;
  if (network.interface.empty() || network.peers.empty())
    throw BusError("network profile '" + network.profile +
                   "' needs the machines of a deployment: name a deployment file with `hosts`");
  std::string peers;
  for (const std::string& peer : network.peers) peers += "<Peer Address=\"" + peer + "\"/>";
  return replaced(replaced(xml, kInterface, interface_xml(network.interface)), kPeers, peers);
}

FittedProfile fitted_to_kernel(const std::string& xml, std::size_t rmem_max_bytes) {
  static const base::Regex minimum("(SocketReceiveBufferSize[^>]*min=\")([0-9.]+) *([kM]i?B|B)?\"");
  const auto match = minimum.search(xml);
  if (rmem_max_bytes == 0 || !match) return {xml, ""};
  const std::string& unit = match->groups[3];
  const double scale = unit.starts_with("M") ? 1 << 20 : unit.starts_with("k") ? 1 << 10 : 1;
  const double wanted_bytes = std::stod(match->groups[2]) * scale;
  if (wanted_bytes <= double(rmem_max_bytes)) return {xml, ""};
  const std::string wanted = std::to_string(std::size_t(wanted_bytes));
  return {
      match->before + match->groups[1] + std::to_string(rmem_max_bytes) + "B\"" + match->after,
      "the kernel grants receive buffers of " + std::to_string(rmem_max_bytes) +
          " bytes, but the network profile requests " + wanted +
          "; large samples may be lost. Raise the limit: sysctl -w net.core.rmem_max=" + wanted};
}

std::size_t kernel_rmem_max_bytes() {
  std::ifstream file("/proc/sys/net/core/rmem_max");
  std::size_t bytes = 0;
  return file >> bytes ? bytes : 0;
}

bool resolves_addresses_quickly() {
  constexpr int kQuick_ms = 200;
  bool has_interface = false;
  std::error_code ignored;
  for (const auto& entry :
       std::filesystem::directory_iterator("/proc/sys/net/ipv4/neigh", ignored)) {
    const std::string interface = entry.path().filename();
    if (interface == "lo" || interface == "default") continue;
    int retransmission_ms = 1000;  // the kernel's default
    std::ifstream(entry.path() / "retrans_time_ms") >> retransmission_ms;
    if (retransmission_ms > kQuick_ms) return false;
    has_interface = true;
  }
  return has_interface;
}

}  // namespace fivepipe::bus
