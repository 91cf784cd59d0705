// fivepipe study what-if: one recording against many layouts of a part.
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "common/study/spacing_study.h"

namespace fivepipe::study {

struct WhatIfOptions {
  std::filesystem::path recording;
  std::map<std::string, std::string> settings;  // of the recorded deployment
  std::string part;                             // name of an object of the recorded scene
  Eigen::Vector3d axis_world = Eigen::Vector3d::UnitX();
  double at_m = 0;                     // what the spacing is in the recorded scene
  collision::SpacingInterval range{};  // of the spacing
  int layouts = 25;                    // at equal distances in the range, at least 1
  bool with_distances = true;          // clearance and penetration
  int threads = 2;
};

struct WhatIf {
  WhatIfOptions options;
  std::string scene;
  std::size_t frames = 0;
  double duration_s = 0;
  std::map<std::string, std::uint64_t> drops;  // of the recording, by reason
  LineResult result;
};

// Called after each frame with the part of the work that is done, 0 to 1.
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
