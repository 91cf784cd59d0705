// The table of the steps of segmentation, from capture.json. Results are named
// capture/steps/SETTING; their errors are missed_SEQUENCE (fraction of the true object pixels) and
// false_px_SEQUENCE (per image).
#include <fmt/format.h>

#include <stdexcept>

#include "benchmarks/figures/documents.h"
#include "benchmarks/figures/numbers.h"

namespace fivepipe::figures {
namespace {

struct OverSequences {
  double mean = 0, worst = 0;
  std::string worst_in;  // a sequence
};

// Of the errors whose names begin with `prefix`.
OverSequences over_sequences(const json& result, const std::string& prefix) {
  OverSequences all;
  int sequences = 0;
  for (const auto& [name, value] : result.at("error").items()) {
    if (!name.starts_with(prefix)) continue;
    const double error = value;
    all.mean += error;
    if (sequences++ > 0 && error <= all.worst) continue;
    all.worst = error;
    all.worst_in = name.substr(prefix.size());
  }
  if (sequences == 0)
    throw std::runtime_error(result.value("name", "?") + " has no error " + prefix + "*");
  all.mean /= sequences;
  for (char& c : all.worst_in)
    if (c == '_') c = '-';
  return all;
}

std::string steps(const Results& results) {
  const std::string prefix = "capture/steps/";
  MarkdownTable table({"changed setting", "missed object pixels: mean; most",
                       "false pixels per image: mean; most"});
  bool has_row = false;
  for (const json& result : results.all("capture")) {
    const std::string name = result.at("name");
    if (!name.starts_with(prefix)) continue;
    has_row = true;
    const std::string setting = name.substr(prefix.size());
    const OverSequences missed = over_sequences(result, "missed_");
    const OverSequences extra = over_sequences(result, "false_px_");
    const auto with_worst = [](const std::string& mean, const std::string& worst,
                               const OverSequences& of) {
      return of.worst > 0 ? mean + "; " + worst + " (" + of.worst_in + ")" : mean;
    };
    table.add({setting.find(':') == std::string::npos ? setting : '`' + setting + '`',
               with_worst(fmt::format("{:.2f} %", 100 * missed.mean),
                          fmt::format("{:.2f} %", 100 * missed.worst), missed),
               with_worst(short_number(extra.mean), short_number(extra.worst), extra)});
  }
  if (!has_row) throw std::runtime_error("capture.json has no result " + prefix + "*");
  return table.text();
}

}  // namespace

std::map<std::string, Block> capture_blocks() { return {{"segmentation steps", steps}}; }

}  // namespace fivepipe::figures
