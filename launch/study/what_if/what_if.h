// fivepipe study what-if: one recording against many layouts of one or several parts.
#pragma once
#include <Eigen/Geometry>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/study/spacing_study.h"
#include "launch/study/recorded/recorded_spacings.h"
#include "launch/study/what_if/layout_table.h"

namespace fivepipe::study {

// A mesh that was not in the recorded scene.
struct AddedMesh {
  std::filesystem::path file;    // glTF (.glb), OBJ, STL, PLY or STEP
  std::optional<double> unit_m;  // size of the file's unit; absent: that of the format
  Eigen::Isometry3d world_from_mesh = Eigen::Isometry3d::Identity();
};

struct WhatIfPart {
  std::string name;  // of an object of the recorded scene; of an added mesh, a new one
  std::optional<AddedMesh> added = std::nullopt;
  Eigen::Vector3d axis_world = Eigen::Vector3d::UnitX();
  double at_m = 0;                     // what the spacing is in the recorded scene
  collision::SpacingInterval range{};  // of the spacing
  // Take axis, at_m and range from the `spacing` of the scene's part instead. A part without one
  // has the range [at_m, at_m] if it is an added mesh or the layouts are in a table.
  bool axis_of_scene = false, at_of_scene = false, range_of_scene = false;
};

struct WhatIfOptions {
  std::filesystem::path recording;
  std::map<std::string, std::string> settings;  // of the recorded deployment
  std::vector<WhatIfPart> parts;                // without a table: at least one; names differ
  int layouts = 25;  // of each part, at equal distances in its range, at least 1
  // Layouts of several parts, instead of spacings of each. A part of a column that is not in
  // `parts` is taken with the values of the scene; one that is there and has no column stays at
  // at_m in all layouts.
  std::optional<LayoutTable> table = std::nullopt;
  bool with_distances = true;  // clearance and penetration
  // Without a table: also layouts of all parts together, at most kMaxCombinations.
  bool with_combinations = false;
  int threads = 2;
};

// One part over its range, wherever the other parts are: a part collides with the real objects,
// not with other parts.
struct PartResult {
  WhatIfPart part;  // with the values of the scene
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
  std::vector<RecordedSpacing> recorded = {};  // while the session was recorded
  // Spacings at which the whole part is in the volume and, with `limits: all`, in the image of each
  // camera; nullopt: there is none.
  std::optional<collision::SpacingInterval> in_view = std::nullopt;
  LineResult result = {};
};

// One row of the table of layouts, or a combination of spacings.
struct RowResult {
  LayoutResult layout;
  std::vector<std::string> colliding_parts = {};
  std::vector<double> spacings_m = {};  // of a combination: of each part
};

struct WhatIf {
  WhatIfOptions options;
  std::string scene;
  std::size_t frames = 0, empty_frames = 0;  // the latter without a hull
  std::size_t incomplete_frames = 0;         // see SpacingVerdicts::is_complete
  double duration_s = 0;
  double eps_m = 0;                            // of the detection
  std::map<std::string, std::uint64_t> drops;  // of the recording, by reason
  std::string damage;                          // of the file; empty: it is finished
  std::vector<std::string> warnings;           // of added meshes: probably a wrong unit
  std::vector<PartResult> parts;               // without a table
  std::vector<RowResult> rows;                 // of the table
  std::vector<RowResult> combinations;         // if requested; empty for one part with several
                                               // spacings
};

// Called with the part of the work that is done, 0 to 1, when it has grown.
using Progress = std::function<void(double done)>;
// Throws base::UsageError if the scene has no such part, the part does not keep its shape and
// pose, or a mesh cannot be read; recording::RecordingError if there is no complete frame, and as
// RecordedFrames and RecordedDeployment do.
WhatIf what_if(const WhatIfOptions& options, const Progress& progress);

// For people: the layouts, the free intervals and what they mean. Lists at most kShownLayouts
// layouts of a part or of the table. csv: the file that has all of them; empty: none.
std::string text_of(const WhatIf& found, const std::filesystem::path& csv = {});
nlohmann::ordered_json json_of(const WhatIf& found);
// One line per part and spacing, or per row of the table; lengths in metres.
std::string csv_of(const WhatIf& found);

// A page with charts (common/study/report/layouts_page.h).
std::string html_of(const WhatIf& found);
// The spacings of the part while the session was recorded, in a line; empty if it did not move.
std::string recorded_text(const PartResult& of);
// What limits the results of all parts, one or several lines per sentence.
std::string limits_of(const WhatIf& found);

inline constexpr std::size_t kShownLayouts = 30;
inline constexpr std::size_t kMaxCombinations = 2500;

}  // namespace fivepipe::study
