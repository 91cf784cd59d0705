#include <fmt/format.h>

#include <iostream>

#include "common/base/usage_error.h"
#include "launch/cli/options.h"
#include "launch/study/commands.h"
#include "launch/study/folder/study_folder.h"
#include "launch/supervise/own_files.h"
#include "launch/units/length.h"

namespace fivepipe::study {
namespace {

struct NewWords {
  std::filesystem::path folder;
  std::string deployment, name, spacing_of;
  std::vector<std::string> settings;
};

// "payload_a        36.0 x 30.0 x 20.0 cm, moves along 0,0,1: 18.0 cm (10.0 to 40.0 cm)"
std::string text_of(const config::SceneObject& object) {
  const Eigen::Vector3d size_m = geometry::bounds_m(config::mesh_of(object)).sizes();
  std::string text = fmt::format("  {:<24} {:.1f} x {:.1f} x {:.1f} cm", object.name,
                                 100 * size_m.x(), 100 * size_m.y(), 100 * size_m.z());
  if (object.spacing)
    text +=
        fmt::format(", moves along {:g},{:g},{:g}: {} ({} to {})", object.spacing->axis_world.x(),
                    object.spacing->axis_world.y(), object.spacing->axis_world.z(),
                    text_of_length(object.spacing->at_m), text_of_length(object.spacing->low_m),
                    text_of_length(object.spacing->high_m));
  return text + '\n';
}

int run_new(const NewWords& words) {
  StudySettings settings{words.name, launch::deployment_file(words.deployment),
                         launch::settings_from(words.settings), words.spacing_of};
  if (settings.name.empty()) settings.name = words.folder.filename().string();
  const StudyFolder study = StudyFolder::create(words.folder, settings);
  const config::Deployment deployment = study.deployment();
  std::string parts;
  for (const config::SceneObject& object : deployment.scene.objects) parts += text_of(object);
  std::cout << fmt::format("{}: study of the scene {}\n{}", study.path().string(),
                           deployment.scene.name, parts);
  for (const std::string& warning : config::mesh_warnings(deployment.scene))
    std::cout << "warning: " << warning << '\n';
  if (!config::has_spacings(deployment.scene))
    std::cout << "No part can be moved: give one a `spacing` in the scene file.\n";
  std::cout << fmt::format("Next: fivepipe study run {} --participant P1\n", study.path().string());
  return 0;
}

}  // namespace

void add_new(CLI::App& app, Command& command) {
  const auto words = std::make_shared<NewWords>();
  CLI::App* const sub = app.add_subcommand(
      "new", "Makes the folder of a study, with a copy of its deployment, and prints the parts");
  sub->footer(
      "Examples:\n"
      "  fivepipe study new spacing --deployment payload --spacing-of \"payload A and PMT box\"\n"
      "  fivepipe study new tongs --deployment payload --set tool=tongs\n\n"
      "Exit codes: 0 done, 2 usage or configuration.");
  sub->add_option("folder", words->folder, "folder to make; it must be empty or absent")
      ->required();
  sub->add_option("--deployment", words->deployment,
                  "deployment file, or the name of one that comes with fivepipe")
      ->required();
  sub->add_option("--name", words->name, "title of the report (default: the name of the folder)");
  sub->add_option("--spacing-of", words->spacing_of,
                  "what the spacing is between, for the report's table");
  launch::add_set_option(sub, words->settings);
  sub->callback([=, &command] { command = [=] { return run_new(*words); }; });
}

}  // namespace fivepipe::study
