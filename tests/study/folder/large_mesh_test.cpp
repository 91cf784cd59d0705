// A mesh of a million triangles, as programs for engineers export them, in `fivepipe study`. The
// quick run uses 100,000 triangles.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "tests/study/study_command.h"
#include "tests/support/deployments.h"
#include "tests/support/recording/kept_recording.h"
#include "tests/support/sanitizer.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::study {
namespace {

using Corner = std::array<float, 3>;

bool is_long() { return std::getenv("FIVEPIPE_LONG") != nullptr; }

// Of a command, which needs less than 6 s on an Intel Xeon of 2.8 GHz for a million triangles.
double max_cpu_s() { return (is_long() ? 30 : 6) * test::kSlowdown; }

// A torus in mm, of 2 `rows` x `columns` triangles, as binary STL: 14 x 14 x 4 cm.
void write_torus(const std::filesystem::path& file, int rows, int columns) {
  const auto at = [&](int row, int column) {
    const double u = 2 * std::numbers::pi * (row % rows) / rows,
                 v = 2 * std::numbers::pi * (column % columns) / columns,
                 from_axis = 50 + 20 * std::cos(v);
    return Corner{float(from_axis * std::cos(u)), float(from_axis * std::sin(u)),
                  float(20 * std::sin(v))};
  };
  const auto count = std::uint32_t(2 * rows * columns);
  std::string bytes(80, ' ');
  bytes.append(reinterpret_cast<const char*>(&count), sizeof count);
  const auto add = [&](const Corner& a, const Corner& b, const Corner& c) {
    bytes.append(12, '\0');  // the normal; readers compute it
    for (const Corner& corner : {a, b, c})
      bytes.append(reinterpret_cast<const char*>(corner.data()), sizeof corner);
    bytes.append(2, '\0');
  };
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const Corner a = at(row, column), b = at(row + 1, column), c = at(row + 1, column + 1),
                   d = at(row, column + 1);
      add(a, b, c);
      add(a, c, d);
    }
  std::ofstream(file, std::ios::binary) << bytes;
}

double cpu_of_children_s() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// Runs the command, expects these texts and prints its time.
void expect_in_time(const std::string& name, const std::string& arguments,
                    const std::vector<std::string>& texts) {
  const double before_s = cpu_of_children_s();
  const test::ShellAnswer answer = study_command(arguments);
  const double cpu_s = cpu_of_children_s() - before_s;
  fmt::print("{}: {:.1f} s of CPU\n", name, cpu_s);
  EXPECT_EQ(answer.exit_code, 0) << answer.text;
  for (const std::string& text : texts)
    EXPECT_TRUE(test::contains(answer.text, text)) << text << '\n' << answer.text;
  EXPECT_LT(cpu_s, max_cpu_s());
}

TEST(LargeMesh, IsReadInSeconds) {
  const test::TestFolder folder;
  const std::string file = (folder.path / "torus.stl").string(),
                    part = "what-if " + test::kKeptRecording + " --part torus --mesh " + file +
                           ",mm --position -10cm,10cm,25cm ";
  write_torus(file, is_long() ? 1000 : 250, is_long() ? 500 : 200);
  expect_in_time("study new",
                 "new " + (folder.path / "study").string() + " --deployment " +
                     test::kSmallDeployment + " --mesh torus=" + file +
                     ",mm --move torus,z,18cm,10cm,34cm",
                 {"14.0 x 14.0 x 4.0 cm, moves along 0,0,1: 18.0 cm"});
  expect_in_time("what-if at one place", part, {"14.0 x 14.0 x 4.0 cm", "certified.", " cm"});
  expect_in_time("what-if at 25 places, verdicts", part + "--range -20cm:20cm --verdicts",
                 {"certified at every spacing between the ends:\n  -20.00 to 9.81 cm\n",
                  "The largest spacings of the range are not free"});
}

}  // namespace
}  // namespace fivepipe::study
