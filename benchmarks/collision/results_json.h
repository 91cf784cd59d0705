// The collision benchmark's result file.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/collision/normals.h"
#include "benchmarks/collision/paper_model_fits.h"
#include "benchmarks/collision/proximities.h"
#include "benchmarks/collision/results.h"

namespace fivepipe::collision_bench {

// Each empty part is omitted.
struct AllResults {
  std::vector<Result> detections;
  std::vector<ProximityResult> proximities;
  std::vector<NormalsAt> normals;
  std::optional<PaperModelFits> paper_model;
};

// Throws std::runtime_error if the file cannot be written.
void write_json(const std::filesystem::path& file, const AllResults& results,
                const std::string& gl_renderer);

}  // namespace fivepipe::collision_bench
