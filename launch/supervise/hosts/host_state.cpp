#include "launch/supervise/hosts/host_state.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/text_table.h"

namespace fivepipe::launch {
namespace {

std::string on(const HostState& state) {
  return fmt::format("host {} (machine {})", state.speaker.host, state.machine);
}

std::string text_of(const Checksums& files, const std::string& name) {
  const auto found = files.find(name);
  return found == files.end() ? "not read" : fmt::format("checksum {:016x}", found->second);
}

}  // namespace

std::uint64_t checksum_of(std::string_view bytes, std::uint64_t before) {
  std::uint64_t hash = before;
  for (const char byte : bytes) {
    hash ^= static_cast<unsigned char>(byte);
    hash *= 0x100000001b3;
  }
  return hash;
}

std::vector<std::string> differences(const HostState& own, const HostState& other) {
  std::vector<std::string> texts;
  if (own.version != other.version)
    texts.push_back(
        fmt::format("{} runs fivepipe {}, but {} runs fivepipe {}: install the same version on "
                    "both",
                    on(other), other.version, on(own), own.version));
  Checksums names = own.files;
  names.insert(other.files.begin(), other.files.end());
  for (const auto& [name, checksum] : names) {
    const std::string theirs = text_of(other.files, name), ours = text_of(own.files, name);
    if (theirs != ours)
      texts.push_back(fmt::format("{} is not the same on {} ({}) and {} ({}): copy it", name,
                                  on(other), theirs, on(own), ours));
  }
  return texts;
}

std::string hosts_table(const std::vector<HeardHost>& heard,
                        const std::set<std::string>& deployed) {
  if (heard.empty() && deployed.empty()) return "";
  const HostState* compares = nullptr;
  for (const auto& [state, silent_s] : heard)
    if (silent_s <= kMaxHostSilence_s && !state.clocks.empty() &&
        (!compares || state.speaker < compares->speaker))
      compares = &state;
  base::TextTable table({{.head = "host"},
                         {.head = "state", .min_width = 12},
                         {.head = "machine"},
                         {.head = "version"},
                         {.head = "clock"},
                         {.head = "files"}});
  for (const auto& [state, silent_s] : heard) {
    const bool is_silent = silent_s > kMaxHostSilence_s;
    std::string clock = "not compared";
    if (&state == compares) {
      clock = "reference";
    } else if (compares && !is_silent) {
      const auto found = compares->clocks.find(state.speaker);
      if (found != compares->clocks.end()) clock = launch::text_of(found->second);
    }
    table.add({base::printable(state.speaker.host),
               is_silent ? fmt::format("silent {:.0f} s", silent_s) : "running",
               base::printable(state.machine), base::printable(state.version), clock,
               differences(heard.front().state, state).empty() ? "the same" : "differ"});
  }
  for (const std::string& host : deployed)
    if (std::ranges::none_of(
            heard, [&](const HeardHost& other) { return other.state.speaker.host == host; }))
      table.add({host, "missing", "-", "-", "-", "-"});
  return table.text();
}

}  // namespace fivepipe::launch
