#include "common/pipeline/bus/writer_processes.h"

#include <dds/dds.h>

#include "common/pipeline/bus/discovery.h"

namespace fivepipe::bus::detail {

std::optional<ProcessId> WriterProcesses::of(std::int32_t reader, std::uint64_t writer) {
  if (const auto* known = known_.find(writer)) return *known;
  dds_builtintopic_endpoint_t* described = dds_get_matched_publication_data(reader, writer);
  if (!described) return std::nullopt;
  const dds_guid_t participant = described->participant_key;
  dds_builtintopic_free_endpoint(described);
  const DiscoveredProcess found = process_of_participant(dds_get_participant(reader), participant);
  // Does not remember the writer, because the participant's data may arrive later.
  if (!found.discovered) return std::nullopt;
  return known_.set(writer, found.process);
}

}  // namespace fivepipe::bus::detail
