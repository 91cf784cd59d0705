// Compares an image with the one in tests/golden. FIVEPIPE_WRITE_GOLDEN=1 replaces that image;
// inspect it before you commit it.
#pragma once
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

namespace fivepipe::test {

struct GoldenTolerance {
  double mean_levels;          // of the absolute difference
  int pixel_levels;            // more than this is a wrong pixel
  double wrong_pixels = 0.02;  // at most this fraction
};

// Returns why the image differs from the golden one by more than the tolerance; empty if it does
// not. Each channel of a pixel counts as a pixel.
inline std::string why_not_golden(const cv::Mat& image, const cv::Mat& golden,
                                  const GoldenTolerance& tolerance) {
  if (golden.empty()) return "there is no golden image";
  if (golden.size() != image.size() || golden.type() != image.type())
    return fmt::format("the golden image has another size or type: {}x{}", golden.cols,
                       golden.rows);
  cv::Mat difference;
  cv::absdiff(image, golden, difference);
  std::string why;
  const double mean_levels = cv::mean(difference.reshape(1))[0];
  if (!(mean_levels < tolerance.mean_levels))
    why = fmt::format("mean difference {:.4f} levels, limit {}. ", mean_levels,
                      tolerance.mean_levels);
  const cv::Mat wrong = difference.reshape(1) > tolerance.pixel_levels;
  const double limit = tolerance.wrong_pixels * double(wrong.total());
  if (const int count = cv::countNonZero(wrong); !(count <= limit))
    why += fmt::format("{} pixels differ by more than {} levels, limit {:.1f}. ", count,
                       tolerance.pixel_levels, limit);
  return why;
}

// Writes the image, and its difference from the golden one times 8, to a folder beside the
// programs. Returns a sentence with the names of both files.
inline std::string kept_failure(const cv::Mat& image, const cv::Mat& golden,
                                const std::string& name) {
  const std::filesystem::path file =
      std::filesystem::path(FIVEPIPE_BINARY_DIR).parent_path() / "golden_failures" / name;
  std::filesystem::create_directories(file.parent_path());
  cv::imwrite(file, image);
  if (golden.size() != image.size() || golden.type() != image.type())
    return "The image is in " + file.string();
  cv::Mat difference;
  cv::absdiff(image, golden, difference);
  const std::string difference_file = file.parent_path() / (file.stem().string() + "_x8.png");
  cv::imwrite(difference_file, 8 * difference);
  return "The image is in " + file.string() + ", 8 times the difference in " + difference_file;
}

// name: of the files of a failure.
inline void expect_like_golden(const cv::Mat& image, const cv::Mat& golden, const std::string& name,
                               const GoldenTolerance& tolerance) {
  const std::string why = why_not_golden(image, golden, tolerance);
  if (!why.empty()) ADD_FAILURE() << name << ": " << why << kept_failure(image, golden, name);
}

inline void expect_golden(const cv::Mat& image, const std::string& name,
                          const GoldenTolerance& tolerance) {
  const std::string file = std::string(FIVEPIPE_SOURCE_DIR) + "/tests/golden/" + name;
  if (std::getenv("FIVEPIPE_WRITE_GOLDEN")) cv::imwrite(file, image);
  expect_like_golden(image, cv::imread(file), name, tolerance);
}

}  // namespace fivepipe::test
