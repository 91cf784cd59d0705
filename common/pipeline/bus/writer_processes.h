// Finds the process of a writer. Internal to bus.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/base/containers/bounded_map.h"
#include "common/pipeline/bus/process_id.h"

namespace fivepipe::bus::detail {

// Remembers the writers of one reader, because discovery forgets a writer that is gone although
// its samples may still be queued.
class WriterProcesses {
 public:
  static constexpr std::size_t kMaxWriters = 1024;  // the oldest are forgotten

  // `reader` is the DDS entity that received a sample of this publication handle. Returns nullopt
  // if the writer's participant states no identity, or if the writer was gone at the first call for
  // it.
  std::optional<ProcessId> of(std::int32_t reader, std::uint64_t writer);

 private:
  base::BoundedMap<std::uint64_t, std::optional<ProcessId>> known_{kMaxWriters};
};

}  // namespace fivepipe::bus::detail
