#include "launch/study/what_if/layout_table.h"

#include <gtest/gtest.h>

#include <fstream>

#include "common/config/yaml/config_error.h"
#include "tests/support/test_folder.h"

namespace fivepipe::study {
namespace {

class Table : public testing::Test {
 protected:
  LayoutTable read(const std::string& text) const {
    std::ofstream(file_, std::ios::binary) << text;
    return read_layout_table(file_);
  }
  // What is wrong, without the name of the file.
  std::string problems(const std::string& text) const {
    try {
      read(text);
    } catch (const config::ConfigError& error) {
      std::string what = error.what();
      for (std::size_t at; (at = what.find(file_.string())) != std::string::npos;)
        what.replace(at, file_.string().size(), "T");
      return what;
    }
    return "none";
  }
  const test::TestFolder folder_;
  const std::filesystem::path file_ = folder_.path / "layouts.csv";
};

TEST_F(Table, HasAColumnPerPartOrAxisAndARowPerLayout) {
  const LayoutTable table =
      read("# parts\r\n payload_a , b.x,b.z\r\n18cm, -20mm ,0m\r\n\r\n# two\n0.2m,1in,-5cm");
  ASSERT_EQ(table.columns.size(), 3u);
  EXPECT_EQ(table.columns[0].name(), "payload_a");
  EXPECT_EQ(table.columns[0].axis, -1);
  EXPECT_EQ(table.columns[1].part, "b");
  EXPECT_EQ(table.columns[1].axis, 0);
  EXPECT_EQ(table.columns[2].name(), "b.z");
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_EQ(table.rows[0].line, 3);
  EXPECT_EQ(table.rows[0].cell_m, (std::vector<double>{0.18, -0.02, 0}));
  EXPECT_EQ(table.rows[1].line, 6);
  EXPECT_EQ(table.rows[1].cell_m, (std::vector<double>{0.2, 0.0254, -0.05}));
}

TEST_F(Table, NamesEachWrongLine) {
  EXPECT_EQ(
      problems("a,b\n1cm,2\n3cm\n4cm,5cm\n501m,nan"),
      "T:2:5: b: '2' is no length; write a number and its unit, such as 18cm, 180mm, 0.18m or "
      "7in\nT:3:1: 1 cells, but 2 columns\nT:5:1: a: '501m' is longer than 500 m\nT:5:6: b: 'nan' "
      "is no length; write a number and its unit, such as 18cm, 180mm, 0.18m or 7in");
  EXPECT_EQ(
      problems("a.w\n1cm"),
      "T:1:1: column 'a.w' is neither PART nor PART.x, PART.y or PART.z, such as payload_a or "
      "bracket.z");
  EXPECT_NE(problems("a,,b\n1cm,1cm,1cm").find("T:1:3: column '' is neither"), std::string::npos);
  EXPECT_EQ(problems("a.x,a.x\n1cm,1cm"), "T:1:5: column a.x is there twice");
  EXPECT_EQ(problems("a.x,a\n1cm,1cm"),
            "T:1:5: columns a.x and a: a part is placed by its spacing or by axes, not by both");
  EXPECT_NE(problems("").find("no layout"), std::string::npos);
  EXPECT_NE(problems("a,b\n").find("T:1:1: no layout"), std::string::npos);
  std::string many = "a\n";
  for (int i = 0; i < 30; ++i) many += "x\n";
  const std::string listed = problems(many);
  EXPECT_EQ(std::count(listed.begin(), listed.end(), '\n'), 9) << listed;
}

TEST_F(Table, HasALimitAndNeedsAFile) {
  std::string rows = "a\n";
  for (std::size_t i = 0; i < kMaxTableRows; ++i) rows += "1cm\n";
  EXPECT_EQ(read(rows).rows.size(), kMaxTableRows);
  EXPECT_NE(problems(rows + "2cm\n").find("more than 100000 layouts"), std::string::npos);
  EXPECT_THROW(read_layout_table(folder_.path / "none.csv"), config::ConfigError);
  EXPECT_THROW(read_layout_table(folder_.path), config::ConfigError);
}

}  // namespace
}  // namespace fivepipe::study
