// What the process logs during a test.
#pragma once
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <sstream>
#include <string>

namespace fivepipe::test {

// Replaces the default logger; the destructor restores it.
class CapturedLog {
 public:
  CapturedLog() {
    spdlog::set_default_logger(std::make_shared<spdlog::logger>(
        "captured", std::make_shared<spdlog::sinks::ostream_sink_mt>(text_)));
  }
  ~CapturedLog() { spdlog::set_default_logger(before_); }
  CapturedLog(const CapturedLog&) = delete;
  CapturedLog& operator=(const CapturedLog&) = delete;
  // Call it when no thread logs.
  std::string text() const { return text_.str(); }

 private:
  mutable std::ostringstream text_;  // the logger writes to it
  std::shared_ptr<spdlog::logger> before_ = spdlog::default_logger();
};

}  // namespace fivepipe::test
