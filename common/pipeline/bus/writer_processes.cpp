#include "common/pipeline/bus/writer_processes.h"

#include <dds/dds.h>

#include "common/pipeline/bus/discovery.h"

namespace fivepipe::bus::detail {

std::optional<ProcessId> WriterProcesses::of(std::int32_t reader, std::uint64_t writer) {
  if (const auto known = known_.find(writer); known != known_.end()) return known->second;
  dds_builtintopic_endpoint_t* described = dds_get_matched_publication_data(reader, writer);
  if (!described) return std::nullopt;
  const dds_guid_t participant = described->participant_key;
  dds_builtintopic_free_endpoint(described);
  const DiscoveredProcess found = process_of_participant(dds_get_participant(reader), participant);
  // Does not remember the writer, because the participant's data may arrive later.
  if (!found.discovered) return std::nullopt;
  known_.emplace(writer, found.process);
  by_age_.push_back(writer);
  if (by_age_.size() > kMaxWriters) {
    known_.erase(by_age_.front());
    by_age_.pop_front();
  }
  return found.process;
}

}  // namespace fivepipe::bus::detail
