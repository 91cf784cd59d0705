// Locks of a study, so that commands that run at once do not destroy each other's files.
//
//   command                        holds, from its start to its end
//   run                            run.lock
//   report                         report.lock
//   new, register, forget          all three
//   edit                           trials.lock
//
// run and report also hold trials.lock for the moment in which they change or read trial files.
// space, list and what-if hold none.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace fivepipe::study {

enum class StudyPart { run, report, trials };
inline const std::vector<StudyPart> kWholeStudy{StudyPart::run, StudyPart::report,
                                                StudyPart::trials};

// The file of the lock in the study's folder. It stays there, empty unless a command holds it.
std::filesystem::path lock_file(const std::filesystem::path& folder, StudyPart part);

// Holds locks until its destruction or the end of the process, however it ends (flock). A process
// that this one starts does not hold them.
class StudyLock {
 public:
  // command: "run" of `fivepipe study run`, for the message to others. The folder must exist.
  // Throws base::UsageError that names the command and the process that hold a part: at once, for
  // `trials` after 1 s, because run and report hold it for moments only; std::system_error if a
  // lock file cannot be opened. In a file system without locks, holds nothing and prints a warning.
  StudyLock(const std::filesystem::path& folder, const std::string& command,
            const std::vector<StudyPart>& parts);
  ~StudyLock();
  StudyLock(const StudyLock&) = delete;
  StudyLock& operator=(const StudyLock&) = delete;

 private:
  void lock(const std::filesystem::path& folder, const std::string& command, StudyPart part);
  void release();
  std::vector<int> files_;
};

}  // namespace fivepipe::study
