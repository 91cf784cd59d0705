#include "common/pipeline/bus/process_id.h"

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <random>

#include "common/base/machine.h"

namespace fivepipe::bus {
namespace {

constexpr std::string_view kPrefix = "fivepipe/1 pid=", kStart = " start=", kHost = " host=",
                           kDeployment = " deployment=";
constexpr std::size_t kStartDigits = 16;
constexpr std::size_t kMaxHostBytes = 64;  // HOST_NAME_MAX of Linux
constexpr std::size_t kMaxDeploymentBytes = 256;

std::uint64_t random_bits() {
  std::random_device device;
  return std::uint64_t(device()) << 32 | device();
}

// Splits `text` at the first `separator`. Leaves the rest in `text`.
std::optional<std::string_view> cut_before(std::string_view& text, std::string_view separator) {
  const std::size_t at = text.find(separator);
  if (at == std::string_view::npos) return std::nullopt;
  const std::string_view head = text.substr(0, at);
  text.remove_prefix(at + separator.size());
  return head;
}

template <class Number>
bool parse(std::string_view digits, int base, Number& number) {
  const char* end = digits.data() + digits.size();
  const auto [rest, error] = std::from_chars(digits.data(), end, number, base);
  return error == std::errc() && rest == end;
}

bool is_printable(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

// The name is printed on terminals, so it must not contain control characters.
bool is_host_name(std::string_view host) {
  return !host.empty() && host.size() <= kMaxHostBytes &&
         std::all_of(host.begin(), host.end(), [](char c) { return c > ' ' && c <= '~'; });
}

}  // namespace

ProcessId this_process() {
  static const std::uint64_t start_id = random_bits();
  return {base::host_name(), std::uint32_t(getpid()), start_id};
}

std::string to_user_data(const ProcessId& process, const std::string& deployment) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string start;
  for (int shift = 4 * (int(kStartDigits) - 1); shift >= 0; shift -= 4)
    start += kDigits[process.start_id >> shift & 15];
  return std::string(kPrefix) + std::to_string(process.pid) + std::string(kStart) + start +
         std::string(kHost) + process.host +
         (deployment.empty() ? "" : std::string(kDeployment) + deployment);
}

std::optional<ProcessId> from_user_data(std::string_view user_data) {
  if (!user_data.starts_with(kPrefix)) return std::nullopt;
  user_data.remove_prefix(kPrefix.size());
  const auto pid = cut_before(user_data, kStart), start = cut_before(user_data, kHost);
  ProcessId process{std::string(user_data.substr(0, user_data.find(kDeployment))), 0, 0};
  if (!pid || !start || start->size() != kStartDigits || !parse(*pid, 10, process.pid) ||
      !parse(*start, 16, process.start_id) || !is_host_name(process.host))
    return std::nullopt;
  return process;
}

std::string deployment_from_user_data(std::string_view user_data) {
  const std::size_t at = user_data.find(kDeployment);
  if (at == std::string_view::npos || !from_user_data(user_data)) return "";
  const std::string_view name = user_data.substr(at + kDeployment.size(), kMaxDeploymentBytes);
  return is_printable(name) ? std::string(name) : "";
}

}  // namespace fivepipe::bus
