// What `fivepipe doctor` finds out.
#pragma once
#include <string>

namespace fivepipe::launch {

enum class Verdict { ok, warn, fail };
struct Finding {
  Verdict verdict;
  std::string what;
  std::string advice;  // what to do; empty if nothing
};

}  // namespace fivepipe::launch
