#include <fcntl.h>
#include <unistd.h>

#include <csignal>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/base/usage_error.h"
#include "launch/cli/commands.h"
#include "launch/inspect/recording_info.h"

namespace fivepipe::launch {
namespace {

struct InfoOptions {
  std::filesystem::path file, output;
  bool recover = false, quick = false, json = false;
};

// By another process, or this one. False where the file system can't tell.
bool is_being_written(const std::filesystem::path& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  // A lease to read is refused while anybody has the file open for writing. Who opens it meanwhile
  // breaks the lease, of which nothing is to come.
  fcntl(file, F_SETSIG, SIGURG);
  const bool refused = fcntl(file, F_SETLEASE, F_RDLCK) != 0 && errno == EAGAIN;
  close(file);
  return refused;
}

// The file that was mended: the copy, where there is one.
mcap::Recovery recover(const InfoOptions& options) {
  if (options.output.empty()) {
    if (is_being_written(options.file))
      throw base::UsageError(options.file.string() +
                             " is being written now: wait until its recorder has ended, or mend a "
                             "copy with --output FILE");
    return mcap::recover(options.file);
  }
  if (std::filesystem::exists(options.output))
    throw base::UsageError(options.output.string() + " is there already; choose another --output");
  return mcap::recover(options.file, options.output);
}

int run_info(const InfoOptions& options) {
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
      std::cout << file.string() << " was finished: there was nothing to mend\n\n";
    if (recovery && !recovery->was_finished) std::cout << text_of(*recovery, file.string()) << "\n";
    std::cout << text_of(info);
  }
  std::cout << std::flush;
  return info.whole() ? 0 : 1;
}

}  // namespace

void add_info(CLI::App& app, Command& command) {
  auto options = std::make_shared<InfoOptions>();
  CLI::App* info = app.add_subcommand(
      "info",
      "Tell what a recording holds, and whether it is whole; mend one that was not finished");
  info->footer(
      "Examples:\n"
      "  fivepipe info session.mcap\n"
      "  fivepipe info session.mcap --quick                      by its index alone, for large "
      "files\n"
      "  fivepipe info --recover session.mcap                    mends it in place: after a crash, "
      "a power cut, a full disk\n"
      "  fivepipe info --recover session.mcap --output mended.mcap\n"
      "  fivepipe info session.mcap --json | jq '.topics[].messages'\n\n"
      "Exit codes: 0 whole (and mended, with --recover), 1 not finished, damaged, or no recording, "
      "2 usage.");
  info->add_option("FILE", options->file, "recording (MCAP)")->required()->check(CLI::ExistingFile);
  CLI::Option* recover =
      info->add_flag("--recover", options->recover,
                     "mend it: cut off what is no whole record, write the index anew");
  info->add_option("--output", options->output,
                   "with --recover: mend a copy, and leave FILE as it is")
      ->needs(recover);
  info->add_flag("--quick", options->quick,
                 "don't read the messages: neither MB by topic, nor are CRCs checked");
  info->add_flag("--json", options->json, "for programs");
  info->callback([options, &command] {
    command = [options] { return base::report_errors([&] { return run_info(*options); }); };
  });
}

}  // namespace fivepipe::launch
