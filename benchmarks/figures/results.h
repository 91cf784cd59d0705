// The result files from which the documents' figures are made. Pure except for reading the files.
#pragma once
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace fivepipe::figures {

using nlohmann::json;

class Results {
 public:
  // Reads all .json and .txt files of the folder. Throws std::runtime_error that names the file and
  // the defect; also if the files do not all name one machine, one commit and build type Release.
  explicit Results(const std::filesystem::path& folder);

  // Returns the result of a file ("hull"). Throws std::runtime_error if there is none.
  const json& at(const std::string& file, const std::string& name) const;
  const json* find(const std::string& file, const std::string& name) const;  // nullptr: none
  const std::vector<json>& all(const std::string& file) const;               // in their order
  const std::string& text(const std::string& file) const;                    // of a .txt file

  // "Intel(R) Xeon(R) Processor, 2 cores, llvmpipe (..), build Release, commit 71fa478d3175".
  std::string machine() const;
  std::string gl_name() const;  // "llvmpipe", or the first word of the renderer
  bool has_gpu() const;         // false for a renderer in software and without OpenGL

 private:
  std::map<std::string, std::vector<json>> results_;
  std::map<std::string, std::string> texts_;
  json machine_;
  std::string commit_;
};

// The best, median, p95 or p99 time of a result. The number of runs differs between methods, and
// the best of more runs is shorter, so the tables hold medians.
double time_ms(const json& result, const char* statistic = "median");
double error_of(const json& result, const char* name);
double count_of(const json& result, const char* name);
// Cell of a table whose result does not exist.
inline constexpr const char* kNotMeasured = "-";

}  // namespace fivepipe::figures
