// The `fivepipe up` of other deployments in the same DDS domain: their frames would mix. Pure.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fivepipe::launch {

// What `fivepipe up` states in the name of its DDS participant.
struct RunIdentity {
  std::string deployment;  // its name
  std::string host;        // name of this machine in the deployment; empty: it names none
  std::string machine;     // as gethostname() returns it
  std::uint64_t pid = 0;
  std::int64_t start_stamp_ns = 0;  // CLOCK_REALTIME of that machine
  bool operator==(const RunIdentity&) const = default;
};

// "fivepipe-up/1 pid=4711 start=1795822144000000000 machine=a.lab host=alpha deployment=lab one".
// Spaces of the machine and the host become underscores.
std::string participant_name(const RunIdentity& run);
// Parses the text of participant_name(). Returns nullopt for any other text.
std::optional<RunIdentity> run_of_participant(std::string_view name);

// Returns whether the two cannot share a domain: they run different deployments, or the same host
// of one deployment.
bool are_in_conflict(const RunIdentity& a, const RunIdentity& b);
// Returns whether `own`, which has just started, has to end because of the other: the other started
// earlier, or its clock is ahead, so that it may have. now_ns: of this machine. Of two runs that
// start at the same time, at least one ends.
bool gives_way(const RunIdentity& own, const RunIdentity& other, std::int64_t now_ns);

// "deployment demo, process 4711 on machine beta".
std::string text_of(const RunIdentity& run);

// Returns the runs among the participants of a domain that are in conflict with this one, without
// repetition.
std::vector<RunIdentity> conflicts_of(const RunIdentity& own,
                                      const std::vector<std::string>& participants);

}  // namespace fivepipe::launch
