// The scores of `bench capture`, the outlines, and what segmentation reaches on the sequences.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "benchmarks/capture/methods.h"
#include "benchmarks/capture/outlines.h"
#include "benchmarks/capture/scores.h"
#include "benchmarks/capture/sequences.h"
#include "tests/support/test_folder.h"

namespace fivepipe::capture_bench {
namespace {

hull::ObjectPixels square(int left, int top, int size) {
  hull::ObjectPixels pixels(100, 80);
  for (int v = top; v < top + size; ++v) pixels.set_run(left, left + size, v);
  return pixels;
}

TEST(CaptureScores, OfAShiftedSquare) {
  Score same, shifted;
  same.add(square(20, 20, 20), square(20, 20, 20));
  EXPECT_EQ(same.f1(), 1);
  EXPECT_EQ(same.iou(), 1);
  EXPECT_EQ(same.recall(), 1);
  EXPECT_EQ(same.boundary_error_px(), 0);
  shifted.add(square(25, 20, 20), square(20, 20, 20));  // 300 of 400 pixels are in both
  EXPECT_DOUBLE_EQ(shifted.f1(), 0.75);
  EXPECT_DOUBLE_EQ(shifted.iou(), 0.6);
  EXPECT_DOUBLE_EQ(shifted.recall(), 0.75);
  EXPECT_NEAR(shifted.boundary_error_px(), 190.0 / 76, 1e-6) << "of all pairs of outline pixels";
}

TEST(CaptureScores, SumOverImagesAndAreDefinedWithoutPixels) {
  Score score;
  EXPECT_EQ(score.f1(), 1);
  EXPECT_EQ(score.iou(), 1);
  EXPECT_EQ(score.recall(), 1);
  EXPECT_EQ(score.boundary_error_px(), 0);
  score.add(hull::ObjectPixels(100, 80), square(20, 20, 20));
  EXPECT_EQ(score.f1(), 0);
  EXPECT_EQ(score.boundary_error_px(), Score::kMaxDistance_px);
  score.add(square(20, 20, 20), square(20, 20, 20));
  EXPECT_DOUBLE_EQ(score.f1(), 2.0 / 3);
  EXPECT_DOUBLE_EQ(score.iou(), 0.5);
  EXPECT_DOUBLE_EQ(score.recall(), 0.5);
  Score speck;  // far from the object; its distance is bounded
  speck.add(square(70, 60, 1), square(5, 5, 1));
  EXPECT_EQ(speck.boundary_error_px(), Score::kMaxDistance_px);
}

TEST(CaptureOutlines, HoldThePixelsWhoseCentreIsInsideAnOddNumberOfRings) {
  const test::TestFolder folder;
  std::filesystem::create_directories(folder.path / "cam2");
  std::filesystem::create_directories(folder.path / "cam1");
  std::ofstream(folder.path / "cam2" / "045.txt")
      << "# a square with a hole\n9.5 4.5\n29.5 4.5\n# a comment is no gap\n29.5 24.5\n9.5 24.5\n\n"
      << "14.5 9.5\r\n19.5 9.5\n19.5 14.5  # corner\n14.5 14.5\n";
  std::ofstream(folder.path / "cam1" / "007.txt") << "-50 -50\n200 -50\n200 10\n-50 10\n";
  std::ofstream(folder.path / "README.md") << "no camera\n";
  const std::vector<Outline> outlines = read_outlines(folder.path);
  ASSERT_EQ(outlines.size(), 2u);
  EXPECT_EQ(outlines[0].camera, "cam1");
  EXPECT_EQ(outlines[0].frame, 7);
  EXPECT_EQ(outlines[1].camera, "cam2");
  EXPECT_EQ(outlines[1].frame, 45);
  const hull::ObjectPixels ring = pixels_inside(outlines[1], 100, 80);
  EXPECT_EQ(ring.count(), 400u - 25u);
  EXPECT_EQ(ring.bounds(), (hull::PixelRect{10, 5, 30, 25}));
  EXPECT_FALSE(ring.contains(15, 10));
  EXPECT_TRUE(ring.contains(14, 10));
  const hull::ObjectPixels beyond = pixels_inside(outlines[0], 100, 80);
  EXPECT_EQ(beyond.bounds(), (hull::PixelRect{0, 0, 100, 10}));
}

TEST(CaptureOutlines, FaultsNameFileAndLine) {
  const test::TestFolder folder;
  EXPECT_THROW(read_outlines(folder.path / "absent"), std::runtime_error);
  EXPECT_THROW(read_outlines(folder.path), std::runtime_error);
  std::filesystem::create_directories(folder.path / "cam1");
  const auto expect = [&](const char* name, const char* text, const std::string& what) {
    const auto file = folder.path / "cam1" / name;
    std::ofstream(file) << text;
    try {
      read_outlines(folder.path);
      ADD_FAILURE() << what;
    } catch (const std::runtime_error& fault) {
      EXPECT_EQ(fault.what(), file.string() + what);
    }
    std::filesystem::remove(file);
  };
  expect("000.txt", "1 2\n3 4\n", ": a ring has fewer than three vertices");
  expect("000.txt", "", ": a ring has fewer than three vertices");
  expect("notes.txt", "1 2\n3 4\n5 6\n", ": the name is not the number of a frame");
  for (const char* line : {"1 2\n3\n", "1 2\n3 4 5\n", "1 2\na b\n", "1 2\nnan 4\n"}) {
    const auto file = folder.path / "cam1" / "000.txt";
    std::ofstream(file) << line;
    try {
      read_outlines(folder.path);
      ADD_FAILURE() << line;
    } catch (const std::runtime_error& fault) {
      EXPECT_NE(std::string(fault.what()).find(file.string() + ":2: expected a vertex"),
                std::string::npos)
          << fault.what();
    }
  }
}

// On another seed and a quarter of the width. The outline's pixels, which a lens may count to
// either side, are a tenth of the object in images so small; without a lens, hardly any is wrong.
TEST(CaptureAccuracy, FivepipeHoldsOnEverySequence) {
  const Method own = methods(true).front();
  ASSERT_EQ(own.name, "fivepipe");
  constexpr double kMinF1 = 0.99, kMinF1OfCamouflage = 0.9;
  for (const Disturbance disturbance : kDisturbances) {
    const Sequence shown = sequence(disturbance, 31, 180, 122);
    const auto learned = own.settings[0].learn(shown.learning);
    Score score;
    for (std::size_t i = 0; i < shown.images.size(); ++i)
      score.add(learned->segment(shown.images[i]), shown.truth[i]);
    EXPECT_GT(score.f1(), disturbance == Disturbance::camouflage ? kMinF1OfCamouflage : kMinF1)
        << name_of(disturbance);
  }
}

}  // namespace
}  // namespace fivepipe::capture_bench
