// The result files of the benchmarks (JSON), which `fivepipe bench compare` reads.
//
// A result is an object with a unique "name", "time_ms" (times_json), and optionally "error" (named
// numbers, greater is worse), "counts" and "checksum" (hexadecimal, of the output).
#pragma once
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace fivepipe::base {

// Returns one line with the processor, the number of cores, the OpenGL renderer (empty: none), the
// build type and the commit.
std::string machine_line(const std::string& gl_renderer);

// Returns {"suite": .., "commit": .., "machine": {..}, "results": [..]}. `results` is an array.
nlohmann::ordered_json suite_json(const std::string& suite, const std::string& gl_renderer,
                                  const nlohmann::ordered_json& results);

// Returns {"best": .., "median": .., "p95": .., "p99": .., "runs": ..}. Times are in ms, 0 if
// `time_ms` is empty.
nlohmann::ordered_json times_json(const std::vector<double>& time_ms);

// Both create missing folders and throw std::runtime_error if the file cannot be written.
void write_json(const std::filesystem::path& file, const nlohmann::ordered_json& json);
void write_file(const std::filesystem::path& file, const std::string& text);

}  // namespace fivepipe::base
