// Recorded footage, which the repository does not contain. Tests without it are skipped.
#pragma once
#include <cstdlib>
#include <filesystem>

namespace fivepipe::test {

// The recording seated4cam: four cameras around a seated person.
inline std::filesystem::path seated4cam_folder() {
  const char* folder = std::getenv("FIVEPIPE_FOOTAGE");
  return std::filesystem::path(folder ? folder : FIVEPIPE_SOURCE_DIR "/../shared/data") /
         "seated4cam";
}

}  // namespace fivepipe::test
