// The blocks of figures in the documents.
#pragma once
#include <functional>
#include <map>
#include <string>

#include "benchmarks/figures/results.h"

namespace fivepipe::figures {

// Returns the content of a block, in Markdown, from the results. Throws std::runtime_error if a
// result is missing.
using Block = std::function<std::string(const Results&)>;

// By name, as the markers in the documents name them.
const std::map<std::string, Block>& blocks();

// Returns the document with the blocks of these results. Throws std::runtime_error that names the
// block if it is unknown or not closed, or a result is missing.
std::string with_figures(const std::string& document, const Results& results);

// Blocks by the suite that measures them.
std::map<std::string, Block> capture_blocks();
std::map<std::string, Block> hull_blocks();
std::map<std::string, Block> collision_blocks();
std::map<std::string, Block> pipeline_blocks();

}  // namespace fivepipe::figures
