// The pixel formats of GenICam cameras.
#include "capture_node/sources/genicam_image.h"

#include <gtest/gtest.h>

#include <array>

namespace fivepipe::capture {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr int kSize_px = 8;

cv::Mat converted(GenicamFormat format, const Bytes& bytes, int width_px = kSize_px) {
  return bgr_of(std::uint32_t(format), width_px, kSize_px, bytes.data(), bytes.size());
}

bool is_uniform(const cv::Mat& image, const cv::Vec3b& bgr) {
  if (image.empty() || image.type() != CV_8UC3) return false;
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u)
      if (image.at<cv::Vec3b>(v, u) != bgr) return false;
  return true;
}

// A uniform colour has the same interpolated channels everywhere.
TEST(GenicamImage, ABayerFormatNamesTheColoursOfTheFirstTwoPixels) {
  constexpr std::uint8_t kRed = 200, kGreen = 120, kBlue = 30;
  struct Case {
    GenicamFormat format;
    std::array<std::uint8_t, 4> pattern;  // two rows of two pixels
  };
  for (const auto& [format, pattern] :
       {Case{GenicamFormat::bayer_rg8, {kRed, kGreen, kGreen, kBlue}},
        Case{GenicamFormat::bayer_gr8, {kGreen, kRed, kBlue, kGreen}},
        Case{GenicamFormat::bayer_gb8, {kGreen, kBlue, kRed, kGreen}},
        Case{GenicamFormat::bayer_bg8, {kBlue, kGreen, kGreen, kRed}}}) {
    Bytes bytes;
    for (int v = 0; v < kSize_px; ++v)
      for (int u = 0; u < kSize_px; ++u) bytes.push_back(pattern[std::size_t(2 * (v % 2) + u % 2)]);
    EXPECT_TRUE(is_uniform(converted(format, bytes), {kBlue, kGreen, kRed})) << name_of(format);
  }
}

TEST(GenicamImage, ColoursAndGreyKeepTheirValues) {
  Bytes rgb, bgr, grey(kSize_px * kSize_px, 77);
  for (int i = 0; i < kSize_px * kSize_px; ++i) {
    rgb.insert(rgb.end(), {200, 120, 30});
    bgr.insert(bgr.end(), {30, 120, 200});
  }
  EXPECT_TRUE(is_uniform(converted(GenicamFormat::rgb8, rgb), {30, 120, 200}));
  EXPECT_TRUE(is_uniform(converted(GenicamFormat::bgr8, bgr), {30, 120, 200}));
  EXPECT_TRUE(is_uniform(converted(GenicamFormat::mono8, grey), {77, 77, 77}));
}

// ITU-R BT.601 with 16 to 235: Y 81, Cb 90, Cr 240 is red.
TEST(GenicamImage, YuvIsConverted) {
  Bytes yuyv, uyvy;
  for (int i = 0; i < kSize_px * kSize_px / 2; ++i) {
    yuyv.insert(yuyv.end(), {81, 90, 81, 240});
    uyvy.insert(uyvy.end(), {90, 81, 240, 81});
  }
  for (const cv::Mat& image :
       {converted(GenicamFormat::yuv422_yuyv, yuyv), converted(GenicamFormat::yuv422_uyvy, uyvy)}) {
    ASSERT_FALSE(image.empty());
    const cv::Vec3b pixel = image.at<cv::Vec3b>(3, 3);
    EXPECT_LE(pixel[0], 3);
    EXPECT_LE(pixel[1], 3);
    EXPECT_GE(pixel[2], 252);
  }
}

TEST(GenicamImage, TheImageOwnsItsMemory) {
  Bytes grey(kSize_px * kSize_px, 77), bgr(3 * kSize_px * kSize_px, 77);
  const cv::Mat from_grey = converted(GenicamFormat::mono8, grey),
                from_bgr = converted(GenicamFormat::bgr8, bgr);
  std::fill(grey.begin(), grey.end(), 0);
  std::fill(bgr.begin(), bgr.end(), 0);
  EXPECT_TRUE(is_uniform(from_grey, {77, 77, 77}));
  EXPECT_TRUE(is_uniform(from_bgr, {77, 77, 77}));
}

