#include "launch/study/folder/study_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "common/base/result_file.h"
#include "common/base/text_table.h"
#include "common/base/usage_error.h"
#include "common/config/mesh/mesh_file.h"
#include "launch/study/folder/pseudonym_search.h"
#include "launch/study/folder/study_lock.h"
#include "launch/supervise/claims.h"

namespace fivepipe::study {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;
// Position of the scene file in Deployment::files.
constexpr std::size_t kSceneFile = 2;
constexpr std::size_t kMaxPseudonym = 1000;

Json json_from(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  try {
    return Json::parse(in);
  } catch (const nlohmann::json::exception& error) {
    throw base::UsageError(file.string() + ": " + error.what());
  }
}

// Replaces the file as a whole, so that an interruption leaves the old or the new one.
void replace_json(const fs::path& file, const Json& json) {
  const fs::path part = file.string() + ".part";
  base::write_json(part, json);
  fs::rename(part, file);
}

// The deepest folder that contains all files.
fs::path common_folder(const std::vector<fs::path>& files) {
  fs::path common = files.front().parent_path();
  for (const fs::path& file : files)
    while (*file.lexically_relative(common).begin() == "..") common = common.parent_path();
  return common;
}

// Copies the files of the deployment and returns the path of its file below the folder.
fs::path copied(const config::Deployment& deployment, const fs::path& folder) {
  std::vector<fs::path> files;
  for (const fs::path& file : deployment.files)
    files.push_back(fs::absolute(file).lexically_normal());
  std::ranges::sort(files);
  files.erase(std::unique(files.begin(), files.end()), files.end());
  const fs::path common = common_folder(files);
  for (const fs::path& file : files) {
    const fs::path copy = folder / file.lexically_relative(common);
    fs::create_directories(copy.parent_path());
    fs::copy_file(file, copy);
  }
  return fs::absolute(deployment.file).lexically_normal().lexically_relative(common);
}

// Another `new` may hold the locks of a folder that is still empty.
void check_is_free(const fs::path& folder) {
  if (!fs::exists(folder)) return;
  bool is_free = fs::is_directory(folder);
  if (is_free)
    for (const auto& entry : fs::directory_iterator(folder))
      is_free &= std::ranges::any_of(
          kWholeStudy, [&](StudyPart part) { return entry.path() == lock_file(folder, part); });
  if (!is_free)
    throw base::UsageError(folder.string() + " exists and is not empty; choose another folder");
}

// A copy that reads the original of a file would change with it.
void check_files(const config::Deployment& deployment, const fs::path& folder) {
  const std::string inside = fs::canonical(folder).string() + '/';
  for (const fs::path& file : deployment.files)
    if (!fs::canonical(file).string().starts_with(inside))
      throw base::UsageError(deployment.file.filename().string() + " names " + file.string() +
                             " by an absolute path or a setting; a study needs paths that are "
                             "relative to the file that names them");
}

std::string spacing_yaml(const config::Spacing& spacing) {
  const Eigen::Vector3d& axis = spacing.axis_world;
  return fmt::format("{{axis: [{}, {}, {}], at_m: {}, range_m: [{}, {}]}}", axis.x(), axis.y(),
                     axis.z(), spacing.at_m, spacing.low_m, spacing.high_m);
}

// The other files that a mesh file names: of a glTF its buffers, of an OBJ its materials, of both
// their textures. Throws base::UsageError if the file is unusable.
std::set<fs::path> files_named_by(const fs::path& file) {
  const config::MeshOrReason mesh = config::read_mesh(
      file, config::has_unit(file) ? std::nullopt : std::optional(1.0), config::Materials::with);
  if (!mesh.reason.empty()) throw base::UsageError("--mesh: " + file.string() + ": " + mesh.reason);
  std::set<fs::path> named;
  const auto add = [&](const fs::path& other) {
    named.insert(fs::absolute(other).lexically_normal());
  };
  std::ranges::for_each(mesh.files, add);
  if (mesh.materials)
    for (const config::Material& material : mesh.materials->materials)
      if (material.texture) add(material.texture->file);
  named.erase(fs::absolute(file).lexically_normal());
  return named;
}

// Copies the mesh file and the files that it names below `folder`. Returns its path there: alone
// NAME.EXT, otherwise in a folder of its own, because other meshes may name files of the same name.
fs::path copied_mesh(const MeshPart& part, const fs::path& folder) {
  if (!fs::is_regular_file(part.file)) throw base::UsageError(part.file.string() + " is no file");
  const std::string name = part.name + part.file.extension().string();
  const std::set<fs::path> named = files_named_by(part.file);
  const fs::path copy = named.empty() ? fs::path(name) : fs::path(part.name) / name;
  fs::create_directories((folder / copy).parent_path());
  fs::copy_file(part.file, folder / copy, fs::copy_options::overwrite_existing);
  for (const fs::path& file : named) {
    const fs::path below =
        file.lexically_relative(fs::absolute(part.file).lexically_normal().parent_path());
    if (below.empty() || *below.begin() == "..")
      throw base::UsageError(part.file.string() + " names " + file.string() +
                             ", which is not below its folder; use one .glb file");
    const fs::path to = folder / part.name / below;
    fs::create_directories(to.parent_path());
    fs::copy_file(file, to, fs::copy_options::overwrite_existing);
  }
  return copy;
}

// Replaces the objects of the scene by meshes, which are copied to its folder.
void write_scene(const config::Deployment& deployment, const std::vector<MeshPart>& parts) {
  const fs::path scene = deployment.files.at(kSceneFile);
  std::string text = "name: " + deployment.scene.name + "\nobjects:\n";
  for (const MeshPart& part : parts) {
    const fs::path copy = copied_mesh(part, scene.parent_path());
    text += fmt::format("  - name: {}\n    mesh: {{file: {}{}}}\n", part.name, copy.string(),
                        part.unit.empty() ? "" : ", unit: " + part.unit);
    text += "    position_m: [0, 0, 0]\n";
    if (part.spacing) text += "    spacing: " + spacing_yaml(*part.spacing) + '\n';
  }
  base::write_file(scene, text);
}

// After `run` was killed, its deployment still writes for a moment. Throws launch::ClaimRefused.
void check_is_over(const fs::path& trial_folder) {
  for (const auto& entry : fs::directory_iterator(trial_folder))
    if (entry.is_directory()) {
      const launch::FolderClaim claim(entry.path());
    }
}

// In the study's folder.
bool is_name_of_a_study(const fs::path& name) {
  return name == "study.json" || name == "deployment" || name == "trials" || name == "report" ||
         std::ranges::any_of(kWholeStudy,
                             [&](StudyPart part) { return name == lock_file("", part); });
}

}  // namespace

