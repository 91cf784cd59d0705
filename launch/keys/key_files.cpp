#include "launch/keys/key_files.h"

#include <fcntl.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

namespace fivepipe::keys {
namespace {

namespace fs = std::filesystem;
using security::SecurityError;

constexpr mode_t kPrivate = 0600, kPublic = 0644, kPrivateFolder = 0700;

[[noreturn]] void throw_error(const fs::path& path, int error) {
  throw SecurityError(path.string() + ": " + std::strerror(error));
}

// The owner that a new file or folder gets in place of an existing one.
struct Owner {
  uid_t user;
  gid_t group;
};
std::optional<Owner> owner_of(const fs::path& path) {
  struct stat status {};
  if (geteuid() != 0 || stat(path.c_str(), &status) != 0) return std::nullopt;
  return Owner{status.st_uid, status.st_gid};
}

class Descriptor {
 public:
  Descriptor(const fs::path& path, int flags, mode_t mode = 0)
      : path_(path), handle_(open(path.c_str(), flags | O_CLOEXEC, mode)) {
    if (handle_ < 0) throw_error(path, errno);
  }
  ~Descriptor() {
    if (handle_ >= 0) ::close(handle_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  void write(const std::string& content) const {
    for (std::size_t done = 0; done < content.size();) {
      const ssize_t n = ::write(handle_, content.data() + done, content.size() - done);
      if (n < 0 && errno == EINTR) continue;
      require(n >= 0);
      done += std::size_t(n);
    }
  }
  void set_owner(const Owner& owner) const {
    require(fchown(handle_, owner.user, owner.group) == 0);
  }
  // Writes to the disk and closes.
  void finish() {
    require(fsync(handle_) == 0);
    require(::close(std::exchange(handle_, -1)) == 0);
  }

 private:
  void require(bool done) const {
    if (!done) throw_error(path_, errno);
  }
  const fs::path path_;
  int handle_;
};

// No other user can read a private file at any time.
void write_new(const fs::path& path, const KeyFile& file, const std::optional<Owner>& owner) {
  Descriptor descriptor(path, O_WRONLY | O_CREAT | O_EXCL, file.is_private ? kPrivate : kPublic);
  if (owner) descriptor.set_owner(*owner);
  descriptor.write(file.content);
  descriptor.finish();
}

void sync_folder(const fs::path& folder) { Descriptor(folder, O_RDONLY | O_DIRECTORY).finish(); }

void make_private_folder(const fs::path& folder) {
  if (mkdir(folder.c_str(), kPrivateFolder) != 0 || chmod(folder.c_str(), kPrivateFolder) != 0)
    throw_error(folder, errno);
}

void make_parent(const fs::path& parent) {
  std::error_code error;
  if (parent.empty() || fs::exists(parent, error)) return;
  if (parent.has_parent_path()) fs::create_directories(parent.parent_path(), error);
  if (error) throw_error(parent.parent_path(), error.value());
  make_private_folder(parent);
}

void rename_or_throw(const fs::path& from, const fs::path& to) {
  if (rename(from.c_str(), to.c_str()) != 0) throw_error(to, errno);
}

fs::path set_aside(const fs::path& folder) { return folder.string() + ".old"; }

void put_in_place(const fs::path& made, const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder, error)) return rename_or_throw(made, folder);
  if (renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, folder.c_str(), RENAME_EXCHANGE) == 0) return;
  if (errno != EINVAL && errno != ENOSYS) throw_error(folder, errno);
  fs::remove_all(set_aside(folder), error);
  rename_or_throw(folder, set_aside(folder));
  rename_or_throw(made, folder);
  fs::remove_all(set_aside(folder), error);
}

}  // namespace

void recover(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder, error) && fs::exists(set_aside(folder), error))
    rename_or_throw(set_aside(folder), folder);
}

void write_folder(const fs::path& folder, const std::vector<KeyFile>& files) {
  make_parent(folder.parent_path());
  const fs::path made = folder.string() + ".new";
  std::error_code error;
  fs::remove_all(made, error);  // of an interrupted run
  make_private_folder(made);
  const std::optional<Owner> owner = owner_of(folder);
  try {
    for (const KeyFile& file : files) write_new(made / file.name, file, owner);
    if (owner) {
      Descriptor(made, O_RDONLY | O_DIRECTORY).set_owner(*owner);
    }
    sync_folder(made);
    put_in_place(made, folder);
  } catch (const SecurityError&) {
    fs::remove_all(made, error);
    throw;
  }
  fs::remove_all(made, error);  // now the old files
  sync_folder(folder.has_parent_path() ? folder.parent_path() : ".");
}

void write_file(const fs::path& folder, const KeyFile& file) {
  const fs::path path = folder / file.name, made = path.string() + ".new";
  unlink(made.c_str());
  const auto owner = owner_of(path);
  write_new(made, file, owner ? owner : owner_of(folder));
  if (rename(made.c_str(), path.c_str()) != 0) {
    const int error = errno;
    unlink(made.c_str());
    throw_error(path, error);
  }
  sync_folder(folder);
}

}  // namespace fivepipe::keys
