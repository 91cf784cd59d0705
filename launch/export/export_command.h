// The command line of fivepipe export.
#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "launch/export/session_export.h"

namespace fivepipe::exports {

class ExportCommand {
 public:
  // Adds the options to `app`, which this object must outlive.
  explicit ExportCommand(CLI::App& app);
  ExportCommand(const ExportCommand&) = delete;
  ExportCommand& operator=(const ExportCommand&) = delete;

  // Exports what the parsed options request, prints a summary and returns the exit code. Throws
  // as export_session().
  int run();

 private:
  ExportRequest request_;
  std::string meshes_, points_, swept_, depth_, view_ = "viewer", cell_ = "4mm",
                                                swept_cell_ = "5mm";
  std::vector<std::string> settings_;
  bool no_colour_ = false;
};

}  // namespace fivepipe::exports
