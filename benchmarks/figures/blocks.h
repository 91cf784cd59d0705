// Blocks of a Markdown document between markers, whose content a program writes:
//
//   <!-- figures: NAME -->
//   content
//   <!-- end of figures -->
#pragma once
#include <functional>
#include <string>
#include <vector>

namespace fivepipe::figures {

// Returns the document with new contents. Throws std::runtime_error that names the marker if one is
// not closed, and what `content` throws.
std::string with_blocks(const std::string& document,
                        const std::function<std::string(const std::string& name)>& content);
// Returns the document without its blocks.
std::string without_blocks(const std::string& document);

}  // namespace fivepipe::figures
