#include "launch/commands.h"

namespace fivepipe {

std::filesystem::path program_folder() { return std::filesystem::read_symlink("/proc/self/exe").parent_path(); }

}  // namespace fivepipe
