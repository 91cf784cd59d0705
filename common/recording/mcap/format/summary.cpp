#include "common/recording/mcap/format/summary.h"

#include <algorithm>

namespace fivepipe::mcap {

void add_messages(Statistics& statistics, Id channel, std::uint64_t count, std::uint64_t start_ns,
                  std::uint64_t end_ns) {
  if (count == 0) return;
  statistics.start_ns =
      statistics.messages == 0 ? start_ns : std::min(statistics.start_ns, start_ns);
  statistics.end_ns = statistics.messages == 0 ? end_ns : std::max(statistics.end_ns, end_ns);
  statistics.messages += count;
  statistics.channel_messages[channel] += count;
}

void count_records(Summary& summary) {
  summary.statistics.schemas = std::uint32_t(summary.schemas.size());
  summary.statistics.channels = std::uint32_t(summary.channels.size());
  summary.statistics.attachments = std::uint32_t(summary.attachments.size());
  summary.statistics.metadata = std::uint32_t(summary.metadata.size());
  summary.statistics.chunks = std::uint32_t(summary.chunks.size());
}

}  // namespace fivepipe::mcap
