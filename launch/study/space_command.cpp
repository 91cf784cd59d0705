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
#include "launch/study/spacing_request.h"
#include "launch/units/length.h"

namespace fivepipe::study {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// Processes announce themselves once per second, so discovery takes up to 1 s. A simulation that
// restarts needs longer.
constexpr auto kSimulationTimeout = 5s, kChangeTimeout = 5s;
constexpr auto kRepeat = 500ms;

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

  // Requests the spacing until sim_node has it, several times because sim_node may discover this
  // writer later than the writer discovers it. Returns false after the timeout.
  bool move(const std::string& part, double spacing_m) {
    std::optional<Clock::time_point> asked;
    return wait_until(
        [&] {
          if (this->spacing_m(part) == spacing_m) return true;
          if (!asked || Clock::now() - *asked > kRepeat) {
            request(part, spacing_m);
            asked = Clock::now();
          }
          return false;
        },
        kChangeTimeout);
  }

  // Returns false after the timeout.
  template <class Condition>
  bool wait_until(const Condition& holds, Clock::duration timeout) {
    for (const auto until = Clock::now() + timeout; !holds(); bus_.wait(20ms))
      if (Clock::now() > until) return false;
    return true;
  }

 private:
  void request(const std::string& part, double spacing_m) {
    fivepipe_v1_SpacingRequest message{};
    messages::set_text(message.object, part);
    message.spacing_m = spacing_m;
    requests_.write(message);
  }

  bus::Bus& bus_;
  bus::Reader<bus::topics::ObjectSpacing> spacings_;
  bus::Writer<bus::topics::SpacingRequest> requests_;
  std::map<std::string, double> spacings_m_;
};

using Parts = std::vector<const config::SceneObject*>;

// The part to move, or those whose spacings are printed.
Parts parts_of(const SpaceOptions& options, const config::Scene& scene) {
  if (options.spacing.empty() && options.part.empty()) return movable_parts(scene);
  return {&movable_part(scene, options.part)};
}

int run_space(const SpaceOptions& options) {
  const config::Deployment deployment = launch::deployment_of(options.network);
  const Parts parts = parts_of(options, deployment.scene);
  const config::SceneObject& part = *parts.front();
  if (!options.spacing.empty()) check_spacing_text(options.spacing);
  const launch::JoinedNetwork joined =
      launch::network_from(options.network, security::Role::commands);
  bus::Bus bus(
      {.domain = joined.domain, .network = joined.network, .deployment = joined.deployment});
  SpacingPeer peer(bus);
  if (!peer.wait_until(
          [&] {
            return peer.listens() && std::ranges::all_of(parts, [&](const auto* one) {
                     return peer.spacing_m(one->name).has_value();
                   });
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
  const double before_m = *peer.spacing_m(part.name);
  if (options.spacing.empty()) {
    for (const auto* one : parts)
      std::cout << one->name << ": " << text_of_length(*peer.spacing_m(one->name)) << ", "
                << text_of_range(*one->spacing) << '\n';
    return 0;
  }
  const double wanted_m = requested_spacing_m(options.spacing, before_m, part);
  if (!peer.move(part.name, wanted_m)) {
    std::cerr << fmt::format(
        "{} is still at {}: the simulation applies a spacing in its next frame, and not while a "
        "replay feeds it; `fivepipe top --domain {}` shows whether it handles frames\n",
        part.name, text_of_length(*peer.spacing_m(part.name)), joined.domain);
    return 1;
  }
  std::cout << fmt::format("{}: {} -> {}\n", part.name, text_of_length(before_m),
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
