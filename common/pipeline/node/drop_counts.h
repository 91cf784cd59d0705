// Counts of dropped messages, bounded although messages state their subjects and details.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "common/pipeline/messages/bad_message.h"

namespace fivepipe::node {

// A name that a message states, such as a camera's, is in the subject and the detail of a drop. The
// reasons come from the code.
class DropCounts {
 public:
  // At most this many subjects and details are kept for a reason. Further ones count under the
  // subject kOther.
  static constexpr std::size_t kMaxPerReason = 24;
  static constexpr const char* kOther = "other";

  // Adds n. Returns the entry, which names the drop or the others of its reason, with its count.
  const std::pair<const messages::BadMessage, std::uint64_t>& add(const messages::BadMessage& bad,
                                                                  std::uint64_t n);
  const std::map<messages::BadMessage, std::uint64_t>& counts() const { return counts_; }

 private:
  std::map<messages::BadMessage, std::uint64_t> counts_;
  std::map<std::string, std::size_t> kept_of_reason_;
};

// Counts by name, bounded. For names that other processes state.
class NamedCounts {
 public:
  // `capacity`: the number of names; further ones count under `other`.
  NamedCounts(std::size_t capacity, std::string other)
      : capacity_(capacity), other_(std::move(other)) {}
  void add(const std::string& name, std::uint64_t n);
  const std::map<std::string, std::uint64_t>& counts() const { return counts_; }

 private:
  std::size_t capacity_;
  std::string other_;
  std::map<std::string, std::uint64_t> counts_;
};

}  // namespace fivepipe::node
