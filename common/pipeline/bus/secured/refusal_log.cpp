#include "common/pipeline/bus/secured/refusal_log.h"

#include <dds/dds.h>
#include <dds/ddsrt/log.h>

#include <algorithm>
#include <cctype>
#include <iostream>
#include <mutex>
#include <utility>

namespace fivepipe::bus::detail {
namespace {

// The text without numbers and identifiers such as 998a2c1d:cc219f99:9eba539e:1c1.
std::string kind_of(const std::string& text) {
  std::string kind, word;
  const auto finish_word = [&] {
    if (std::none_of(word.begin(), word.end(), [](unsigned char c) { return std::isdigit(c); }))
      kind += word;
    word.clear();
  };
  for (const char c : text) {
    if (std::isspace(static_cast<unsigned char>(c))) {
      finish_word();
      kind += ' ';
    } else {
      word += c;
    }
  }
  finish_word();
  return kind;
}

const char* explanation_of(const std::string& text) {
  const auto has = [&](const char* part) { return text.find(part) != std::string::npos; };
  if (has("security_attributes mismatch"))
    return " (the keys of one process sign, those of the other encrypt: use the keys of one run of "
           "fivepipe keys on all machines)";
  if (has("Certificate not valid"))
    return " (a process with keys of another CA, or with expired ones, is refused)";
  if (has("not allowed") && has("Remote secure participant"))
    return " (a process that just starts joins at its next announcement, after at most 1 s)";
  return "";
}

void write_line(void*, const dds_log_data_t* data) {
  static std::mutex mutex;
  static RefusalLog log;
  std::string text(data->message, data->size);
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  const std::scoped_lock lock(mutex);
  if (const auto line = log.line_for(text, RefusalLog::Clock::now()))
    std::cerr << "DDS: " << *line << std::endl;
}

}  // namespace

std::optional<std::string> RefusalLog::line_for(const std::string& text, Clock::time_point now) {
  std::erase_if(logged_, [&](const auto& known) { return now - known.second >= kPeriod; });
  std::string kind = kind_of(text);
  if (logged_.contains(kind) || logged_.size() >= kMaxTexts) {
    ++suppressed_;
    return std::nullopt;
  }
  logged_.emplace(std::move(kind), now);
  const std::uint64_t suppressed = std::exchange(suppressed_, 0);
  return text + explanation_of(text) +
         (suppressed > 0 ? " (" + std::to_string(suppressed) + " messages before it are not shown)"
                         : "");
}

void limit_dds_log() { dds_set_log_sink(write_line, nullptr); }

}  // namespace fivepipe::bus::detail
