#include <ifaddrs.h>
#include <net/if.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <fstream>
#include <iostream>
#include <iterator>
#include <optional>

#include "common/base/machine.h"
#include "common/base/network/network_interfaces.h"
#include "common/base/version.h"
#include "common/config/yaml/config_error.h"
#include "common/gl/context.h"
#include "common/pipeline/bus/bus.h"
#include "common/pipeline/bus/profile.h"
#include "common/pipeline/node/deployment_network.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"
#include "launch/doctor/disk_rate.h"
#include "launch/doctor/finding.h"
#include "launch/doctor/host_findings.h"
#include "launch/doctor/interface_findings.h"
#include "launch/doctor/security_findings.h"
#include "launch/supervise/interrupt.h"
#include "launch/supervise/own_files.h"

namespace fivepipe::launch {
namespace {

namespace fs = std::filesystem;

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

constexpr double kWait_s = 5;  // without --wait, until the other hosts have answered

struct DoctorOptions {
  NetworkOptions network;
  std::optional<double> wait_s;
};

void append(std::vector<Finding>& findings, std::vector<Finding> more) {
  std::ranges::move(more, std::back_inserter(findings));
}

// The checks that a deployment needs.
std::vector<Finding> check_deployment(const DoctorOptions& options, const JoinedNetwork& joined) {
  const config::Deployment deployment = deployment_of(options.network);
  std::vector<Finding> findings = {check_disk_rate(deployment)};
  if (options.network.local || deployment.hosts.size() < 2) return findings;
  const config::Host& own_host =
      config::own_host(deployment.hosts, options.network.host, deployment.file);
  const std::string& own = own_host.name;
  append(findings, interface_findings(own_host, deployment.hosts,
                                      base::find_interface(joined.network.interface).name,
                                      base::network_interfaces(), base::route_interface));
  append(findings, check_machines(deployment, own));
  if (deployment.security && role_of_doctor(deployment) != kComparingRole) {
    findings.push_back({Verdict::warn, "clocks and files are not compared with the other hosts",
                        std::string("that needs the keys of the role ") + name_of(kComparingRole)});
    return findings;
  }
  const double wait_s = options.wait_s.value_or(
      kWait_s + std::chrono::duration<double>(bus::authentication_time(joined.network)).count());
  std::cerr << "comparing with the other hosts, for at most " << wait_s << " s\n";
  catch_signals();
  bus::Bus bus({joined.domain, joined.network, "doctor", joined.deployment});
  append(findings,
         compare_hosts(bus, deployment, own, std::chrono::milliseconds(std::int64_t(1e3 * wait_s)),
                       [] { return signals_received() > 0; }));
  return findings;
}

int run_doctor(const DoctorOptions& options) {
  std::vector<Finding> findings = {check_build(), check_gl(), check_loopback(), check_cores(),
                                   check_disk()};
  try {
    security::Role role = security::Role::observer;
    if (!options.network.deployment.empty()) {
      const config::Deployment deployment = deployment_of(options.network);
      role = role_of_doctor(deployment);
      if (options.network.local)
        findings.push_back({Verdict::ok, "security: off with --local", ""});
      else
        append(findings, check_security(deployment, domain_of(options.network, deployment),
                                        options.network.host, std::time(nullptr)));
    }
    const JoinedNetwork joined = network_from(options.network, role);
    findings.push_back(check_receive_buffer(joined.network));
    findings.push_back(check_dds(joined));
    if (!options.network.deployment.empty() && findings.back().verdict != Verdict::fail)
      append(findings, check_deployment(options, joined));
  } catch (const config::ConfigError& error) {
    findings.push_back({Verdict::fail, std::string("network: ") + error.what(), ""});
  } catch (const bus::BusError& error) {
    findings.push_back({Verdict::fail, std::string("DDS: ") + error.what(), ""});
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
  auto options = std::make_shared<DoctorOptions>();
  CLI::App* doctor = app.add_subcommand(
      "doctor", "Check whether this machine is ready and print how to fix what is not");
  doctor->footer(
      "Examples:\n"
      "  fivepipe doctor\n"
      "  fivepipe doctor --deployment lab.yaml --wait 60   on each host of the deployment, within\n"
      "                                                    a minute\n\n"
      "With a deployment it also checks whether the disk is fast enough for its recording and, if\n"
      "it has several hosts, whether the other machines answer, which packets reach them, how far\n"
      "the clocks are apart (warning above 2 ms, failure above 20 ms), and whether versions and\n"
      "files are the same. In a secured deployment it lists the keys of this machine with their "
      "expiry.\n\n"
      "Exit codes: 0 ready, possibly with warnings; 3 something required is missing.");
  add_network_options(doctor, options->network);
  add_deployment_options(doctor, options->network);
  doctor
      ->add_option("--wait", options->wait_s,
                   "seconds to wait for `fivepipe doctor` or `fivepipe up` on the other hosts\n"
                   "(default 5; 6.5 in a secured deployment)")
      ->check(CLI::Range(0.0, 3600.0));
  doctor->callback([options, &command] { command = [options] { return run_doctor(*options); }; });
}

}  // namespace fivepipe::launch
