#include "benchmarks/figures/blocks.h"

#include <stdexcept>

namespace fivepipe::figures {
namespace {

constexpr const char *kBegin = "<!-- figures: ", *kBeginEnd = " -->\n",
                     *kEnd = "<!-- end of figures -->\n";

// Returns the position of the marker at the beginning of a line, or npos. An indented marker is an
// example.
std::size_t marker_at(const std::string& document, const char* marker, std::size_t from) {
  std::size_t at = document.find(marker, from);
  while (at != std::string::npos && at > 0 && document[at - 1] != '\n')
    at = document.find(marker, at + 1);
  return at;
}

}  // namespace

std::string with_blocks(const std::string& document,
                        const std::function<std::string(const std::string& name)>& content) {
  std::string result;
  std::size_t at = 0;
  for (std::size_t begin; (begin = marker_at(document, kBegin, at)) != std::string::npos;) {
    const std::size_t name_at = begin + std::char_traits<char>::length(kBegin),
                      name_end = document.find(kBeginEnd, name_at),
                      end = marker_at(document, kEnd, begin),
                      next = marker_at(document, kBegin, name_at);
    const std::string name = document.substr(name_at, name_end - name_at);
    if (name_end == std::string::npos || end == std::string::npos || next < end ||
        name.find('\n') != std::string::npos)
      throw std::runtime_error("block " + name.substr(0, name.find('\n')) + " is not closed");
    result += document.substr(at, name_end - at) + kBeginEnd + "\n" + content(name) + "\n" + kEnd;
    at = end + std::char_traits<char>::length(kEnd);
  }
  return result + document.substr(at);
}

std::string without_blocks(const std::string& document) {
  std::string result;
  std::size_t at = 0;
  for (std::size_t begin; (begin = marker_at(document, kBegin, at)) != std::string::npos;) {
    result += document.substr(at, begin - at);
    const std::size_t end = marker_at(document, kEnd, begin);
    if (end == std::string::npos) throw std::runtime_error("a block is not closed");
    at = end + std::char_traits<char>::length(kEnd);
  }
  return result + document.substr(at);
}

}  // namespace fivepipe::figures
