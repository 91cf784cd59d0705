#include "benchmarks/figures/documents.h"

#include <stdexcept>

#include "benchmarks/figures/blocks.h"
#include "benchmarks/figures/numbers.h"

namespace fivepipe::figures {
namespace {

std::string machine(const Results& results) {
  return wrapped(
      "`launch/figures` measured all figures of the documents in one run: " + results.machine() +
      "." + (results.has_gpu() ? "" : " docs/gpu.md has figures of a GPU."));
}

// The output of a program as it is, without the line of the machine.
Block text_of(const std::string& file) {
  return [file](const Results& results) {
    std::string text = results.text(file);
    text.erase(0, text.find('\n') + 1);
    while (text.starts_with('\n')) text.erase(0, 1);
    return "```\n" + text + (text.ends_with('\n') ? "" : "\n") + "```\n";
  };
}

}  // namespace

const std::map<std::string, Block>& blocks() {
  static const std::map<std::string, Block> all = [] {
    std::map<std::string, Block> of_all{{"machine", machine},
                                        {"hull output", text_of("hull")},
                                        {"collision output", text_of("collision")},
                                        {"capture output", text_of("capture")},
                                        {"render output", text_of("render")},
                                        {"sim output", text_of("sim")},
                                        {"features output", text_of("features")},
                                        {"test output", text_of("tests")}};
    for (std::map<std::string, Block> of_suite :
         {capture_blocks(), hull_blocks(), collision_blocks(), pipeline_blocks()})
      of_all.merge(of_suite);
    return of_all;
  }();
  return all;
}

std::string with_figures(const std::string& document, const Results& results) {
  return with_blocks(document, [&](const std::string& name) {
    const auto block = blocks().find(name);
    if (block == blocks().end()) throw std::runtime_error("no block of figures '" + name + "'");
    try {
      return block->second(results);
    } catch (const std::exception& error) {
      throw std::runtime_error("block '" + name + "': " + error.what());
    }
  });
}

}  // namespace fivepipe::figures
