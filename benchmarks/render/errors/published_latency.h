// The latency in which the object moves on before its avatar is composited.
#pragma once
#include <filesystem>

namespace fivepipe::render_bench {

// Returns the median latency from capture to composite of deployment paper [ms] in a result file of
// `fivepipe bench pipeline`. Deployment paper segments its images before the start, so the latency
// does not include that. Throws std::runtime_error that names the file if it lacks the result.
double published_latency_ms(const std::filesystem::path& result_file);

}  // namespace fivepipe::render_bench
