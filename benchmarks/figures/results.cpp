#include "benchmarks/figures/results.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <set>
#include <stdexcept>

namespace fivepipe::figures {
namespace {

std::string read(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  return {std::istreambuf_iterator<char>(in), {}};
}

json parsed(const std::filesystem::path& file) {
  try {
    return json::parse(read(file));
  } catch (const json::exception& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
}

double number(const json& object, const std::string& name, const std::string& path) {
  if (!object.is_object() || !object.contains(name) || !object[name].is_number())
    throw std::runtime_error("the result lacks " + path + name);
  return object[name];
}

std::string named(const json& result) { return result.value("name", "?") + "."; }

}  // namespace

Results::Results(const std::filesystem::path& folder) {
  std::set<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    files.insert(entry.path().string());
  for (const std::filesystem::path file : files) {
    if (file.extension() == ".txt") texts_[file.stem()] = read(file);
    if (file.extension() != ".json") continue;
    const json suite = parsed(file);
    json machine = suite.value("machine", json::object());
    const std::string commit = suite.value("commit", "");
    if (machine.value("build_type", "") != "Release")
      throw std::runtime_error(file.string() + ": not of a Release build");
    // A node without OpenGL has no renderer.
    if (machine.value("gl_renderer", "") == "no OpenGL") machine["gl_renderer"] = "";
    if (commit_.empty()) commit_ = commit;
    if (commit != commit_ || commit.empty() || commit.ends_with('+'))
      throw std::runtime_error(fmt::format("{}: measured with commit '{}', the other files with {}",
                                           file.string(), commit, commit_));
    for (const auto& [key, value] : machine.items()) {
      if (value == "") continue;
      if (!machine_.contains(key)) machine_[key] = value;
      if (machine_[key] != value)
        throw std::runtime_error(fmt::format("{}: another machine: {} is {}, not {}", file.string(),
                                             key, value.dump(), machine_[key].dump()));
    }
    results_[file.stem()] = suite.at("results").get<std::vector<json>>();
  }
  for (const auto& [name, text] : texts_)
    if (text.find(commit_) == std::string::npos)
      throw std::runtime_error(
          fmt::format("{}: does not name commit {}", (folder / (name + ".txt")).string(), commit_));
}

const std::vector<json>& Results::all(const std::string& file) const {
  const auto found = results_.find(file);
  if (found == results_.end()) throw std::runtime_error("no results " + file + ".json");
  return found->second;
}

const json* Results::find(const std::string& file, const std::string& name) const {
  for (const json& result : all(file))
    if (result.value("name", "") == name) return &result;
  return nullptr;
}

const json& Results::at(const std::string& file, const std::string& name) const {
  if (const json* found = find(file, name)) return *found;
  throw std::runtime_error(file + ".json has no result " + name);
}

const std::string& Results::text(const std::string& file) const {
  const auto found = texts_.find(file);
  if (found == texts_.end()) throw std::runtime_error("no text " + file + ".txt");
  return found->second;
}

std::string Results::machine() const {
  return fmt::format("{}, {} cores, {}, build Release, commit {}", machine_.value("cpu", "?"),
                     machine_.value("cores", 0), machine_.value("gl_renderer", "no OpenGL"),
                     commit_);
}

std::string Results::gl_name() const {
  const std::string renderer = machine_.value("gl_renderer", "no OpenGL");
  return renderer.substr(0, renderer.find_first_of(" ("));
}

bool Results::has_gpu() const {
  const std::set<std::string> in_software = {"llvmpipe", "softpipe", "swrast"};
  return machine_.value("gl_renderer", "") != "" && !in_software.contains(gl_name());
}

double time_ms(const json& result, const char* statistic) {
  return number(result.value("time_ms", json::object()), statistic, named(result) + "time_ms.");
}
double error_of(const json& result, const char* name) {
  return number(result.value("error", json::object()), name, named(result) + "error.");
}
double count_of(const json& result, const char* name) {
  return number(result.value("counts", json::object()), name, named(result) + "counts.");
}

}  // namespace fivepipe::figures
