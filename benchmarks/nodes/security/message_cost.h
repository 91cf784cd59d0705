// The cost of a message between two processes, without security, signed and encrypted.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace fivepipe::security_bench {

struct Cost {
  std::vector<double> latency_ms;  // from the call of write() until the reader has the message
  double sender_cpu_s = 0, receiver_cpu_s = 0;  // of both processes while they exchange messages
  int sent = 0;
};

// keys: folder of make_keys() for the domain; empty: without security. Starts both processes.
// Throws std::runtime_error if one of them fails.
Cost measure(std::uint32_t domain, const std::filesystem::path& keys, std::size_t size_bytes,
             int messages);

// The two processes, which measure() starts from this program: "send" and "receive". Returns the
// exit code.
int run_process(const std::vector<std::string>& words);

}  // namespace fivepipe::security_bench
