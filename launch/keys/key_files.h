// Writes folders of keys.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "common/pipeline/security/certificate.h"

namespace fivepipe::keys {

struct KeyFile {
  std::filesystem::path name;
  std::string content;
  bool is_private;  // mode 0600 instead of 0644
};

// Makes the folder with these files, mode 0700, or exchanges an existing one for it at once, if the
// file system can: a reader sees the old files or the new ones. As root, the new folder has the
// owner of the old one. Other files of the old folder are lost. Makes missing parents; the last one
// has mode 0700. Throws security::SecurityError.
void write_folder(const std::filesystem::path& folder, const std::vector<KeyFile>& files);

// Completes an exchange of the folder that was interrupted on a file system without an exchange at
// once, such as NFS: there, write_folder() first renames the old folder to FOLDER.old. Throws
// security::SecurityError.
void recover(const std::filesystem::path& folder);

// Replaces the file of an existing folder at once. Throws security::SecurityError.
void write_file(const std::filesystem::path& folder, const KeyFile& file);

}  // namespace fivepipe::keys