TEST(GenicamImage, BytesAfterEachRowAreSkipped) {
  constexpr int kPadding = 3;
  Bytes grey((kSize_px + kPadding) * kSize_px, 9);
  for (int v = 0; v < kSize_px; ++v)
    std::fill_n(grey.begin() + std::ptrdiff_t(v) * (kSize_px + kPadding), kSize_px, 77);
  const auto image = [&](std::size_t missing) {
    return bgr_of(std::uint32_t(GenicamFormat::mono8), kSize_px, kSize_px, grey.data(),
                  grey.size() - missing, kPadding);
  };
  EXPECT_TRUE(is_uniform(image(0), {77, 77, 77}));
  EXPECT_TRUE(is_uniform(image(kPadding), {77, 77, 77})) << "the last row may have none";
  EXPECT_TRUE(image(kPadding + 1).empty());
  EXPECT_TRUE(bgr_of(std::uint32_t(GenicamFormat::mono8), 1, 1, grey.data(), 1, -1).empty());
}

TEST(GenicamImage, WhatCannotBeConvertedIsEmpty) {
  const Bytes grey(kSize_px * kSize_px, 77);
  EXPECT_TRUE(bgr_of(0x01100003, kSize_px, kSize_px, grey.data(), grey.size()).empty()) << "Mono10";
  EXPECT_TRUE(converted(GenicamFormat::rgb8, grey).empty()) << "too few bytes";
  EXPECT_TRUE(
      bgr_of(std::uint32_t(GenicamFormat::mono8), kSize_px, kSize_px, grey.data(), grey.size() - 1)
          .empty());
  EXPECT_TRUE(bgr_of(std::uint32_t(GenicamFormat::mono8), 0, 1, grey.data(), 1).empty());
  EXPECT_TRUE(bgr_of(std::uint32_t(GenicamFormat::mono8), 1, -1, grey.data(), 1).empty());
  EXPECT_TRUE(bgr_of(std::uint32_t(GenicamFormat::mono8), 1, 1, nullptr, 1).empty());
  EXPECT_TRUE(bgr_of(std::uint32_t(GenicamFormat::yuv422_yuyv), 3, 2, grey.data(), 12).empty());
  EXPECT_TRUE(bgr_of(std::uint32_t(GenicamFormat::bayer_rg8), 1, 8, grey.data(), 8).empty());
}

TEST(GenicamImage, ColourIsPreferred) {
  constexpr std::int64_t kMono8 = 0x01080001, kMono10 = 0x01100003, kRgb8 = 0x02180014,
                         kBayerGb8 = 0x0108000A, kYuyv = 0x02100032;
  EXPECT_EQ(best_format(kMono8, {kMono8, kMono10}), GenicamFormat::mono8);
  EXPECT_EQ(best_format(kMono8, {kMono8, kRgb8}), GenicamFormat::rgb8);
  EXPECT_EQ(best_format(kMono8, {kMono8, kRgb8, kYuyv, kBayerGb8}), GenicamFormat::bayer_gb8);
  EXPECT_EQ(best_format(kRgb8, {kMono8, kRgb8, kBayerGb8}), GenicamFormat::rgb8)
      << "what the user has set";
  EXPECT_EQ(best_format(kMono10, {kMono10}), std::nullopt);
}

TEST(GenicamImage, NamesAreThoseOfTheConvention) {
  for (const char* name : {"BayerRG8", "BayerGR8", "BayerGB8", "BayerBG8", "YUV422_8",
                           "YUV422_8_UYVY", "BGR8", "RGB8", "Mono8"}) {
    const auto format = format_named(name);
    ASSERT_TRUE(format) << name;
    EXPECT_EQ(name_of(*format), name);
    // Bits 16 to 23 of the number are the bits of a pixel.
    EXPECT_EQ(bits_per_pixel(*format), int(std::uint32_t(*format) >> 16 & 0xFF)) << name;
  }
  EXPECT_EQ(format_named("Mono12"), std::nullopt);
}

}  // namespace
}  // namespace fivepipe::capture
