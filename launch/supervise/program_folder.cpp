#include "launch/supervise/program_folder.h"

namespace fivepipe::launch {

std::filesystem::path program_folder() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

}  // namespace fivepipe::launch
