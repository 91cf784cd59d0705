#include "launch/supervise/hosts/host_exchange.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <utility>

#include "common/base/machine.h"
#include "common/base/realtime.h"
#include "common/base/version.h"
#include "common/pipeline/messages/wire_conversions.h"

namespace fivepipe::launch {
namespace {

// At kStartPeriod, an answer to the oldest of them takes 13 s.
constexpr std::size_t kRemembered = 64;
// error_ns of a clock that is not compared yet.
constexpr std::int64_t kUnknown = -1;

fivepipe_v1_ClockAnswer answer_to(const HostSpeaker& speaker, std::int64_t sent_ns,
                                  std::int64_t received_ns,
                                  const std::optional<ClockOffset>& offset) {
  fivepipe_v1_ClockAnswer answer{};
  messages::set_truncated(answer.host, speaker.host);
  messages::set_truncated(answer.program, speaker.program);
  answer.sent_ns = sent_ns;
  answer.received_ns = received_ns;
  answer.offset_ns = offset ? offset->offset_ns : 0;
  answer.error_ns = offset ? offset->error_ns : kUnknown;
  return answer;
}

// Reads in blocks, because meshes may be large. Returns nullopt if it cannot.
std::optional<std::uint64_t> checksum_of_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string block(1 << 20, '\0');
  std::uint64_t checksum = checksum_of("");
  while (stream.read(block.data(), std::streamsize(block.size())) || stream.gcount() > 0)
    checksum =
        checksum_of(std::string_view(block).substr(0, std::size_t(stream.gcount())), checksum);
  return stream.eof() ? std::optional(checksum) : std::nullopt;
}

}  // namespace

Checksums checksums_of(const config::Deployment& deployment) {
  namespace fs = std::filesystem;
  const auto plain = [](const fs::path& file) { return fs::absolute(file).lexically_normal(); };
  const fs::path folder = plain(deployment.file).parent_path();
  Checksums checksums;
  for (const fs::path& file : deployment.files) {
    if (checksums.size() == kMaxListed) break;
    const std::optional<std::uint64_t> checksum = checksum_of_file(file);
    if (!checksum) continue;
    std::string name = plain(file).lexically_proximate(folder).string();
    constexpr std::size_t kMaxName = sizeof(fivepipe_v1_FileChecksum::name) - 1;
    if (name.size() > kMaxName) name.erase(0, name.size() - kMaxName);
    checksums[name] = *checksum;
  }
  return checksums;
}

HostState state_from(const fivepipe_v1_HostStatus& message) {
  HostState state{{message.host, message.program}, message.machine, message.version, {}, {}};
  const auto first = [](const auto& list) {
    return messages::span_of(list).first(std::min<std::size_t>(list._length, kMaxListed));
  };
  for (const fivepipe_v1_FileChecksum& file : first(message.files))
    state.files[file.name] = file.checksum;
  for (const fivepipe_v1_ClockAnswer& answer : first(message.clocks))
    if (answer.error_ns >= 0)
      state.clocks[{answer.host, answer.program}] = {answer.offset_ns, answer.error_ns};
  return state;
}

HostExchange::HostExchange(bus::Bus& bus, const config::Deployment& deployment,
                           const HostSpeaker& own)
    : own_{own,
           base::host_name(),
           std::string(base::version()) + " (" + base::commit() + ")",
           checksums_of(deployment),
           {}},
      hosts_(deployment.hosts),
      in_(bus.reader<bus::topics::HostStatus>()),
      out_(bus.writer<bus::topics::HostStatus>()) {}

void HostExchange::step() {
  take();
  const Clock::time_point now = Clock::now();
  if (now < next_) return;
  next_ = now + (is_starting() ? kStartPeriod : kPeriod);
  send();
}

bool HostExchange::is_possible(const HostSpeaker& speaker) const {
  return std::ranges::count(hosts_, speaker.host, &config::Host::name) > 0 &&
         (speaker.program == "up" || speaker.program == "doctor");
}

void HostExchange::take() {
  for (const auto& sample : in_.take()) {
    if (!sample.valid()) continue;
    // No clock of a host, and no frame in this message.
    if (messages::why_implausible(0, sample->sent_ns)) {
      if (!std::exchange(is_bad_stamp_reported_, true))
        spdlog::warn("ignoring the HostStatus of {}: its timestamp is before 1970 or after 2200",
                     bus::text_of(in_.process(sample)));
      continue;
    }
    HostState state = state_from(*sample);
    if (state.speaker == own_.speaker || !is_possible(state.speaker)) continue;
    Other& other = others_[state.speaker];
    other.state = std::move(state);
    other.heard = Clock::now();
    other.sent_ns = sample->sent_ns;
    other.received_ns = sample.arrived_ns();
    for (const fivepipe_v1_ClockAnswer& answer : messages::span_of(sample->clocks))
      if (own_.speaker == HostSpeaker{answer.host, answer.program} &&
          std::find(sent_ns_.begin(), sent_ns_.end(), answer.sent_ns) != sent_ns_.end())
        other.clock.add({answer.sent_ns, answer.received_ns, sample->sent_ns, sample.arrived_ns()});
  }
}

void HostExchange::send() {
  std::erase_if(others_,
                [](const auto& other) { return Clock::now() - other.second.heard > kMaxSilence; });
  const std::int64_t now_ns = base::now_realtime_ns();
  std::vector<fivepipe_v1_FileChecksum> files;
  for (const auto& [name, checksum] : own_.files) {
    messages::set_truncated(files.emplace_back().name, name);
    files.back().checksum = checksum;
  }
  own_.clocks.clear();
  std::vector<fivepipe_v1_ClockAnswer> clocks;
  for (const auto& [speaker, other] : others_) {
    const std::optional<ClockOffset> offset = other.clock.offset(now_ns);
    if (offset) own_.clocks[speaker] = *offset;
    clocks.push_back(answer_to(speaker, other.sent_ns, other.received_ns, offset));
  }
  fivepipe_v1_HostStatus message{};
  messages::set_truncated(message.host, own_.speaker.host);
  messages::set_truncated(message.program, own_.speaker.program);
  messages::set_truncated(message.machine, own_.machine);
  messages::set_truncated(message.version, own_.version);
  messages::borrow(message.files, files);
  messages::borrow(message.clocks, clocks);
  message.sent_ns = base::now_realtime_ns();
  sent_ns_.push_back(message.sent_ns);
  if (sent_ns_.size() > kRemembered) sent_ns_.pop_front();
  out_.write(message);
}

std::vector<ComparedHost> HostExchange::others() const {
  const std::int64_t now_ns = base::now_realtime_ns();
  std::vector<ComparedHost> compared;
  for (const auto& [speaker, other] : others_)
    compared.push_back({other.state, other.clock.offset(now_ns)});
  return compared;
}

std::unique_ptr<HostExchange> exchange_of_up(bus::Bus& bus, const config::Deployment& deployment,
                                             const std::string& host, bool local) {
  if (local || deployment.hosts.size() < 2) return nullptr;
  return std::make_unique<HostExchange>(bus, deployment, HostSpeaker{host, "up"});
}

}  // namespace fivepipe::launch
