// A temporary folder for the files of a test.
#pragma once
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace fivepipe::test {

// Creates an empty folder; the destructor removes it and its content.
struct TestFolder {
  const std::filesystem::path path;

  TestFolder() : path(created()) {}
  ~TestFolder() { std::filesystem::remove_all(path); }
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;

 private:
  static std::filesystem::path created() {
    std::string name = (std::filesystem::temp_directory_path() / "fivepipe_test_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    return name;
  }
};

}  // namespace fivepipe::test
