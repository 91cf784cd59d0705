#include <fcntl.h>
#include <unistd.h>

#include <csignal>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/base/usage_error.h"
#include "common/recording/files/format.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"
#include "launch/inspect/recording_info.h"

namespace fivepipe::launch {
namespace {

struct InfoOptions {
  std::filesystem::path file, output, extract;
  bool recover = false, quick = false, json = false;
};

// True if any process has the file open for writing; false if the file system does not report it.
bool is_being_written(const std::filesystem::path& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return false;
  // The kernel refuses a read lease while a process has the file open for writing. A process that
  // opens the file meanwhile breaks the lease; SIGURG makes the notification harmless.
  fcntl(file, F_SETSIG, SIGURG);
  const bool refused = fcntl(file, F_SETLEASE, F_RDLCK) != 0 && errno == EAGAIN;
  close(file);
  return refused;
}

// Repairs the file, or a copy if --output is given.
mcap::Recovery recover(const InfoOptions& options) {
  if (options.output.empty()) {
    if (is_being_written(options.file))
      throw base::UsageError(
          options.file.string() +
          " is being written: wait until the recorder has ended, or repair a copy "
          "with --output FILE");
    return mcap::recover(options.file);
  }
  if (std::filesystem::exists(options.output))
    throw base::UsageError(options.output.string() + " exists; choose another --output");
  return mcap::recover(options.file, options.output);
}

// Writes the attached configuration files and prints the command that starts a node with them.
int extract(const InfoOptions& options) {
  const std::filesystem::path& folder = options.extract;
  if (std::filesystem::exists(folder) && !std::filesystem::is_empty(folder))
    throw base::UsageError(folder.string() + " is not empty; choose another folder");
  const recording::Recording recording(options.file);
  const auto deployment = recording.extract_deployment(folder);
  if (!deployment)
    throw base::UsageError(options.file.string() +
                           " contains no deployment; record with --deployment FILE or with "
                           "`fivepipe up --record`");
  std::string settings;
  for (const auto& [key, value] : recording.metadata(recording::kSettingsMetadata))
    settings += " --set " + key + "=" + value;
  std::cout << "extracted to " << folder.string()
            << "; start a node with\n  recon_node --deployment " << deployment->string() << settings
            << " --node NAME\n";
  return 0;
}

int run_info(const InfoOptions& options) {
  if (!options.extract.empty()) return extract(options);
  std::optional<mcap::Recovery> recovery;
  const std::filesystem::path& file = options.output.empty() ? options.file : options.output;
  if (options.recover) recovery = recover(options);
  const recording::Recording recording(file);
  RecordingInfo info = inspect(recording, !options.quick);
  info.being_written = !info.finished() && is_being_written(file);
  if (options.json) {
    auto json = json_of(info);
    if (recovery) json["recovery"] = json_of(*recovery);
    std::cout << json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << "\n";
  } else {
    if (recovery && recovery->was_finished)
      std::cout << file.string() << " is finished and needs no repair\n\n";
    if (recovery && !recovery->was_finished) std::cout << text_of(*recovery, file.string()) << "\n";
    std::cout << text_of(info);
  }
  std::cout << std::flush;
  return info.intact() ? 0 : 1;
}

}  // namespace

void add_info(CLI::App& app, Command& command) {
  auto options = std::make_shared<InfoOptions>();
  CLI::App* info = app.add_subcommand(
      "info", "Show the content of a recording, check it for damage, repair an unfinished one");
  info->footer(
      "Examples:\n"
      "  fivepipe info session.mcap\n"
      "  fivepipe info session.mcap --quick                      reads the index only, for large "
      "files\n"
      "  fivepipe info --recover session.mcap                    repairs in place, after a crash, "
      "a "
      "power cut or a full disk\n"
      "  fivepipe info --recover session.mcap --output repaired.mcap\n"
      "  fivepipe info session.mcap --extract out/configuration  writes the recorded deployment "
      "and its files\n"
      "  fivepipe info session.mcap --json | jq '.topics[].messages'\n\n"
      "Exit codes: 0 finished and undamaged (with --recover: after the repair), 1 unfinished, "
      "damaged "
      "or not a recording, 2 usage error.");
  info->add_option("FILE", options->file, "recording (MCAP)")->required()->check(existing_file());
  CLI::Option* recover =
      info->add_flag("--recover", options->recover,
                     "repair: truncate the incomplete last record, rebuild the index");
  info->add_option("--output", options->output,
                   "with --recover: repair a copy and leave FILE unchanged")
      ->needs(recover);
  CLI::Option* extract =
      info->add_option(
              "--extract", options->extract,
              "write the recorded configuration files (deployment, rig, scene, meshes) to this "
              "new or empty folder")
          ->excludes(recover);
  info->add_flag("--quick", options->quick,
                 "read the index only: shows no MB by topic and checks no CRCs")
      ->excludes(extract);
  info->add_flag("--json", options->json, "print JSON, for programs")->excludes(extract);
  info->callback([options, &command] {
    command = [options] { return base::report_errors([&] { return run_info(*options); }); };
  });
}

}  // namespace fivepipe::launch
