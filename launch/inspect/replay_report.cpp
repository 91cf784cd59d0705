#include "launch/inspect/replay_report.h"

#include <fmt/format.h>

#include "common/base/text_table.h"

namespace fivepipe::launch {

std::string text_of(const replay::ReplayCounts& counts) {
  base::TextTable topics({{"topic"}, {"in file", true}, {"sent", true}});
  for (const auto& [topic, in_file] : counts.in_file)
    topics.add({topic, std::to_string(in_file), std::to_string(counts.sent.at(topic))});
  std::string text = topics.text();
  if (!counts.expected.empty()) {
    base::TextTable nodes({{"node"}, {"frames", true}, {"handled", true}});
    for (const auto& [node, expected] : counts.expected)
      nodes.add({node, std::to_string(expected), std::to_string(counts.handled.at(node))});
    text += nodes.text();
  }
  if (counts.damaged)
    text += base::counted(counts.damaged, "damaged chunk") + " of the file skipped\n";
  if (counts.late)
    text += base::counted(counts.late, "message") + " too far behind their frame in the file\n";
  return text + fmt::format("{:.2f} s\n", counts.seconds);
}

}  // namespace fivepipe::launch
