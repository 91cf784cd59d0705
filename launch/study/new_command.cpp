#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <sstream>

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
  std::vector<std::string> settings, meshes, moves;
};

[[noreturn]] void refuse(const std::string& option, const std::string& text,
                         const std::string& form) {
  throw base::UsageError(option + ": '" + text + "' is not " + form);
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> words;
  std::istringstream in(text);
  for (std::string word; std::getline(in, word, separator);) words.push_back(word);
  return words;
}

// "NAME=FILE" or "NAME=FILE,UNIT"
MeshPart part_from(const std::string& text) {
  const std::size_t equals = text.find('='), comma = text.rfind(',');
  const std::string name = text.substr(0, equals == std::string::npos ? 0 : equals);
  if (name.empty() ||
      name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != std::string::npos)
    refuse("--mesh", text, "NAME=FILE,UNIT with a name of a-z, 0-9 and _: bracket=bracket.stl,mm");
  const bool has_unit = comma != std::string::npos && comma > equals;
  return {name, text.substr(equals + 1, (has_unit ? comma : text.size()) - equals - 1),
          has_unit ? text.substr(comma + 1) : ""};
}

// "NAME,AXIS,AT,FROM,TO": the spacing of one of the parts.
void add_move(const std::string& text, std::vector<MeshPart>& parts) {
  const std::string form = "NAME,AXIS,AT,FROM,TO, such as bracket,z,18cm,10cm,34cm";
  const std::vector<std::string> words = split(text, ',');
  if (words.size() != 5) refuse("--move", text, form);
  const auto part = std::ranges::find(parts, words[0], &MeshPart::name);
  if (part == parts.end())
    throw base::UsageError("--move: no --mesh has the name '" + words[0] + "'");
  const std::size_t axis = std::string("xyz").find(words[1]);
  const auto at = length_m(words[2]), low = length_m(words[3]), high = length_m(words[4]);
  if (words[1].size() != 1 || axis == std::string::npos || !at || !low || !high)
    refuse("--move", text, form);
  part->spacing = {Eigen::Vector3d::Unit(Eigen::Index(axis)), *at, *low, *high};
}

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
  std::vector<MeshPart> parts;
  for (const std::string& mesh : words.meshes) parts.push_back(part_from(mesh));
  for (const std::string& move : words.moves) add_move(move, parts);
  const StudyFolder study = StudyFolder::create(words.folder, settings, parts);
  const config::Deployment deployment = study.deployment();
  std::string sizes;
  for (const config::SceneObject& object : deployment.scene.objects) sizes += text_of(object);
  std::cout << fmt::format("{}: study of the scene {}\n{}", study.path().string(),
                           deployment.scene.name, sizes);
  for (const std::string& warning :
       config::mesh_warnings(deployment.scene, deployment.rig.volume_m))
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
      "  fivepipe study new tongs --deployment payload --set tool=tongs\n"
      "  fivepipe study new bracket --deployment lab.yaml --mesh block=block.glb --mesh "
      "bracket=bracket.stl,mm --move bracket,z,18cm,10cm,34cm\n\n"
      "Exit codes: 0 done, 2 usage or configuration.");
  sub->add_option("folder", words->folder, "folder to make; it must be empty or absent")
      ->required();
  sub->add_option("--deployment", words->deployment,
                  "deployment file, or the name of one that comes with fivepipe")
      ->required();
  sub->add_option("--name", words->name, "title of the report (default: the name of the folder)");
  sub->add_option("--spacing-of", words->spacing_of,
                  "what the spacing is between, for the report's table");
  sub->add_option("--mesh", words->meshes,
                  "NAME=FILE,UNIT: a part, which replaces those of the scene with the others: STEP "
                  "and glTF (.glb) without a unit, OBJ, STL or PLY; mm, cm, m or in")
      ->allow_extra_args(false);
  sub->add_option("--move", words->moves,
                  "NAME,AXIS,AT,FROM,TO: the mesh moves along x, y or z; AT is its spacing now")
      ->allow_extra_args(false);
  launch::add_set_option(sub, words->settings);
  sub->callback([=, &command] { command = [=] { return run_new(*words); }; });
}

}  // namespace fivepipe::study
