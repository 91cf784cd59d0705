#include "launch/supervise/hosts/conflicts.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <tuple>

#include "common/base/text_table.h"

namespace fivepipe::launch {
namespace {

constexpr std::string_view kPrefix = "fivepipe-up/1 ";

std::string one_word(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c <= ' '; }, '_');
  return text;
}

// Takes "KEY=VALUE " from the front of the text. Returns nullopt if it does not begin so.
std::optional<std::string_view> take(std::string_view& text, std::string_view key) {
  if (!text.starts_with(key) || text.size() <= key.size() || text[key.size()] != '=')
    return std::nullopt;
  text.remove_prefix(key.size() + 1);
  const std::size_t end = text.find(' ');
  if (end == std::string_view::npos) return std::nullopt;
  const std::string_view value = text.substr(0, end);
  text.remove_prefix(end + 1);
  return value;
}

template <class Number>
bool parse(std::optional<std::string_view> text, Number& number) {
  if (!text) return false;
  const char* const end = text->data() + text->size();
  const auto [stop, error] = std::from_chars(text->data(), end, number);
  return error == std::errc() && stop == end;
}

}  // namespace

std::string participant_name(const RunIdentity& run) {
  return fmt::format("{}pid={} start={} machine={} host={} deployment={}", kPrefix, run.pid,
                     run.start_stamp_ns, one_word(run.machine), one_word(run.host), run.deployment);
}

std::optional<RunIdentity> run_of_participant(std::string_view name) {
  constexpr std::string_view kDeployment = "deployment=";
  RunIdentity run;
  if (!name.starts_with(kPrefix)) return std::nullopt;
  name.remove_prefix(kPrefix.size());
  if (!parse(take(name, "pid"), run.pid) || !parse(take(name, "start"), run.start_stamp_ns))
    return std::nullopt;
  const auto machine = take(name, "machine"), host = take(name, "host");
  if (!machine || !host || !name.starts_with(kDeployment)) return std::nullopt;
  run.machine = *machine;
  run.host = *host;
  run.deployment = name.substr(kDeployment.size());
  return run;
}

bool are_in_conflict(const RunIdentity& a, const RunIdentity& b) {
  return a.deployment != b.deployment || one_word(a.host) == one_word(b.host);
}

bool gives_way(const RunIdentity& own, const RunIdentity& other, std::int64_t now_ns) {
  const auto order = [](const RunIdentity& run) {
    return std::tuple(run.start_stamp_ns, one_word(run.machine), run.pid);
  };
  return order(own) > order(other) || other.start_stamp_ns > now_ns;
}

std::string text_of(const RunIdentity& run) {
  return fmt::format("deployment {}, process {} on machine {}", base::printable(run.deployment),
                     run.pid, base::printable(run.machine));
}

std::vector<RunIdentity> conflicts_of(const RunIdentity& own,
                                      const std::vector<std::string>& participants) {
  std::vector<RunIdentity> conflicts;
  for (const std::string& name : participants) {
    const auto run = run_of_participant(name);
    const bool is_own = run && participant_name(*run) == participant_name(own);
    if (run && !is_own && are_in_conflict(own, *run) &&
        std::find(conflicts.begin(), conflicts.end(), *run) == conflicts.end())
      conflicts.push_back(*run);
  }
  return conflicts;
}

}  // namespace fivepipe::launch
