#include "launch/export/depth_file.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "tests/support/test_folder.h"

namespace fivepipe::exports {
namespace {

const hull::DepthTile kDepth{{0, 0, 3, 2}, {0, 0.5004f, 1.0006f, 2.25f, 70.0f, 0}};

TEST(DepthFile, PngHoldsMillimetres) {
  const test::TestFolder folder;
  const auto file = folder.path / "depth.png";
  write_depth(file, kDepth, DepthFormat::png);
  const cv::Mat image = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(image.type(), CV_16UC1);
  ASSERT_EQ(image.size(), cv::Size(3, 2));
  const std::vector<std::uint16_t> expected{0, 500, 1001, 2250, 65535, 0};
  EXPECT_EQ(std::vector<std::uint16_t>(image.begin<std::uint16_t>(), image.end<std::uint16_t>()),
            expected);
}

TEST(DepthFile, ExrHoldsTheSameFloats) {
  const test::TestFolder folder;
  const auto file = folder.path / "depth.exr";
  enable_exr();
  write_depth(file, kDepth, DepthFormat::exr);
  const cv::Mat image = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(image.type(), CV_32FC1);
  ASSERT_EQ(image.size(), cv::Size(3, 2));
  EXPECT_EQ(std::vector<float>(image.begin<float>(), image.end<float>()), kDepth.depth_m);
}

TEST(DepthFile, NamesAFileThatCannotBeWritten) {
  for (const DepthFormat format : {DepthFormat::png, DepthFormat::exr}) try {
      write_depth("/no/such/folder/depth" + extension_of(format), kDepth, format);
      ADD_FAILURE() << "no error";
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find("/no/such/folder/depth"), std::string::npos);
    }
  EXPECT_EQ(depth_format_from("png"), DepthFormat::png);
  EXPECT_EQ(depth_format_from("exr"), DepthFormat::exr);
  EXPECT_FALSE(depth_format_from("tiff"));
}

}  // namespace
}  // namespace fivepipe::exports
