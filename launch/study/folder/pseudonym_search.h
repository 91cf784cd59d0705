// Which files of a study still name a participant.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace fivepipe::study {

// In a file that is no text, such as a recording, a shorter pseudonym would be found by chance.
inline constexpr std::size_t kMinBinaryBytes = 6;

class PseudonymSearch {
 public:
  explicit PseudonymSearch(const std::string& pseudonym);

  // Whether the text has the pseudonym as a word of its own, in upper or lower case.
  bool is_in(const std::string& text) const;
  // Whether the content of the file has it: as it is, or as JSON, HTML or CSV write it. A file with
  // a zero byte in its first MiB is no text: there, the pseudonym is found also within a word, if
  // it has at least kMinBinaryBytes bytes. Does not look into compressed content. Throws
  // std::system_error if the file cannot be read.
  bool is_in_content(const std::filesystem::path& file) const;

 private:
  bool is_in(const std::string& folded, bool as_word) const;
  std::vector<std::string> forms_;  // in lower case
  std::size_t max_bytes_ = 0;       // of a form
};

// The text in lower case, in all scripts; bytes that are not UTF-8 stay as they are.
std::string lower_case(const std::string& text);

}  // namespace fivepipe::study
