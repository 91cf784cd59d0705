// fivepipe study what-if: one recording against many layouts of a part.
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "common/study/spacing_study.h"
#include "launch/study/recorded/recorded_spacings.h"

namespace fivepipe::study {

struct WhatIfOptions {
  std::filesystem::path recording;
  std::map<std::string, std::string> settings;  // of the recorded deployment
  std::string part;                             // name of an object of the recorded scene
  Eigen::Vector3d axis_world = Eigen::Vector3d::UnitX();
  double at_m = 0;                     // what the spacing is in the recorded scene
  collision::SpacingInterval range{};  // of the spacing
  // Take axis, at_m and range from the `spacing` of the scene's part instead.
  bool axis_of_scene = false, at_of_scene = false, range_of_scene = false;
  int layouts = 25;            // at equal distances in the range, at least 1
  bool with_distances = true;  // clearance and penetration
  int threads = 2;
};

struct WhatIf {
  WhatIfOptions options;  // with the values of the scene
  std::string scene;
  std::size_t frames = 0, empty_frames = 0;  // the latter without a hull
  double duration_s = 0;
  double eps_m = 0;                            // of the detection
  std::map<std::string, std::uint64_t> drops;  // of the recording, by reason
  std::vector<RecordedSpacing> recorded;       // of the part, while the session was recorded
  std::string damage;                          // of the file; empty: it is finished
  // Spacings at which the whole part is in the volume and, with `limits: all`, in the image of each
  // camera; nullopt: there is none.
  std::optional<collision::SpacingInterval> in_view;
  LineResult result;
};

// Called with the part of the work that is done, 0 to 1, when it has grown.
using Progress = std::function<void(double done)>;
// Throws base::UsageError if the scene has no such part, or the part does not keep its shape and
// pose; recording::RecordingError if there is no complete frame, and as RecordedFrames and
// RecordedDeployment do.
WhatIf what_if(const WhatIfOptions& options, const Progress& progress);

// For people: the layouts, the free intervals and what they mean.
std::string text_of(const WhatIf& found);
nlohmann::ordered_json json_of(const WhatIf& found);
// One line per layout, lengths in metres.
std::string csv_of(const WhatIf& found);

}  // namespace fivepipe::study
