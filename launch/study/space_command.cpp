#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <map>
#include <optional>

#include "common/base/usage_error.h"
#include "common/pipeline/bus/bus.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "launch/cli/options.h"
#include "launch/study/commands.h"
#include "launch/study/length.h"
#include "launch/study/spacing_request.h"

namespace fivepipe::study {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// Processes announce themselves once per second, so discovery takes up to 1 s. A simulation that
// restarts needs longer.
constexpr auto kSimulationTimeout = 5s, kChangeTimeout = 5s;

struct SpaceOptions {
  std::string spacing, part;
  launch::NetworkOptions network;
};

// The spacings that the sim_node of the deployment has, and requests to it.
class SpacingPeer {
 public:
  SpacingPeer(bus::Bus& bus)
      : bus_(bus),
        spacings_(bus.reader<bus::topics::ObjectSpacing>()),
        requests_(bus.writer<bus::topics::SpacingRequest>()) {}

  bool listens() const { return requests_.readers() > 0; }

  // Returns nullopt before sim_node has reported it.
  std::optional<double> spacing_m(const std::string& part) {
    for (const auto& sample : spacings_.take())
      if (sample.valid()) spacings_m_[sample->object] = sample->spacing_m;
    const auto known = spacings_m_.find(part);
    return known == spacings_m_.end() ? std::nullopt : std::optional(known->second);
  }

  void request(const std::string& part, double spacing_m) {
    fivepipe_v1_SpacingRequest message{};
    messages::set_text(message.object, part);
    message.spacing_m = spacing_m;
    requests_.write(message);
  }

  // Returns false after the timeout.
  template <class Condition>
  bool wait_until(const Condition& holds, Clock::duration timeout) {
    for (const auto until = Clock::now() + timeout; !holds(); bus_.wait(20ms))
      if (Clock::now() > until) return false;
    return true;
  }

 private:
  bus::Bus& bus_;
  bus::Reader<bus::topics::ObjectSpacing> spacings_;
  bus::Writer<bus::topics::SpacingRequest> requests_;
  std::map<std::string, double> spacings_m_;
};

void print_spacings(SpacingPeer& peer, const config::Scene& scene) {
  for (const config::SceneObject& object : scene.objects)
    if (const auto spacing_m = peer.spacing_m(object.name); object.spacing && spacing_m)
      std::cout << object.name << ": " << text_of_length(*spacing_m) << ", "
                << text_of_range(*object.spacing) << '\n';
}

int run_space(const SpaceOptions& options) {
  const config::Deployment deployment = launch::deployment_of(options.network);
  const config::SceneObject& part = movable_part(deployment.scene, options.part);
  if (!options.spacing.empty()) check_spacing_text(options.spacing);
  const launch::JoinedNetwork joined =
      launch::network_from(options.network, security::Role::commands);
  bus::Bus bus(
      {.domain = joined.domain, .network = joined.network, .deployment = joined.deployment});
  SpacingPeer peer(bus);
  std::optional<double> before_m;
  if (!peer.wait_until(
          [&] {
            before_m = peer.spacing_m(part.name);
            return before_m && peer.listens();
          },
          kSimulationTimeout + bus::authentication_time(joined.network))) {
    const std::string why = bus.why_not_admitted();
    std::cerr << fmt::format(
        "no sim_node of deployment '{}' reports a spacing of {} in domain {}{}\n",
        joined.deployment, part.name, joined.domain,
        !why.empty() ? "; " + why
                     : fmt::format(": start the deployment, wait for its first frame, or select "
                                   "another domain by --domain; `fivepipe top --domain {}` lists "
                                   "the running nodes",
                                   joined.domain));
    return 3;
  }
  if (options.spacing.empty()) return print_spacings(peer, deployment.scene), 0;
  const double wanted_m = requested_spacing_m(options.spacing, *before_m, part);
  peer.request(part.name, wanted_m);
  if (!peer.wait_until([&] { return peer.spacing_m(part.name) == wanted_m; }, kChangeTimeout)) {
    std::cerr << fmt::format(
        "{} is still at {}: the simulation applies a spacing in its next frame, and not while a "
        "replay feeds it; `fivepipe top --domain {}` shows whether it handles frames\n",
        part.name, text_of_length(*peer.spacing_m(part.name)), joined.domain);
    return 1;
  }
  std::cout << fmt::format("{}: {} -> {}\n", part.name, text_of_length(*before_m),
                           text_of_length(wanted_m));
  return 0;
}

}  // namespace

void add_space(CLI::App& app, Command& command) {
  const auto options = std::make_shared<SpaceOptions>();
  CLI::App* const sub = app.add_subcommand(
      "space",
      "Moves a part of the running scene to another spacing, within the range that the scene "
      "permits; without SPACING prints the present ones");
  sub->footer(
      "Examples:\n"
      "  fivepipe study space 18cm --deployment payload.yaml\n"
      "  fivepipe study space +5mm --part payload_a --deployment payload.yaml --domain 7\n\n"
      "Exit codes: 0 the simulation has moved the part, 1 it has not within 5 s, 2 usage or "
      "configuration, 3 no sim_node of the deployment reports the part's spacing.");
  sub->add_option("spacing", options->spacing,
                  "new spacing with its unit: 18cm; with a sign a step from the present one: +5mm, "
                  "-1cm; =-3cm is a negative spacing");
  sub->add_option("--part", options->part,
                  "object of the scene with `spacing` (default: the only one)");
  launch::add_network_options(sub, options->network);
  launch::add_deployment_options(sub, options->network);
  sub->get_option("--deployment")->required();
  sub->callback([=, &command] { command = [=] { return run_space(*options); }; });
}

}  // namespace fivepipe::study
