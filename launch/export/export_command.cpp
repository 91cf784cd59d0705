#include "launch/export/export_command.h"

#include <algorithm>
#include <iostream>
#include <thread>

#include "common/base/process/progress_line.h"
#include "common/base/usage_error.h"
#include "launch/units/length.h"

namespace fivepipe::exports {
namespace {

const std::vector<std::string> kMeshFormats = {"ply", "obj", "stl", "glb"};
constexpr double kMinCell_m = 1e-4, kMaxCell_m = 1;

double cell_from(const std::string& option, const std::string& text) {
  const auto length_m = study::length_m(text);
  if (!length_m)
    throw base::UsageError(option + ": '" + text +
                           "' is no length; write a number and its unit, such as 4mm or 0.5cm");
  if (!(*length_m >= kMinCell_m && *length_m <= kMaxCell_m))
    throw base::UsageError(option + ": '" + text + "' is not between 0.1mm and 1m");
  return *length_m;
}

}  // namespace

ExportCommand::ExportCommand(CLI::App& app) {
  request_.threads = std::max(1, int(std::thread::hardware_concurrency()));
  app.description(
      "fivepipe export: writes the real objects of a recording as files of other programs: closed "
      "meshes, points, volumes, tracked components, depth, and the volume that they sweep.");
  app.footer(
      "Examples:\n"
      "  fivepipe export session.mcap --out out/export --meshes ply --volumes\n"
      "  fivepipe export session.mcap --out out/swept --swept glb\n"
      "  fivepipe export session.mcap --out out/parts --points glb --components --start 2 --end 5\n"
      "  fivepipe export session.mcap --out out/depth --depth png --view viewer --every 10\n"
      "  fivepipe export session.mcap --out out/video --composites\n\n"
      "Exit codes: 0 done, 1 the recording cannot be used or a file not written, 2 usage or "
      "configuration.");
  app.add_option("recording", request_.recording, "recording with object-pixel maps (.mcap)")
      ->required();
  app.add_option("--out", request_.folder, "folder of the files; it must be empty or absent")
      ->required();
  const CLI::IsMember mesh_format(kMeshFormats);
  app.add_option("--meshes", meshes_, "the hull of each frame as a closed mesh: ply, obj, stl, glb")
      ->check(mesh_format);
  app.add_option("--points", points_, "points of the hull's surface of each frame: ply, obj, glb")
      ->check(CLI::IsMember({"ply", "obj", "glb"}));
  app.add_flag("--volumes", request_.volumes,
               "volume and surface of each frame, in frames.csv; --meshes and --points write it, "
               "too");
  app.add_flag("--components", request_.components,
               "connected parts of the hull, tracked from frame to frame, in components.csv");
  app.add_option("--depth", depth_,
                 "depth of the hull in each frame: png (16 bits, millimetres) or exr (metres)")
      ->check(CLI::IsMember({"png", "exr"}));
  app.add_option("--view", view_,
                 "whose depth: viewer (the recorded head pose) or a camera of the rig (default "
                 "viewer)");
  app.add_option("--swept", swept_,
                 "the volume that the hulls of all frames sweep, as one closed mesh that contains "
                 "them: ply, obj, stl, glb")
      ->check(mesh_format);
  app.add_flag(
      "--composites", request_.composites,
      "what the recorded render_node shows, as a video; starts that node, takes as long as "
      "the session, and needs recorded colour");
  app.add_option("--start", request_.start_s, "first frame: seconds since the first one");
  app.add_option("--end", request_.end_s, "last frame: seconds since the first one");
  app.add_option("--every", request_.every, "exports every n-th frame (default 1)")
      ->check(CLI::Range(1, 1'000'000));
  app.add_option("--cell", cell_,
                 "distance between the points at which the hull is sampled for meshes, points and "
                 "volumes (default 4mm)");
  app.add_option("--swept-cell", swept_cell_, "cells of the swept volume (default 5mm)");
  app.add_flag("--no-colour", no_colour_, "meshes and points without the recorded colour");
  app.add_option("--threads", request_.threads, "threads (default: one per core)")
      ->check(CLI::Range(1, 1024));
  app.add_option("--set", settings_, "KEY=VALUE: a setting of the recorded deployment")
      ->allow_extra_args(false);
}

int ExportCommand::run() {
  for (const std::string& word : settings_) {
    const auto equals = word.find('=');
    if (equals == std::string::npos || equals == 0)
      throw base::UsageError("--set: expected KEY=VALUE, got " + word);
    request_.settings[word.substr(0, equals)] = word.substr(equals + 1);
  }
  request_.meshes = surface::mesh_format_from(meshes_);
  request_.points = surface::mesh_format_from(points_);
  request_.swept = surface::mesh_format_from(swept_);
  request_.depth = depth_format_from(depth_);
  request_.camera = view_ == "viewer" ? "" : view_;
  request_.colour = !no_colour_;
  request_.cell_m = cell_from("--cell", cell_);
  request_.swept_cell_m = cell_from("--swept-cell", swept_cell_);
  ExportSummary summary;
  {
    base::ProgressLine progress("export");
    summary = export_session(request_, std::ref(progress));
  }
  std::cout << text_of(request_, summary);
  return 0;
}

}  // namespace fivepipe::exports
