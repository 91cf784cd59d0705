// The folder of a study: what `fivepipe study` keeps between its commands.
//
//   study.json               name, deployment, settings
//   deployment/              the deployment with its rig, scene and meshes
//   trials/0001/trial.json   one trial (stored_trial.h)
//               recording_1.mcap, run_1/    what `fivepipe up` recorded and wrote
//   report/                  what `fivepipe study report` wrote
//   *.lock                   study_lock.h
//
// Only the trial files and the report contain pseudonyms; no file has one in its name.
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "launch/study/folder/stored_trial.h"

namespace fivepipe::study {

struct StudySettings {
  std::string name;
  std::filesystem::path deployment;             // below the folder
  std::map<std::string, std::string> settings;  // of the deployment (--set)
  std::string spacing_of;                       // "payload A and PMT box": of the report's table
  int trials_begun = 0;                         // also those that were removed
};

// A part of a new scene.
struct MeshPart {
  std::string name;
  std::filesystem::path file;  // glTF (.glb), OBJ, STL, PLY or STEP
  std::string unit;            // m, cm, mm or in; empty: that of the format (glTF, STEP)
  std::optional<config::Spacing> spacing = std::nullopt;
};

struct Forgotten {
  int trials = 0;
  // Files and folders whose name or content has the pseudonym (PseudonymSearch), such as a note of
  // another trial.
  std::vector<std::filesystem::path> mentioned_in;
  // What is in the folder, but not of the study, such as an export of a recording: it may hold the
  // participant's frames. Also what cannot be read.
  std::vector<std::filesystem::path> unknown;
};

class StudyFolder {
 public:
  // Opens a study. Throws base::UsageError if the folder has none or its file is wrong.
  explicit StudyFolder(std::filesystem::path folder);
  // Makes a study with a copy of the deployment and of the files that it reads. parts: if there are
  // any, they replace the objects of the scene. Throws base::UsageError if the folder exists and is
  // not empty, or if a copy would still read an original, which an absolute path names; ConfigError
  // if the deployment or a part cannot be loaded; the folder is then as before. Holds all locks.
  static StudyFolder create(const std::filesystem::path& folder, StudySettings settings,
                            const std::vector<MeshPart>& parts = {});

  const std::filesystem::path& path() const { return folder_; }
  const StudySettings& settings() const { return settings_; }
  std::filesystem::path deployment_file() const { return folder_ / settings_.deployment; }
  config::Deployment deployment() const;

  std::vector<StoredTrial> trials() const;  // ascending by number
  StoredTrial trial(int number) const;      // throws base::UsageError
  // The functions below that change trials hold trials.lock meanwhile.
  //
  // A number is not used again. Throws base::UsageError if the pseudonym is empty, longer than
  // 1,000 bytes or not UTF-8.
  StoredTrial add_trial(const std::string& participant, report::ParticipantKind kind);
  // Reads the trial, applies `change` and writes it, so that no other command's change is lost.
  // command: see StudyLock. Returns the changed trial. If `change` throws, the file is as before.
  StoredTrial change(int trial, const std::string& command,
                     const std::function<void(StoredTrial&)>& change) const;
  // Replaces the trial's file, whatever another command has changed in it.
  void save(const StoredTrial& trial) const;
  void remove(int trial) const;
  std::filesystem::path folder_of(int trial) const;
  std::filesystem::path report_folder() const { return folder_ / "report"; }

  // Removes the trials of the participant, and the report, which may show them. It can be repeated
  // if it was interrupted, and to search again. Throws base::UsageError if nothing is left of the
  // participant, or if another command uses the study; launch::ClaimRefused if a deployment still
  // writes to a trial.
  Forgotten forget(const std::string& participant);

 private:
  StudyFolder(std::filesystem::path folder, StudySettings settings)
      : folder_(std::move(folder)), settings_(std::move(settings)) {}
  void load_settings();
  void save_settings() const;
  void store(const StoredTrial& trial) const;  // without the lock
  void search(const std::string& participant, Forgotten& found) const;

  std::filesystem::path folder_;
  StudySettings settings_;
};

}  // namespace fivepipe::study
