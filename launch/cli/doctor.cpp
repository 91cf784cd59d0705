#include <ifaddrs.h>
#include <net/if.h>
#include <unistd.h>

#include <fstream>
#include <iostream>

#include "common/base/machine.h"
#include "common/base/version.h"
#include "common/config/yaml/config_error.h"
#include "common/gl/context.h"
#include "common/pipeline/bus/bus.h"
#include "common/pipeline/bus/profile.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"

namespace fivepipe::launch {
namespace {

namespace fs = std::filesystem;

enum class Verdict { ok, warn, fail };
struct Finding {
  Verdict verdict;
  std::string what;
  std::string advice;  // what to do; empty if nothing
};

// The demo has five processes.
constexpr int kDemoCores = 5;
// Enough for the composites of one minute, without recordings.
constexpr double kMinFreeDisk_gb = 1.0;

Finding check_build() {
  const std::string type = base::build_type();
  if (type == "Release") return {Verdict::ok, "build: " + type, ""};
  return {Verdict::warn, "build: " + type + ", many times slower than Release",
          "build with launch/build release"};
}

Finding check_gl() {
  try {
    const gl::GlContext context;
    if (!context.is_software()) return {Verdict::ok, "GL: " + context.renderer(), ""};
    return {Verdict::warn, "GL: " + context.renderer() + ", in software",
            "for speed, install the graphics card's driver with EGL"};
  } catch (const gl::GlError& error) {
    return {Verdict::fail, std::string("GL: ") + error.what(),
            "install EGL: apt-get install libegl1 libgl1-mesa-dri"};
  }
}

Finding check_receive_buffer(const bus::Network& network) {
  const std::size_t granted_bytes = bus::kernel_rmem_max_bytes();
  const bus::FittedProfile fitted = bus::fitted_to_kernel(bus::profile_xml(network), granted_bytes);
  const std::string what =
      "kernel receive buffers: up to " + std::to_string(granted_bytes) + " bytes";
  if (fitted.warning.empty()) return {Verdict::ok, what, ""};
  return {Verdict::warn, what, fitted.warning};
}

Finding check_loopback() {
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return {Verdict::warn, "cannot list the network interfaces", ""};
  bool up = false;
  for (const ifaddrs* i = list; i; i = i->ifa_next)
    up = up || ((i->ifa_flags & IFF_LOOPBACK) && (i->ifa_flags & IFF_UP));
  freeifaddrs(list);
  if (up) return {Verdict::ok, "loopback interface: up", ""};
  return {Verdict::fail, "loopback interface: down", "enable it: ip link set lo up"};
}

Finding check_dds(const JoinedNetwork& options) {
  try {
    const bus::Bus bus({options.domain, options.network});
    return {Verdict::ok,
            "DDS: participant in domain " + std::to_string(options.domain) + " with profile " +
                options.network.profile,
            ""};
  } catch (const bus::BusError& error) {
    return {Verdict::fail, std::string("DDS: ") + error.what(),
            "check the network profile and CYCLONEDDS_URI"};
  }
}

Finding check_cores() {
  const int cores = base::core_count();
  const std::string what = "cores: " + std::to_string(cores) + ", " + base::cpu_name();
  if (cores >= kDemoCores) return {Verdict::ok, what, ""};
  return {Verdict::warn, what,
          "the demo runs five processes; they share these cores, so its frame rate is lower"};
}

// A name under by-id survives a reboot; /dev/videoN may change.
std::vector<Finding> check_cameras() {
  std::vector<Finding> findings;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator("/dev/v4l/by-id", none)) {
    const std::string path = entry.path();
    if (access(path.c_str(), R_OK | W_OK) == 0)
      findings.push_back({Verdict::ok, "camera: " + path, ""});
    else
      findings.push_back({Verdict::warn, "camera: " + path + ": no permission to open it",
                          "run sudo usermod -aG video $USER, then log in again"});
  }
  if (findings.empty())
    findings.push_back({Verdict::ok, "cameras: none at /dev/v4l/by-id (the demo needs none)", ""});
  return findings;
}

Finding check_disk() {
  std::error_code error;
  const fs::space_info space = fs::space(".", error);
  if (error) return {Verdict::warn, "disk: " + error.message(), ""};
  const double free_gb = double(space.available) / 1e9;
  const std::string what =
      "disk: " + std::to_string(long(free_gb)) + " GB free in the working folder";
  if (free_gb >= kMinFreeDisk_gb) return {Verdict::ok, what, ""};
  return {Verdict::warn, what,
          "composites and recordings need space: delete files or choose another --out"};
}

int run_doctor(const NetworkOptions& given) {
  std::vector<Finding> findings = {check_build(), check_gl(), check_loopback(), check_cores(),
                                   check_disk()};
  try {
    const JoinedNetwork joined = network_from(given, security::Role::observer);
    findings.push_back(check_receive_buffer(joined.network));
    findings.push_back(check_dds(joined));
  } catch (const config::ConfigError& error) {
    findings.push_back({Verdict::fail, std::string("network: ") + error.what(), ""});
  }
  for (Finding& camera : check_cameras()) findings.push_back(std::move(camera));
  int failures = 0, warnings = 0;
  for (const Finding& finding : findings) {
    failures += finding.verdict == Verdict::fail;
    warnings += finding.verdict == Verdict::warn;
    std::cout << (finding.verdict == Verdict::ok     ? "ok    "
                  : finding.verdict == Verdict::warn ? "warn  "
                                                     : "FAIL  ")
              << finding.what << '\n';
    if (!finding.advice.empty()) std::cout << "      -> " << finding.advice << '\n';
  }
  std::cout << "fivepipe " << base::version() << " (" << base::commit() << "): " << failures
            << " failed, " << warnings << " warnings\n";
  return failures ? 3 : 0;
}

}  // namespace

void add_doctor(CLI::App& app, Command& command) {
  auto options = std::make_shared<NetworkOptions>();
  CLI::App* doctor = app.add_subcommand(
      "doctor", "Check whether this machine is ready and print how to fix what is not");
  doctor->footer(
      "Example:\n  fivepipe doctor\n\n"
      "Exit codes: 0 ready, possibly with warnings; 3 something required is missing.");
  add_network_options(doctor, *options);
  add_deployment_options(doctor, *options);
  doctor->callback([options, &command] { command = [options] { return run_doctor(*options); }; });
}

}  // namespace fivepipe::launch
