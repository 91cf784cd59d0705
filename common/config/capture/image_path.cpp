#include "common/config/capture/image_path.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "common/base/readable_file.h"
#include "common/base/regex.h"

namespace fivepipe::config {
namespace {

// Returns a file of a sequence such as frame_%04d.png. Returns the pattern itself if it contains no
// %d.
std::string frame_of_sequence(const std::string& pattern, int index) {
  static const base::Regex index_pattern("%(0?)([0-9]?)d");
  const auto match = index_pattern.search(pattern);
  if (!match) return pattern;
  const std::string &zero = match->groups[1], &width_digit = match->groups[2];
  std::string digits = std::to_string(index);
  const std::size_t width = width_digit.empty() ? 0 : std::size_t(width_digit[0] - '0');
  if (digits.size() < width) digits.insert(0, width - digits.size(), zero.empty() ? ' ' : '0');
  return match->before + digits + match->after;
}

}  // namespace

std::string read_image_path(YamlMap& map, const std::string& key, int first_frame, bool is_here) {
  const std::string path = map.path(key).string();
  if (path.empty() || !is_here) return path;
  // Sequences start at 0 or at 1.
  auto why = base::why_unreadable(frame_of_sequence(path, first_frame));
  if (why && base::why_unreadable(frame_of_sequence(path, first_frame + 1)))
    map.problem_at(key, key + ' ' + path + ": " + *why);
  return path;
}

bool is_single_picture(const std::string& path) {
  if (path.find('%') != std::string::npos) return false;
  std::string suffix = std::filesystem::path(path).extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return suffix == ".png" || suffix == ".jpg" || suffix == ".jpeg" || suffix == ".bmp" ||
         suffix == ".tif" || suffix == ".tiff" || suffix == ".ppm";
}

}  // namespace fivepipe::config
