// fivepipe_figures: writes the measured figures of the documents from the benchmarks' result files.
#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>
#include <iterator>

#include "benchmarks/figures/documents.h"

namespace fivepipe::figures {
namespace {

std::string read(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(file + ": cannot be read");
  return {std::istreambuf_iterator<char>(in), {}};
}

int run(const std::string& folder, const std::vector<std::string>& files) {
  const Results results(folder);
  for (const std::string& file : files) {
    const std::string before = read(file);
    std::string after;
    try {
      after = with_figures(before, results);
    } catch (const std::exception& error) {
      throw std::runtime_error(file + ": " + error.what());
    }
    if (after == before) continue;
    if (!(std::ofstream(file, std::ios::binary) << after).flush())
      throw std::runtime_error(file + ": cannot be written");
    std::cout << file << ": updated\n";
  }
  return 0;
}

}  // namespace
}  // namespace fivepipe::figures

int main(int argc, char** argv) {
  std::string results;
  std::vector<std::string> files;
  CLI::App app(
      "fivepipe_figures: writes the blocks between `<!-- figures: NAME -->` and `<!-- end of "
      "figures -->` in Markdown files from the result files of the benchmarks.\n\n"
      "Example:\n  build/release/bin/fivepipe_figures docs/benchmarks README.md docs/*.md\n\n"
      "Exit codes: 0 written, 1 a result is missing or the results are not of one machine and "
      "commit, 2 usage.");
  app.add_option("results", results, "folder with the result files")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("files", files, "Markdown files")->required()->check(CLI::ExistingFile);
  try {
    app.parse(argc, argv);
    return fivepipe::figures::run(results, files);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    return std::cerr << "fivepipe_figures: " << error.what() << '\n', 1;
  }
}
