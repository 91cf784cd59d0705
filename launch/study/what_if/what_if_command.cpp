#include <iostream>
#include <thread>

#include "common/base/process/progress_line.h"
#include "common/base/result_file.h"
#include "common/base/usage_error.h"
#include "launch/cli/options.h"
#include "launch/study/commands.h"
#include "launch/study/what_if/part_words.h"
#include "launch/study/what_if/what_if.h"

namespace fivepipe::study {
namespace {

constexpr const char* kPartGroup = "Options of a part";

struct WhatIfWords {
  std::vector<PartWord> of_parts;
  std::vector<std::string> settings;
  std::filesystem::path layout_file, csv, json, html;
  bool verdicts_only = false, has_layouts = false;
};

int run_what_if(WhatIfOptions options, const WhatIfWords& words) {
  options.settings = launch::settings_from(words.settings);
  for (const PartWords& part : parts_of_words(words.of_parts))
    options.parts.push_back(part_from(part));
  if (!words.layout_file.empty()) {
    if (words.has_layouts)
      throw base::UsageError("--layouts and --layout-file: the file has the layouts");
    options.table = read_layout_table(words.layout_file);
  } else if (options.parts.empty()) {
    throw base::UsageError("--part or --layout-file is required");
  }
  options.with_distances = !words.verdicts_only;
  options.with_combinations = !words.html.empty();
  WhatIf found;
  {
    base::ProgressLine progress("what-if");
    found = what_if(options, std::ref(progress));
  }
  if (!words.csv.empty()) base::write_file(words.csv, csv_of(found));
  if (!words.json.empty()) base::write_json(words.json, json_of(found));
  if (!words.html.empty()) base::write_file(words.html, html_of(found));
  std::cout << text_of(found, words.csv);
  return 0;
}

// The options that describe a part, in the order of the command line.
std::vector<PartWord> words_of_parts(const CLI::App& sub) {
  std::vector<PartWord> words;
  std::map<const CLI::Option*, std::size_t> taken;
  for (const CLI::Option* const option : sub.parse_order())
    if (option->get_group() == kPartGroup)
      words.push_back({option->get_name(), option->results().at(taken[option]++)});
  return words;
}

void add_part_options(CLI::App& sub) {
  const auto add = [&](const std::string& name, const std::string& help) {
    sub.add_option(name, help)->take_all()->allow_extra_args(false)->group(kPartGroup);
  };
  add("--part",
      "object of the recorded scene, or with --mesh a new one; repeatable, and the "
      "options of this group belong to the part before them");
  add("--range",
      "FROM:TO: spacings, with units: 14cm:30cm (default: range_m of the part's "
      "`spacing` in the scene)");
  add("--axis",
      "direction in which a larger spacing moves the part: x, y, z, -x, -y, -z or "
      "DX,DY,DZ (default: that of the part's `spacing`, or x)");
  add("--at",
      "what the spacing is in the recorded scene (default: at_m of the part's `spacing`, "
      "or 0m)");
  add("--mesh",
      "FILE,UNIT: the part was not in the recording: STEP and glTF (.glb) without a unit, OBJ, "
      "STL or PLY; mm, cm, m or in");
  add("--position",
      "X,Y,Z: where the origin of the mesh is in the world, with units (default: at "
      "the world's origin)");
  add("--rotation", "X,Y,Z: turns the mesh about the world's x, then y, then z axis, degrees");
}

}  // namespace

void add_what_if(CLI::App& app, Command& command) {
  const auto options = std::make_shared<WhatIfOptions>();
  options->threads = std::max(1, int(std::thread::hardware_concurrency()));
  const auto words = std::make_shared<WhatIfWords>();
  CLI::App* const sub = app.add_subcommand(
      "what-if",
      "Computes what the real objects of a recording would have hit with parts elsewhere, or with "
      "parts that were not there: collision time, penetration, clearance, and the spacings that "
      "are certified free in all frames");
  sub->footer(
      "Examples:\n"
      "  fivepipe up launch/deployments/demo.yaml --duration 10 --record session.mcap\n"
      "  fivepipe study what-if session.mcap --part side_block --axis x --range -40cm:20cm\n"
      "  fivepipe study what-if session.mcap --part near_tower --axis -x --at 14cm --range "
      "14cm:30cm --layouts 1000 --verdicts --csv layouts.csv\n"
      "  fivepipe study what-if session.mcap --part side_block --axis x --range 0cm:20cm --part "
      "bracket --mesh bracket.stl,mm --position 30cm,0cm,52cm --range -10cm:10cm --html "
      "layouts.html\n"
      "  fivepipe study what-if session.mcap --layout-file layouts.csv --csv results.csv\n\n"
      "Exit codes: 0 done, 1 the recording cannot be used, 2 usage or configuration.");
  sub->add_option("recording", options->recording, "recording with object-pixel maps (.mcap)")
      ->required();
  add_part_options(*sub);
  CLI::Option* const layouts =
      sub->add_option("--layouts", options->layouts,
                      "number of spacings of each part, at equal distances in its range "
                      "(default 25)")
          ->check(CLI::Range(1, 100'000));
  sub->add_option("--layout-file", words->layout_file,
                  "CSV file with one layout of several parts per line, instead of ranges; its "
                  "columns are parts, or PART.x, PART.y and PART.z");
  sub->add_flag("--verdicts", words->verdicts_only,
                "collision times alone, without clearance and penetration: faster");
  sub->add_option("--threads", options->threads, "threads (default: one per core)")
      ->check(CLI::Range(1, 1024));
  sub->add_option("--csv", words->csv, "also writes all layouts, one per line, lengths in metres");
  sub->add_option("--json", words->json, "also writes the results as JSON");
  sub->add_option("--html", words->html,
                  "also writes a page with charts: curves of each part, and of several parts a map "
                  "or bars of the layouts of all of them");
  launch::add_set_option(sub, words->settings);
  sub->callback([=, &command] {
    words->of_parts = words_of_parts(*sub);
    words->has_layouts = layouts->count() > 0;
    command = [=] { return run_what_if(*options, *words); };
  });
}

}  // namespace fivepipe::study
