// The project's benchmark format. By hand, not by a library: benchmarks also build where hardly one
// is.
#pragma once
#include <string>
#include <vector>

namespace fivepipe::base {

std::string quoted(const std::string& text);  // as a JSON string

// What was measured on: processor, cores, OpenGL's renderer, build and commit.
std::string machine_line(const std::string& renderer);

// {"suite": .., "commit": .., "machine": {..}, "results": [ .. ]}; `more` are further members after
// the results: ",\n \"fit\": {}".
std::string suite_json(const std::string& suite, const std::string& renderer,
                       const std::vector<std::string>& results, const std::string& more = "");

// {"best": .., "median": .., "p95": .., "p99": .., "runs": ..} [ms].
std::string times_json(const std::vector<double>& time_ms);

// Throws std::runtime_error where it can't be written.
void write_file(const std::string& file, const std::string& text);

}  // namespace fivepipe::base
