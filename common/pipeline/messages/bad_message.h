// A message that a node cannot use. The node drops it, counts it and logs why.
#pragma once
#include <compare>
#include <string>
#include <variant>

namespace fivepipe::messages {

// The fields of the IDL's DropCount.
struct BadMessage {
  std::string reason;   // one word, such as "bad_map"
  std::string subject;  // camera, topic, viewer or object; empty: none
  std::string detail;   // what is wrong, for people; may be empty
  auto operator<=>(const BadMessage&) const = default;  // NOLINT: clang-tidy 14 misreads it
};

// A validated message, or the reason why it is unusable.
template <class T>
using Received = std::variant<T, BadMessage>;

// Returns "reason: subject: detail" without the empty parts.
inline std::string text_of(const BadMessage& bad) {
  std::string text = bad.reason;
  for (const std::string* part : {&bad.subject, &bad.detail})
    if (!part->empty()) text += ": " + *part;
  return text;
}

}  // namespace fivepipe::messages
