#include "common/pipeline/bus/profile.h"

#include <cstdlib>
#include <fstream>
#include <sstream>

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

}  // namespace

std::vector<std::string> profile_names() {
  std::vector<std::string> names;
  for (const auto& [name, xml] : kShippedProfiles) names.push_back(name);
  return names;
}

std::string profile_xml(const std::string& name) {
  if (const char* uri = std::getenv("CYCLONEDDS_URI"); uri && *uri) {
    const std::string text = uri;
    return text.starts_with("file://") ? file_text(text.substr(7)) : text;
  }
  std::string known;
  for (const auto& [shipped, xml] : kShippedProfiles) {
    if (shipped == name) return xml;
    known += (known.empty() ? "" : ", ") + std::string(shipped);
  }
  throw BusError("unknown network profile '" + name + "'; choose one of: " + known);
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

}  // namespace fivepipe::bus
