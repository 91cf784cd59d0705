#include <fmt/format.h>

#include <iostream>

#include "common/base/text_table.h"
#include "common/base/usage_error.h"
#include "common/geometry/rigid_alignment.h"
#include "launch/study/commands.h"
#include "launch/study/folder/scene_pose.h"
#include "launch/study/folder/study_folder.h"
#include "launch/study/folder/study_lock.h"
#include "launch/units/length.h"

namespace fivepipe::study {
namespace {

struct RegisterOptions {
  std::filesystem::path folder;
  std::string part;
  std::vector<std::string> pairs;
  bool only_shows = false;
};

// "1cm,0cm,-2mm"
Eigen::Vector3d point_from(const std::string& text, const std::string& pair) {
  Eigen::Vector3d point_m;
  std::size_t from = 0;
  for (int i = 0; i < 3; ++i) {
    const std::size_t comma = text.find(',', from);
    const auto length = length_m(text.substr(from, comma - from));
    if (!length || (comma == std::string::npos) != (i == 2))
      throw base::UsageError(
          "--pair: '" + pair +
          "' is not X,Y,Z=X,Y,Z with units, such as 0cm,0cm,16cm=12.1cm,3cm,16cm");
    point_m[i] = *length;
    from = comma + 1;
  }
  return point_m;
}

int run_register(const RegisterOptions& options) {
  const StudyFolder study(options.folder);
  std::optional<StudyLock> lock;
  if (!options.only_shows) lock.emplace(study.path(), "register", kWholeStudy);
  const config::Deployment deployment = study.deployment();
  if (std::ranges::none_of(deployment.scene.objects,
                           [&](const auto& object) { return object.name == options.part; }))
    throw base::UsageError("the scene " + deployment.scene.name + " has no part '" + options.part +
                           "'");
  std::vector<Eigen::Vector3d> in_part_m, in_world_m;
  for (const std::string& pair : options.pairs) {
    const std::size_t equals = pair.find('=');
    if (equals == std::string::npos) point_from("", pair);
    in_part_m.push_back(point_from(pair.substr(0, equals), pair));
    in_world_m.push_back(point_from(pair.substr(equals + 1), pair));
  }
  geometry::RigidAlignment found;
  try {
    found = geometry::align_points(in_part_m, in_world_m);
  } catch (const std::invalid_argument& error) {
    throw base::UsageError(std::string("--pair: ") + error.what());
  }
  base::TextTable table({{"pair"}, {"residual", true}});
  for (std::size_t i = 0; i < options.pairs.size(); ++i)
    table.add(
        {base::printable(options.pairs[i]), fmt::format("{:.2f} mm", 1e3 * found.residuals_m[i])});
  const auto [position_m, rotation_deg] = scene_pose(found.to_from);
  std::cout << table.text()
            << fmt::format("RMS {:.2f} mm\n{}:\n  position_m: {}\n  rotation_deg: {}\n",
                           1e3 * found.rms_m, options.part, yaml_of(position_m),
                           yaml_of(rotation_deg));
  if (options.pairs.size() == 3)
    std::cout
        << "Three points leave the residual small even if one is wrong: touch a fourth one.\n";
  if (options.only_shows) return 0;
  std::cout << write_pose(study, options.part, found.to_from).string() << " is changed\n";
  return 0;
}

}  // namespace

void add_register(CLI::App& app, Command& command) {
  const auto options = std::make_shared<RegisterOptions>();
  CLI::App* const sub = app.add_subcommand(
      "register",
      "Aligns a virtual part with its real fixture from three or more touched points, prints the "
      "residual, and writes the pose to the study's scene");
  sub->footer(
      "Example:\n"
      "  fivepipe study register spacing --part pmt_box --pair 0cm,0cm,16cm=1.2cm,-3cm,16.1cm "
      "--pair 13cm,0cm,16cm=14.1cm,-2.8cm,16cm --pair 0cm,13cm,16cm=1cm,10cm,16cm\n\n"
      "Exit codes: 0 done, 2 usage or configuration.");
  sub->add_option("folder", options->folder, "folder of the study")->required();
  sub->add_option("--part", options->part, "object of the study's scene")->required();
  sub->add_option("--pair", options->pairs,
                  "a point in the part's frame, '=', and where it was touched in the world frame")
      ->required()
      ->allow_extra_args(false);
  sub->add_flag("--show", options->only_shows, "prints the pose and changes nothing");
  sub->callback([=, &command] { command = [=] { return run_register(*options); }; });
}

}  // namespace fivepipe::study
