#include <algorithm>
#include <ctime>
#include <iostream>
#include <optional>

#include "common/config/deployment.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"
#include "launch/keys/make_keys.h"

namespace fivepipe::launch {
namespace {

const std::map<std::string, security::Protection> kProtections = {
    {"sign", security::Protection::sign}, {"encrypt", security::Protection::encrypt}};

struct KeysOptions {
  std::string deployment, protection;
  std::vector<std::string> settings;
  int days = 365;
  bool force = false;
};

int run_keys(const KeysOptions& options) {
  const config::Deployment deployment =
      config::load_deployment(deployment_file(options.deployment), settings_from(options.settings));
  if (!deployment.security)
    throw config::ConfigError({{deployment.file, 0, 0,
                                "the deployment has no security; add the line  security: {keys: "
                                "keys}  with the folder for its keys"}});
  const std::filesystem::path& folder = deployment.security->keys;
  const keys::MadeKeys made =
      keys::make_keys({.folder = folder,
                       .deployment = deployment.name,
                       .domain = deployment.domain,
                       .protection = options.protection.empty()
                                         ? std::nullopt
                                         : std::optional(kProtections.at(options.protection)),
                       .days = options.days,
                       .new_ca = options.force,
                       .now_s = std::time(nullptr)});
  std::cout << (made.made_ca ? "made" : "kept") << " the CA in " << (folder / "ca").string()
            << "; keep it where the keys are made, no other machine needs it\n"
            << "made the keys of " << security::kRoles.size() << " roles in " << folder.string()
            << " for domain " << deployment.domain << ", valid until "
            << security::utc_text(made.until_s) << ": messages are "
            << security::participle_of(made.protection) << '\n'
            << "copy the folder of each role to the machines of its programs:\n";
  for (const security::Role role : security::kRoles)
    std::cout << "  " << (folder / name_of(role)).string() << '\n';
  return 0;
}

}  // namespace

void add_keys(CLI::App& app, Command& command) {
  auto options = std::make_shared<KeysOptions>();
  CLI::App* keys = app.add_subcommand(
      "keys", "Make the keys of a deployment whose file has `security: {keys: FOLDER}`");
  keys->footer(
      "Makes a certificate authority (CA) and, for each role, a folder with its private key,\n"
      "its certificate and its permissions. Run it again before the keys expire: it keeps the CA,\n"
      "so machines with old and with new keys work together until the old ones expire.\n\n"
      "Examples:\n"
      "  fivepipe keys lab.yaml\n"
      "  fivepipe keys lab.yaml --protection sign --days 90\n"
      "  fivepipe doctor --deployment lab.yaml        shows when the keys of this machine "
      "expire\n\n"
      "Exit codes: 0 done, 1 a file cannot be read or written, 2 usage or configuration.");
  keys->add_option("DEPLOYMENT", options->deployment, "deployment file (YAML)")->required();
  add_set_option(keys, options->settings);
  keys->add_option("--protection", options->protection,
                   "sign messages, or also encrypt them (default: as the existing keys; encrypt "
                   "without any). Keys of both kinds do not work together")
      ->check(CLI::IsMember(kProtections));
  keys->add_option("--days", options->days, "days for which the keys are valid")
      ->check(CLI::Range(1, keys::kCaDays))
      ->capture_default_str();
  keys->add_flag("--force", options->force,
                 "make a new CA, so that all existing keys become invalid");
  keys->callback([options, &command] { command = [options] { return run_keys(*options); }; });
}

}  // namespace fivepipe::launch
