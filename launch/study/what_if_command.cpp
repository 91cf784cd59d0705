#include <cmath>
#include <cstdio>
#include <iostream>
#include <thread>

#include "common/base/process/progress_line.h"
#include "common/base/result_file.h"
#include "common/base/usage_error.h"
#include "launch/study/commands.h"
#include "launch/study/what_if.h"
#include "launch/units/length.h"

namespace fivepipe::study {
namespace {

struct Words {
  std::string range, at, axis;  // empty: that of the scene
  std::vector<std::string> settings;
  std::filesystem::path csv, json;
  bool verdicts_only = false;
};

constexpr double kMaxLength_m = 500;

double length_from(const std::string& option, const std::string& text) {
  if (const auto length = length_m(text)) {
    if (std::abs(*length) <= kMaxLength_m) return *length;
    throw base::UsageError(option + ": '" + text + "' is longer than 500 m");
  }
  throw base::UsageError(option + ": '" + text +
                         "' is no length; write a number and its unit, such as 18cm, 180mm, 0.18m "
                         "or 7in");
}

collision::SpacingInterval range_from(const std::string& text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos)
    throw base::UsageError("--range: write FROM:TO, such as 14cm:30cm, not '" + text + "'");
  const collision::SpacingInterval range{length_from("--range", text.substr(0, colon)),
                                         length_from("--range", text.substr(colon + 1))};
  if (range.low_m > range.high_m)
    throw base::UsageError("--range: " + text + " begins after its end");
  return range;
}

Eigen::Vector3d axis_from(const std::string& text) {
  for (int i = 0; i < 3; ++i)
    for (const double sign : {1.0, -1.0})
      if (text == (sign < 0 ? "-" : "") + std::string(1, char('x' + i)))
        return sign * Eigen::Vector3d::Unit(i);
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  char rest = 0;
  if (std::sscanf(text.c_str(), "%lf,%lf,%lf%c", &axis.x(), &axis.y(), &axis.z(), &rest) == 3 &&
      axis.allFinite() && axis.norm() > 0)
    return axis.normalized();
  throw base::UsageError("--axis: '" + text + "' is none of x, y, z, -x, -y, -z and DX,DY,DZ");
}

int run_what_if(WhatIfOptions options, const Words& words) {
  for (const std::string& word : words.settings) {
    const auto equals = word.find('=');
    if (equals == std::string::npos || equals == 0)
      throw base::UsageError("--set: expected KEY=VALUE, got " + word);
    options.settings[word.substr(0, equals)] = word.substr(equals + 1);
  }
  options.axis_of_scene = words.axis.empty();
  options.at_of_scene = words.at.empty();
  options.range_of_scene = words.range.empty();
  if (!options.axis_of_scene) options.axis_world = axis_from(words.axis);
  if (!options.range_of_scene) options.range = range_from(words.range);
  if (!options.at_of_scene) options.at_m = length_from("--at", words.at);
  options.with_distances = !words.verdicts_only;
  WhatIf found;
  {
    base::ProgressLine progress("what-if");
    found = what_if(options, std::ref(progress));
  }
  std::cout << text_of(found);
  if (!words.csv.empty()) base::write_file(words.csv, csv_of(found));
  if (!words.json.empty()) base::write_json(words.json, json_of(found));
  return 0;
}

}  // namespace

void add_what_if(CLI::App& app, Command& command) {
  const auto options = std::make_shared<WhatIfOptions>();
  options->threads = std::max(1, int(std::thread::hardware_concurrency()));
  const auto words = std::make_shared<Words>();
  CLI::App* const sub = app.add_subcommand(
      "what-if",
      "Computes what the real objects of a recording would have hit with a part at other spacings: "
      "collision time, penetration, clearance, and the spacings that are "
      "certified free in all frames");
  sub->footer(
      "Examples:\n"
      "  fivepipe up launch/deployments/demo.yaml --duration 10 --record session.mcap\n"
      "  fivepipe study what-if session.mcap --part side_block --axis x --range -40cm:20cm\n"
      "  fivepipe study what-if session.mcap --part near_tower --axis -x --at 14cm --range "
      "14cm:30cm --layouts 1000 --verdicts --csv layouts.csv\n\n"
      "Exit codes: 0 done, 1 the recording cannot be used, 2 usage or configuration.");
  sub->add_option("recording", options->recording, "recording with object-pixel maps (.mcap)")
      ->required();
  sub->add_option("--part", options->part, "object of the recorded scene that moves")->required();
  sub->add_option("--range", words->range,
                  "FROM:TO: spacings, with units: 14cm:30cm (default: range_m of the part's "
                  "`spacing` in the scene)");
  sub->add_option("--axis", words->axis,
                  "direction in which a larger spacing moves the part: x, y, z, -x, -y, -z or "
                  "DX,DY,DZ (default: that of the part's `spacing`, or x)");
  sub->add_option("--at", words->at,
                  "what the spacing is in the recorded scene (default: at_m of the part's "
                  "`spacing`, or 0m)");
  sub->add_option("--layouts", options->layouts,
                  "number of spacings at equal distances in the range (default 25)")
      ->check(CLI::Range(1, 100'000));
  sub->add_flag("--verdicts", words->verdicts_only,
                "collision times alone, without clearance and penetration: faster");
  sub->add_option("--threads", options->threads, "threads (default: one per core)")
      ->check(CLI::Range(1, 1024));
  sub->add_option("--csv", words->csv, "also writes one line per layout, lengths in metres");
  sub->add_option("--json", words->json, "also writes the results as JSON");
  sub->add_option("--set", words->settings, "KEY=VALUE: a setting of the recorded deployment")
      ->allow_extra_args(false);
  sub->callback([=, &command] { command = [=] { return run_what_if(*options, *words); }; });
}

}  // namespace fivepipe::study