StudyFolder::StudyFolder(fs::path folder) : folder_(std::move(folder)) { load_settings(); }

void StudyFolder::load_settings() {
  const fs::path file = folder_ / "study.json";
  if (!fs::is_regular_file(file))
    throw base::UsageError(folder_.string() + " is no study; make one by: fivepipe study new " +
                           folder_.string() + " --deployment FILE");
  const Json json = json_from(file);
  try {
    if (const int format = json.at("format").get<int>(); format != kFormat)
      throw std::runtime_error(fmt::format("format {} is not {}", format, kFormat));
    settings_.name = json.at("name").get<std::string>();
    settings_.deployment = json.at("deployment").get<std::string>();
    settings_.settings = json.at("settings").get<std::map<std::string, std::string>>();
    settings_.spacing_of = json.at("spacing_of").get<std::string>();
    settings_.trials_begun = json.at("trials_begun").get<int>();
  } catch (const std::exception& error) {
    throw base::UsageError(file.string() + ": " + error.what());
  }
}

StudyFolder StudyFolder::create(const fs::path& folder, StudySettings settings,
                                const std::vector<MeshPart>& parts) {
  const bool existed = fs::exists(folder);
  check_is_free(folder);
  const config::Deployment deployment =
      config::load_deployment(settings.deployment, settings.settings);
  fs::create_directories(folder);
  const StudyLock lock(folder, "new", kWholeStudy);
  check_is_free(folder);  // of what another `new` has made meanwhile
  try {
    const fs::path copies = folder / "deployment";
    settings.deployment =
        (copies / copied(deployment, copies)).lexically_relative(folder.lexically_normal());
    fs::create_directories(folder / "trials");
    StudyFolder made(folder, std::move(settings));
    if (!parts.empty()) write_scene(made.deployment(), parts);
    check_files(made.deployment(), folder);
    made.save_settings();
    return made;
  } catch (...) {
    for (const auto& entry : fs::directory_iterator(folder)) fs::remove_all(entry.path());
    if (!existed) fs::remove(folder);
    throw;
  }
}

void StudyFolder::save_settings() const {
  replace_json(folder_ / "study.json", {{"format", kFormat},
                                        {"name", settings_.name},
                                        {"deployment", settings_.deployment.string()},
                                        {"settings", settings_.settings},
                                        {"spacing_of", settings_.spacing_of},
                                        {"trials_begun", settings_.trials_begun}});
}

config::Deployment StudyFolder::deployment() const {
  return config::load_deployment(deployment_file(), settings_.settings);
}

fs::path StudyFolder::folder_of(int trial) const {
  return folder_ / "trials" / fmt::format("{:04}", trial);
}

