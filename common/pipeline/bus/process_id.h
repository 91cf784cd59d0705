// Identity of a process, and the deployment that it belongs to.
#pragma once
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace fivepipe::bus {

// Identities of two processes differ, unless one forges the other's, whatever their hosts, and also
// if the kernel reuses a pid. A publication handle is no identity: DDS gives a process new handles
// after a silence longer than the lease.
struct ProcessId {
  std::string host;            // as gethostname() returns it
  std::uint32_t pid = 0;       // in the PID namespace of the process
  std::uint64_t start_id = 0;  // random for each start of a program

  friend auto operator<=>(const ProcessId&, const ProcessId&) = default;  // NOLINT
};

ProcessId this_process();

// "fivepipe/1 pid=4711 start=0123456789abcdef host=alpha deployment=lab", which a process
// states in the user data of its DDS participant, of its readers and of its writers. deployment:
// its name; empty: none.
std::string to_user_data(const ProcessId& process, const std::string& deployment = "");
// Parses the text of to_user_data(). Returns nullopt for any other text: the participant is of
// another program.
std::optional<ProcessId> from_user_data(std::string_view user_data);
// Returns the deployment in the text of to_user_data(); empty if it names none, and for any other
// text.
std::string deployment_from_user_data(std::string_view user_data);

// "process 4711 on host alpha", or "a process without identity".
inline std::string text_of(const std::optional<ProcessId>& process) {
  if (!process) return "a process without identity";
  return "process " + std::to_string(process->pid) + " on host " + process->host;
}

}  // namespace fivepipe::bus
