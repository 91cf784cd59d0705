// What the hosts of one deployment know of each other. Pure.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "launch/supervise/hosts/clock_comparison.h"

namespace fivepipe::launch {

// A program that speaks for a host.
struct HostSpeaker {
  std::string host;     // name in the deployment
  std::string program;  // "up" or "doctor"
  friend auto operator<=>(const HostSpeaker&, const HostSpeaker&) = default;  // NOLINT
};

using Checksums = std::map<std::string, std::uint64_t>;  // by name of the file

struct HostState {
  HostSpeaker speaker;
  std::string machine, version;
  Checksums files;
  std::map<HostSpeaker, ClockOffset> clocks;  // of others, as this host measures them
};

// Returns the FNV-1a hash of the bytes, 64 bits. before: the hash of the bytes before them.
inline constexpr std::uint64_t kNoBytes = 0xcbf29ce484222325;
std::uint64_t checksum_of(std::string_view bytes, std::uint64_t before = kNoBytes);

// Returns a text for each thing that should be the same on both hosts and is not: the version of
// fivepipe, and the files of the deployment.
std::vector<std::string> differences(const HostState& own, const HostState& other);

// A host whose `up` has published a HostStatus.
struct HeardHost {
  HostState state;
  double silent_s = 0;  // [s] since its last one arrived
};
// `up` publishes a HostStatus once per second. A host that is silent for longer has ended or is out
// of reach.
inline constexpr double kMaxHostSilence_s = 5;

// The table of `fivepipe top`, with a row per host; empty if there is no host. The clocks are
// compared with that of the first host, by name, that measures them and is not silent. deployed:
// the hosts of the deployment file, if there is one; those that published no HostStatus are
// missing.
std::string hosts_table(const std::vector<HeardHost>& heard,
                        const std::set<std::string>& deployed = {});

}  // namespace fivepipe::launch
