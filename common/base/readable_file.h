// Checks of the files that the user names, before anything opens them.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

namespace fivepipe::base {

// Returns why the content of a file cannot be read, or nullopt if it can: there is no such file, it
// is a directory, it is not a regular file, or permission is missing. Opening a named pipe would
// wait for its writer, and reading a device may never end.
std::optional<std::string> why_unreadable(const std::filesystem::path& file);

}  // namespace fivepipe::base
