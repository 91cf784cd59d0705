#include "launch/inspect/record_report.h"

#include <fmt/format.h>

#include "common/base/text_table.h"

namespace fivepipe::launch {
namespace {

// Peers can invent nodes: at most this many are listed.
constexpr std::size_t kMaxLines = 20;

}  // namespace

std::string summary_text(const replay::RecordRequest& request, const replay::RecordResult& result) {
  base::TextTable table(
      {{"topic"}, {"received", true}, {"written", true}, {"lost", true}, {"MB", true}});
  std::uint64_t written = 0;
  for (const auto& [topic, count] : result.counts) {
    table.add({topic, std::to_string(count.received), std::to_string(count.written),
               std::to_string(count.lost), base::with_decimals(1e-6 * double(count.bytes), 1)});
    written += count.written;
  }
  return table.text() + fmt::format("{}: {}, {:.1f} MB, {:.1f} s\n", request.file.string(),
                                    base::counted(written, "message"),
                                    1e-6 * double(result.bytes_written), result.elapsed_s);
}

std::string problems_text(const replay::RecordRequest& request,
                          const replay::RecordResult& result) {
  std::string text;
  std::size_t incomplete = 0;
  for (const replay::SentByNode& by : result.sent)
    if (by.missing() > 0 && ++incomplete <= kMaxLines)
      text += fmt::format("{} sent {} messages of {}, the recorder received {}\n", by.node, by.sent,
                          by.topic, by.received);
  if (incomplete > kMaxLines)
    text += fmt::format("and {} more such lines\n", incomplete - kMaxLines);
  if (!result.unverified_nodes.empty()) {
    std::vector<std::string> nodes;
    for (const std::string& node : result.unverified_nodes) {
      if (nodes.size() == kMaxLines) break;
      nodes.push_back(node.empty() ? "(unnamed)" : node);
    }
    if (nodes.size() < result.unverified_nodes.size())
      nodes.push_back(fmt::format("and {} more", result.unverified_nodes.size() - nodes.size()));
    text +=
        "cannot check for losses; no recent send counts from: " + base::joined(nodes, ", ") + "\n";
  }
  std::uint64_t received = 0, lost = 0;
  for (const auto& [topic, count] : result.counts) {
    received += count.received;
    lost += count.lost;
  }
  if (lost > 0) text += base::counted(lost, "message") + " lost: " + result.loss_reason + "\n";
  if (!result.failure.empty()) {
    if (lost == 0) text += result.failure + "\n";
    text += fmt::format(
        "The file holds everything up to the failure; repair it by `fivepipe info --recover {}`.\n",
        request.file.string());
  } else if (!result.finished) {
    text += fmt::format(
        "the disk was too slow to take the index; repair the file by `fivepipe info --recover "
        "{}`.\n",
        request.file.string());
  } else if (received == 0) {
    text +=
        fmt::format("received no message; {}\n",
                    result.why_not_admitted.empty()
                        ? fmt::format("`fivepipe ls --domain {}` lists the nodes that write there",
                                      request.domain)
                        : result.why_not_admitted);
  }
  if (result.failure.empty() && !result.synced)
    text += fmt::format(
        "the disk has not confirmed the end of {}; a power cut within the next seconds may lose "
        "it\n",
        request.file.string());
  return text;
}

}  // namespace fivepipe::launch