std::vector<StoredTrial> StudyFolder::trials() const {
  std::vector<StoredTrial> trials;
  if (!fs::is_directory(folder_ / "trials")) return trials;
  for (const auto& entry : fs::directory_iterator(folder_ / "trials"))
    if (const fs::path file = entry.path() / "trial.json"; fs::is_regular_file(file)) {
      trials.push_back(trial_from(json_from(file), file.string()));
      if (folder_of(trials.back().number) != entry.path())
        throw base::UsageError(fmt::format("{}: trial {} is not the number of its folder",
                                           file.string(), trials.back().number));
    }
  std::ranges::sort(trials, {}, &StoredTrial::number);
  return trials;
}

StoredTrial StudyFolder::trial(int number) const {
  const fs::path file = folder_of(number) / "trial.json";
  if (!fs::is_regular_file(file))
    throw base::UsageError(fmt::format("{} has no trial {}; `fivepipe study list {}` lists them",
                                       folder_.string(), number, folder_.string()));
  return trial_from(json_from(file), file.string());
}

StoredTrial StudyFolder::add_trial(const std::string& participant, report::ParticipantKind kind) {
  if (participant.empty() || participant.size() > kMaxPseudonym || !is_utf8(participant))
    throw base::UsageError("--participant: a pseudonym is 1 to 1000 bytes of UTF-8");
  const StudyLock lock(folder_, "run", {StudyPart::trials});
  load_settings();
  for (const StoredTrial& trial : trials())
    if (trial.participant == participant && trial.kind != kind)
      throw base::UsageError(base::printable(participant) +
                             " is a scripted actor in one trial and a person in another one; use "
                             "another pseudonym");
  const int number = ++settings_.trials_begun;
  save_settings();
  fs::create_directories(folder_of(number));
  StoredTrial trial;
  trial.number = number;
  trial.participant = participant;
  trial.kind = kind;
  store(trial);
  return trial;
}

StoredTrial StudyFolder::change(int number, const std::string& command,
                                const std::function<void(StoredTrial&)>& change) const {
  const StudyLock lock(folder_, command, {StudyPart::trials});
  StoredTrial changed = trial(number);
  change(changed);
  store(changed);
  return changed;
}

void StudyFolder::save(const StoredTrial& trial) const {
  const StudyLock lock(folder_, "run", {StudyPart::trials});
  store(trial);
}

void StudyFolder::remove(int trial) const {
  const StudyLock lock(folder_, "run", {StudyPart::trials});
  fs::remove_all(folder_of(trial));
}

void StudyFolder::store(const StoredTrial& trial) const {
  replace_json(folder_of(trial.number) / "trial.json", json_of(trial));
}

Forgotten StudyFolder::forget(const std::string& participant) {
  const StudyLock lock(folder_, "forget", kWholeStudy);
  if (!is_utf8(participant)) throw base::UsageError("--participant: the text is not UTF-8");
  std::vector<int> removed;
  std::string similar;
  for (const StoredTrial& trial : trials())
    if (trial.participant == participant)
      removed.push_back(trial.number);
    else if (lower_case(trial.participant) == lower_case(participant))
      similar = trial.participant;
  for (const int number : removed) check_is_over(folder_of(number));
  // A report and a trial's file are left if this is interrupted, so that it can be repeated.
  if (!removed.empty()) fs::remove_all(report_folder());
  for (const int number : removed) {
    for (const auto& entry : fs::directory_iterator(folder_of(number)))
      if (entry.path().filename() != "trial.json") fs::remove_all(entry.path());
    fs::remove_all(folder_of(number));
  }
  Forgotten forgotten{int(removed.size()), {}, {}};
  if (!removed.empty() || similar.empty()) search(participant, forgotten);
  if (removed.empty() && forgotten.mentioned_in.empty())
    throw base::UsageError(folder_.string() + " has no trial of " + base::printable(participant) +
                           (similar.empty() ? "" : ", but of " + base::printable(similar)));
  return forgotten;
}

// Lists what else is in the folder, and what still names the participant.
void StudyFolder::search(const std::string& participant, Forgotten& found) const {
  const PseudonymSearch pseudonym(participant);
  for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
    const fs::path& path = entry.path();
    const fs::path name = path.filename(), parent = path.lexically_relative(folder_).parent_path();
    const bool is_trial = parent == "trials" && fs::is_regular_file(path / "trial.json"),
               is_own = is_trial || (parent.empty() && is_name_of_a_study(name));
    if (!is_own && (parent.empty() || parent == "trials")) found.unknown.push_back(path);
    bool mentions = !is_own && pseudonym.is_in(name.string());
    if (entry.is_regular_file() && !(is_own && name.extension() == ".lock")) try {
        mentions |= pseudonym.is_in_content(path);
      } catch (const std::system_error&) {
        found.unknown.push_back(path);
      }
    if (mentions) found.mentioned_in.push_back(path);
  }
  std::ranges::sort(found.mentioned_in);
  std::ranges::sort(found.unknown);
  found.unknown.erase(std::unique(found.unknown.begin(), found.unknown.end()), found.unknown.end());
}

}  // namespace fivepipe::study
