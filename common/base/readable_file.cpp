#include "common/base/readable_file.h"

#include <unistd.h>

namespace fivepipe::base {
namespace {

const char* name_of(std::filesystem::file_type type) {
  switch (type) {
    case std::filesystem::file_type::directory: return "a directory";
    case std::filesystem::file_type::fifo: return "a pipe";
    case std::filesystem::file_type::socket: return "a socket";
    case std::filesystem::file_type::character:
    case std::filesystem::file_type::block: return "a device";
    default: return "of an unknown kind";
  }
}

}  // namespace

std::optional<std::string> why_unreadable(const std::filesystem::path& file) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(file, error);
  if (status.type() == std::filesystem::file_type::not_found) return "there is no such file";
  if (status.type() == std::filesystem::file_type::none)
    return "cannot be read: " + error.message();
  if (status.type() != std::filesystem::file_type::regular)
    return std::string("is ") + name_of(status.type()) + ", not a file";
  if (access(file.c_str(), R_OK) != 0) return "cannot be read: check its permissions";
  return std::nullopt;
}

}  // namespace fivepipe::base
