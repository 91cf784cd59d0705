#include "common/config/capture/image_path.h"

#include <algorithm>
#include <cctype>

#include "common/base/readable_file.h"

namespace fivepipe::config {

namespace fs = std::filesystem;

std::string read_image_path(YamlMap& map, const std::string& key, bool is_here) {
  const std::string path = map.path(key).string();
  if (path.empty() || !is_here) return path;
  if (!is_sequence(path)) {
    if (const auto why = base::why_unreadable(path))
      map.problem_at(key, key + ' ' + path + ": " + *why);
  } else if (const Pictures pictures = pictures_of(path); !pictures.problem.empty()) {
    map.problem_at(key, key + ' ' + path + ": " + pictures.problem);
  }
  return path;
}

bool is_sequence(const fs::path& path) {
  return path.filename().string().find('%') != std::string::npos;
}

Pictures pictures_of(const fs::path& sequence) {
  const std::string name = sequence.filename().string();
  const std::size_t percent = name.find('%');
  const std::size_t conversion =
      percent == std::string::npos ? percent : name.find_first_not_of("0123456789", percent + 1);
  Pictures pictures;
  if (conversion == std::string::npos || name[conversion] != 'd') {
    pictures.problem = "write %d where the names of the pictures have their number";
    return pictures;
  }
  const std::string before = name.substr(0, percent), after = name.substr(conversion + 1);
  std::error_code error;
  const fs::path folder = sequence.has_parent_path() ? sequence.parent_path() : fs::path(".");
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string candidate = entry->path().filename().string();
    if (candidate.size() <= before.size() + after.size() || !candidate.starts_with(before) ||
        !candidate.ends_with(after))
      continue;
    const std::string digits =
        candidate.substr(before.size(), candidate.size() - before.size() - after.size());
    constexpr std::size_t kMaxDigits = 15;
    if (digits.size() > kMaxDigits || digits.find_first_not_of("0123456789") != std::string::npos)
      continue;
    const auto [known, is_new] = pictures.files.emplace(std::stoll(digits), entry->path());
    if (!is_new)
      pictures.problem = "two pictures have number " + std::to_string(known->first) + ": " +
                         std::min(candidate, known->second.filename().string()) + " and " +
                         std::max(candidate, known->second.filename().string());
  }
  if (error)
    pictures.problem = folder.string() + ": " + error.message();
  else if (pictures.files.empty())
    pictures.problem = "no picture has such a name";
  return pictures;
}

bool is_single_picture(const fs::path& path) {
  if (is_sequence(path)) return false;
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return suffix == ".png" || suffix == ".jpg" || suffix == ".jpeg" || suffix == ".bmp" ||
         suffix == ".tif" || suffix == ".tiff" || suffix == ".ppm";
}

}  // namespace fivepipe::config
