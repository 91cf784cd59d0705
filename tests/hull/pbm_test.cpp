#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

#include "common/hull/pbm.h"
#include "tests/support/hull/scenes.h"
#include "tests/support/test_folder.h"

namespace fivepipe::hull {
namespace {

struct Pbm : ::testing::Test {
  const test::TestFolder folder;
  const std::filesystem::path file = folder.path / "map.pbm";
  std::string why_not(int width, int height) const {
    try {
      read_pbm(file, width, height);
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "";
  }
};

TEST_F(Pbm, RoundTripsBitForBit) {
  test::Random random(1);
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 3}, {8, 8}, {65, 9}, {200, 30}}) {
    const ObjectPixels pixels = test::random_pixels(random, width, height, 0.4);
    write_pbm(file, pixels);
    EXPECT_EQ(read_pbm(file, width, height), pixels);
  }
}

// The file as other programs write it: the leftmost pixel is the highest bit, and each row begins
// with a byte of its own.
TEST_F(Pbm, IsP4WithOneBitPerPixel) {
  ObjectPixels pixels(10, 2);
  pixels.set(0, 0), pixels.set(7, 0), pixels.set(8, 0), pixels.set(9, 1);
  write_pbm(file, pixels);
  std::ostringstream bytes;
  bytes << std::ifstream(file, std::ios::binary).rdbuf();
  EXPECT_EQ(bytes.str(), std::string("P4\n10 2\n\x81\x80\x00\x40", 12));
  std::ofstream(file, std::ios::binary) << std::string("P4 10 2 \x81\xbf\x00\x40", 12);
  EXPECT_EQ(read_pbm(file, 10, 2), pixels);  // bits beyond the width are ignored
}

TEST_F(Pbm, DoesNotReadAnotherSize) {
  write_pbm(file, ObjectPixels(10, 2));
  for (const auto& [width, height] : {std::pair{9, 2}, {10, 1}, {10, 3}, {2, 10}})
    EXPECT_NE(
        why_not(width, height)
            .find("not a binary PBM of " + std::to_string(width) + "x" + std::to_string(height)),
        std::string::npos);
  EXPECT_EQ(why_not(10, 2), "");
}

// A file that ends in its header has no size, not the size 0x0.
TEST_F(Pbm, MayHaveNoPixelsButNeedsAHeader) {
  for (const auto& [width, height] : {std::pair{0, 0}, {0, 3}, {3, 0}}) {
    write_pbm(file, ObjectPixels(width, height));
    EXPECT_EQ(read_pbm(file, width, height), ObjectPixels(width, height));
  }
  for (const char* header : {"", "P4", "P4\n", "P4\n0"}) {
    std::ofstream(file) << header;
    EXPECT_NE(why_not(0, 0).find("not a binary PBM of 0x0"), std::string::npos) << header;
  }
}

TEST_F(Pbm, ErrorsNameTheFile) {
  EXPECT_NE(why_not(4, 4).find(file.string()), std::string::npos);  // the file does not exist
  std::ofstream(file) << "P4\n4 4\nab";
  EXPECT_NE(why_not(4, 4).find("ends in row 2"), std::string::npos);
  EXPECT_NE(why_not(5, 4).find("5x4"), std::string::npos);
  std::ofstream(file) << "P4\n4 4";  // ends before the first row
  EXPECT_NE(why_not(4, 4).find("not a binary PBM of 4x4"), std::string::npos);
  std::ofstream(file) << "P1\n4 4\n";
  EXPECT_NE(why_not(4, 4).find("binary PBM"), std::string::npos);
  std::filesystem::remove(file);
  ASSERT_EQ(mkfifo(file.c_str(), 0600), 0);
  EXPECT_NE(why_not(4, 4).find("is a pipe"), std::string::npos);
  EXPECT_THROW(write_pbm("/no/such/folder/x.pbm", ObjectPixels(3, 3)), std::runtime_error);
}

}  // namespace
}  // namespace fivepipe::hull
