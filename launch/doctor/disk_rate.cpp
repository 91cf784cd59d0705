#include "launch/doctor/disk_rate.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <string>
#include <system_error>
#include <vector>

#include "common/base/timing.h"

namespace fivepipe::launch {
namespace {

constexpr double kUsualCoverage = 0.15;  // of the paper's and the demo's images, at most
constexpr std::size_t kBlock = 4 << 20, kMaxBytes = 256 << 20;
// A map packs a pixel into a bit. A colour has three bytes; a tile has a depth as well.
constexpr double kMapBytes = 1.0 / 8, kColourBytes = 3, kTileBytes = 7;

[[noreturn]] void fail(const std::filesystem::path& file) {
  throw std::filesystem::filesystem_error("cannot write", file,
                                          std::error_code(errno, std::generic_category()));
}

}  // namespace

double recording_rate(const config::Deployment& deployment, double covered) {
  double bytes = 0;
  for (const config::RigCamera& camera : deployment.rig.cameras) {
    const double pixels = double(camera.published.width_px) * camera.published.height_px;
    if (camera.gives_shape) bytes += pixels * kMapBytes;
    if (camera.gives_colour) bytes += pixels * covered * (kColourBytes + kMapBytes);
  }
  std::vector<config::Viewer> viewers = config::spectators_of(deployment);
  viewers.push_back(deployment.viewer);
  for (const config::Viewer& viewer : viewers)
    bytes += double(viewer.recon_width_px) * viewer.recon_height_px *
             double(config::eye_positions_m(viewer).size()) * covered * kTileBytes;
  return bytes * deployment.frame_rate_hz;
}

double write_rate(const std::filesystem::path& folder) {
  std::string name = (folder / "fivepipe_doctor_XXXXXX").string();
  const int file = mkstemp(name.data());
  if (file < 0) fail(folder);
  const std::vector<char> block(kBlock, '\x5a');
  const auto start = std::chrono::steady_clock::now();
  std::size_t written = 0;
  bool failed = false;
  while (!failed && written < kMaxBytes && base::seconds_since(start) < kMaxWriteTime_s) {
    failed =
        write(file, block.data(), block.size()) != ssize_t(block.size()) || fdatasync(file) != 0;
    written += block.size();
  }
  const int error = errno;
  const double took_s = base::seconds_since(start);
  close(file);
  unlink(name.c_str());
  errno = error;
  if (failed) fail(folder);
  return double(written) / took_s;
}

Finding disk_rate_finding(const config::Deployment& deployment, double rate) {
  const double usual = recording_rate(deployment, kUsualCoverage),
               most = recording_rate(deployment, 1);
  const std::string what = fmt::format(
      "disk: writes {:.0f} MB/s in the working folder; a recording of {} needs {:.1f} MB/s with "
      "objects on {:.0f} % of the pixels, and {:.1f} MB/s at most",
      1e-6 * rate, deployment.name, 1e-6 * usual, 100 * kUsualCoverage, 1e-6 * most);
  if (rate >= usual) return {Verdict::ok, what, ""};
  return {Verdict::warn, what,
          "record on a faster disk, or leave out images: --record-option=--no-colour"};
}

Finding check_disk_rate(const config::Deployment& deployment) {
  try {
    return disk_rate_finding(deployment, write_rate("."));
  } catch (const std::filesystem::filesystem_error& error) {
    return {Verdict::warn, std::string("disk: ") + error.what(), "change to a folder of your own"};
  }
}

}  // namespace fivepipe::launch
