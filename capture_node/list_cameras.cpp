// fivepipe cameras: lists the connected cameras.
#include <CLI/CLI.hpp>
#include <iostream>
#include <nlohmann/json.hpp>

#include "capture_node/cameras/camera_report.h"
#include "capture_node/cameras/genicam_cameras.h"
#include "capture_node/cameras/v4l2_cameras.h"

namespace fivepipe::capture {
namespace {

int run(bool as_json) {
  std::vector<std::string> notes;
  std::vector<ConnectedCamera> cameras = v4l2_cameras("/dev", "/sys");
  for (ConnectedCamera& camera : genicam_cameras("/sys", notes))
    cameras.push_back(std::move(camera));
  if (as_json)
    std::cout
        << report_json(cameras, notes).dump(2, ' ', false, nlohmann::json::error_handler_t::replace)
        << '\n';
  else
    std::cout << report_text(cameras, notes);
  return 0;
}

}  // namespace
}  // namespace fivepipe::capture

int main(int argc, char** argv) {
  bool as_json = false;
  CLI::App app(
      "fivepipe cameras: lists the connected V4L2 and GenICam cameras, as they belong below "
      "`sources` in a deployment, with their modes, and for each USB bus and network interface "
      "the bandwidth that the modes need if all of its cameras use them. Network cameras (RTSP) "
      "are not searched.\n\n"
      "Examples:\n"
      "  fivepipe cameras\n"
      "  fivepipe cameras --json\n\n"
      "Exit codes: 0 listed, also if there is none, 1 failed, 2 usage.");
  app.add_flag("--json", as_json, "print JSON");
  try {
    app.parse(argc, argv);
    return fivepipe::capture::run(as_json);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    return std::cerr << "fivepipe cameras: " << error.what() << '\n', 1;
  }
}
