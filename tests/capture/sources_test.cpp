#include <sys/inotify.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "tests/support/capture/capture_rig.h"
#include "tests/support/test_folder.h"

namespace fivepipe::capture {
namespace {

namespace fs = std::filesystem;

class Sources : public ::testing::Test {
 protected:
  // Frame f is a uniform image of level 20 f.
  static cv::Mat picture(int f, int width_px = 64, int height_px = 48) {
    return {height_px, width_px, CV_8UC3, cv::Scalar::all(20.0 * f)};
  }
  std::string video(const std::string& name, int frames, int width_px = 64, int height_px = 48) {
    const std::string file = (folder_ / name).string();
    cv::VideoWriter writer(file, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 30,
                           {width_px, height_px});
    for (int f = 0; f < frames; ++f) writer.write(picture(f, width_px, height_px));
    return file;
  }
  static config::RigCamera camera() { return test::table_camera("cam", {0, -1, 1}, 64, 48); }
  // Returns the level of the image in steps of 20; -1: missing, -2: end.
  static int shown(ImageSource& source, std::int64_t frame) {
    cv::Mat image;
    const ReadStatus status = source.read(frame, image);
    if (status != ReadStatus::image) return status == ReadStatus::missing ? -1 : -2;
    return int(std::lround(cv::mean(image)[1] / 20));
  }
  template <class Open>
  static SourceProblem problem_of(Open open) {
    try {
      open();
    } catch (const SourceError& error) {
      EXPECT_EQ(error.problems().size(), 1u);
      return error.problems()[0];
    }
    ADD_FAILURE() << "no SourceError";
    return {};
  }
  const test::TestFolder test_folder_;
  const fs::path folder_ = test_folder_.path;
};

TEST_F(Sources, VideoPlaysToItsEnd) {
  const auto source = open_file_source(camera(), {video("a.avi", 6), {}, 0});
  std::vector<int> levels;
  for (int f = 0; f < 8; ++f) levels.push_back(shown(*source, f));
  EXPECT_EQ(levels, (std::vector<int>{0, 1, 2, 3, 4, 5, -2, -2}));
}

TEST_F(Sources, VideoSeeksForwardAndBackward) {
  const auto source = open_file_source(camera(), {video("a.avi", 6), {}, 2});
  std::vector<int> levels;
  for (const int f : {0, 1, 3, 4, 1, 400, 0}) levels.push_back(shown(*source, f));
  EXPECT_EQ(levels, (std::vector<int>{2, 3, 5, -2, 3, -2, 2}));
}

// Opening a video costs as much as decoding many frames.
TEST_F(Sources, AVideoIsOpenedAgainOnlyToGoBack) {
  const std::string file = video("a.avi", 6);
  const auto source = open_file_source(camera(), {file, {}, 1});
  const int watch = inotify_init1(IN_NONBLOCK);
  ASSERT_GE(inotify_add_watch(watch, file.c_str(), IN_OPEN), 0);
  const auto was_opened = [&] {
    char events[4096];
    bool any = false;
    while (read(watch, events, sizeof(events)) > 0) any = true;
    return any;
  };
  // Two of them are beyond the end. Opening has decoded the first one, to learn the size.
  std::vector<int> levels;
  for (int f = 0; f < 7; ++f) levels.push_back(shown(*source, f));
  EXPECT_EQ(levels, (std::vector<int>{1, 2, 3, 4, 5, -2, -2}));
  EXPECT_FALSE(was_opened());
  EXPECT_EQ(shown(*source, 3), 4);
  EXPECT_TRUE(was_opened());
  EXPECT_EQ(shown(*source, 3), 4);
  EXPECT_FALSE(was_opened());
  close(watch);
}

TEST_F(Sources, SequenceReportsMissingFrames) {
  for (const int f : {10, 11, 13, 14})
    cv::imwrite((folder_ / ("frame_00" + std::to_string(f) + ".png")).string(), picture(f - 10));
  std::ofstream(folder_ / "frame_0014.png") << "no picture";
  std::ofstream(folder_ / "frame_x.png") << "another file";
  const auto source = open_file_source(camera(), {(folder_ / "frame_%04d.png").string(), {}, 0});
  std::vector<int> levels;
  for (int f = 0; f < 7; ++f) levels.push_back(shown(*source, f));
  EXPECT_EQ(levels, (std::vector<int>{0, 1, -1, 3, -1, -2, -2}));
  EXPECT_NE(source->last_error().find("frame_%04d.png"), std::string::npos);
}

// Only names of the pattern with a number of at most 15 digits belong to a sequence.
TEST_F(Sources, SequenceIgnoresOtherFiles) {
  const auto write = [&](const std::string& name, int f) {
    cv::imwrite((folder_ / name).string(), picture(f));
  };
  write("a1_2.png", 1);
  write("a1_3.png", 2);
  for (const std::string name : {"a1_.png", "a1_9.jpg", "b1_9.png", "a1_-9.png", "a1_9.5.png",
                                 "xa1_9.png", "a1_1234567890123456.png", "1_9.png"})
    write(name, 9);
  fs::rename(folder_ / "a1_9.jpg", folder_ / "a1_9.png9");
  const auto source = open_file_source(camera(), {(folder_ / "a1_%d.png").string(), {}, 0});
  std::vector<int> levels;
  for (int f = 0; f < 4; ++f) levels.push_back(shown(*source, f));
  EXPECT_EQ(levels, (std::vector<int>{1, 2, -2, -2}));
  write("c_999999999999999.png", 5);
  EXPECT_EQ(shown(*open_file_source(camera(), {(folder_ / "c_%015d.png").string(), {}, 0}), 0), 5);
  const char* const kNone = "no picture has such a name";
  const char* const kNoNumber = "write %d where the names of the pictures have their number";
  for (const auto& [pattern, what] : {std::pair{"a1_%x.png", kNoNumber},
                                      {"a1_%", kNoNumber},
                                      {"a1_%04", kNoNumber},
                                      {"%%d", kNoNumber},
                                      {"b%d.png", kNone}}) {
    const std::string file = (folder_ / pattern).string();
    const SourceProblem problem = problem_of([&] { open_file_source(camera(), {file, {}, 0}); });
    EXPECT_EQ(problem.fault, SourceFault::not_found);
    EXPECT_EQ(problem.what, file + ": " + what);
  }
}

TEST_F(Sources, APatternWithoutFolderIsInTheWorkingFolder) {
  cv::imwrite((folder_ / "%1.png").string(), picture(3));
  cv::imwrite((folder_ / "2.png").string(), picture(4));
  const fs::path before = fs::current_path();
  fs::current_path(folder_);
  EXPECT_EQ(shown(*open_file_source(camera(), {"%d.png", {}, 0}), 0), 4);
  fs::current_path(before);
}

TEST_F(Sources, AnImageOfAnotherSizeIsMissing) {
  const auto name = [&](int f) { return (folder_ / ("f" + std::to_string(f) + ".png")).string(); };
  cv::imwrite(name(0), picture(0));
  cv::imwrite(name(1), picture(1, 65, 48));
  cv::imwrite(name(2), picture(2, 64, 47));
  cv::imwrite(name(3), picture(3));
  const std::string pattern = (folder_ / "f%d.png").string();
  const auto source = open_file_source(camera(), {pattern, {}, 0});
  EXPECT_EQ(source->last_error(), "");
  EXPECT_EQ(shown(*source, 1), -1);
  EXPECT_EQ(source->last_error(), pattern + ": frame 1 is 65x48");
  EXPECT_EQ(shown(*source, 2), -1);
  EXPECT_EQ(source->last_error(), pattern + ": frame 2 is 64x47");
  EXPECT_EQ(shown(*source, 3), 3);
  std::ofstream(name(3)) << "no picture";
  EXPECT_EQ(shown(*source, 3), -1);
  EXPECT_EQ(source->last_error(), pattern + ": frame 3 is missing or cannot be decoded");
  for (const int first : {1, 2}) {
    const SourceProblem problem = problem_of([&] {
      open_file_source(camera(), {pattern, {}, first});
    });
    EXPECT_EQ(problem.fault, SourceFault::wrong_size);
    EXPECT_EQ(problem.what, pattern + ": images are " + (first == 1 ? "65x48" : "64x47") +
                                " px, image_size_px of the rig is 64x48");
    EXPECT_EQ(problem_of([&] { read_background(camera(), name(first)); }).what,
              name(first) + ": images are " + (first == 1 ? "65x48" : "64x47") +
                  " px, image_size_px of the rig is 64x48");
  }
  const SourceProblem problem = problem_of([&] { open_file_source(camera(), {pattern, {}, 3}); });
  EXPECT_EQ(problem.fault, SourceFault::not_decodable);
  EXPECT_EQ(problem.what, pattern + ": cannot decode frame 3");
}

// A file with the suffix of a picture is decoded as a picture, any other as a video.
TEST_F(Sources, PicturesAreKnownByTheirSuffix) {
  for (const std::string suffix :
       {"png", "jpg", "jpeg", "bmp", "tif", "tiff", "ppm", "PNG", "Jpg"}) {
    const std::string file = (folder_ / ("broken." + suffix)).string();
    std::ofstream(file) << "no picture";
    const SourceProblem problem = problem_of([&] { open_file_source(camera(), {file, {}, 0}); });
    EXPECT_EQ(problem.fault, SourceFault::not_decodable);
    EXPECT_EQ(problem.what, file + ": cannot decode frame 0");
    const SourceProblem background = problem_of([&] { read_background(camera(), file); });
    EXPECT_EQ(background.fault, SourceFault::no_frames);
    EXPECT_EQ(background.what, file + ": cannot decode any frame");
  }
  for (const char* name : {"broken.avi", "png", "broken.png5"}) {
    const std::string file = (folder_ / name).string();
    std::ofstream(file) << "no video";
    EXPECT_EQ(problem_of([&] {
                open_file_source(camera(), {file, {}, 0});
              }).what,
              file + ": cannot decode this video");
  }
}

TEST_F(Sources, ProblemsOfSeveralCamerasAreLinesOfOneError) {
  const SourceProblem file{"a", SourceFault::not_found, "x.avi: no such file"},
      device{"b", SourceFault::hardware_failed, "/dev/video0: is busy"},
      missing{"c", SourceFault::hardware_missing, "/dev/video1: no such camera"};
  EXPECT_STREQ(SourceError({file, device}).what(),
               "a: x.avi: no such file\nb: /dev/video0: is busy");
  const auto is_hardware = [](const std::vector<SourceProblem>& problems) {
    try {
      throw_problems(problems);
    } catch (const HardwareMissing& error) {
      EXPECT_EQ(error.problems().size(), problems.size());
      return true;
    } catch (const SourceError& error) {
      EXPECT_EQ(error.problems().size(), problems.size());
      return false;
    }
  };
  EXPECT_FALSE(is_hardware({file}));
  EXPECT_TRUE(is_hardware({device}));
  EXPECT_TRUE(is_hardware({file, missing}));
}

TEST_F(Sources, ErrorNamesTheMissingFile) {
  const SourceProblem problem = problem_of([&] {
    open_file_source(camera(), {(folder_ / "none.avi").string(), {}, 0});
  });
  EXPECT_EQ(problem.fault, SourceFault::not_found);
  EXPECT_EQ(problem.camera, "cam");
  EXPECT_NE(problem.what.find("none.avi"), std::string::npos);
  EXPECT_EQ(problem_of([&] {
              open_file_source(camera(), {(folder_ / "none_%d.png").string(), {}, 0});
            }).fault,
            SourceFault::not_found);
}

// Reading a pipe would wait for its writer for ever.
TEST_F(Sources, PipesAreRefused) {
  for (const char* name : {"pipe.png", "pipe.avi", "frame_2.png"})
    ASSERT_EQ(mkfifo((folder_ / name).c_str(), 0600), 0);
  cv::imwrite((folder_ / "frame_1.png").string(), picture(1));
  for (const std::string name : {"pipe.png", "pipe.avi", "frame_%d.png"}) {
    const std::string file = (folder_ / name).string();
    for (const SourceProblem& problem : {problem_of([&] {
                                           open_file_source(camera(), {file, {}, 0});
                                         }),
                                         problem_of([&] { read_background(camera(), file); })}) {
      EXPECT_EQ(problem.fault, SourceFault::not_found);
      EXPECT_NE(problem.what.find(file), std::string::npos) << problem.what;
      EXPECT_NE(problem.what.find(": is a pipe, not a file"), std::string::npos) << problem.what;
    }
  }
}

TEST_F(Sources, ErrorNamesTheUndecodableFile) {
  std::ofstream(folder_ / "text.avi") << "this is not a video\n";
  const SourceProblem problem = problem_of([&] {
    open_file_source(camera(), {(folder_ / "text.avi").string(), {}, 0});
  });
  EXPECT_EQ(problem.fault, SourceFault::not_decodable);
  EXPECT_NE(problem.what.find("text.avi"), std::string::npos);
}

TEST_F(Sources, ErrorOfAWrongSizeNamesBothSizes) {
  const std::string file = video("wide.avi", 3, 80, 48);
  const SourceProblem problem = problem_of([&] { open_file_source(camera(), {file, {}, 0}); });
  EXPECT_EQ(problem.fault, SourceFault::wrong_size);
  EXPECT_NE(problem.what.find("80x48"), std::string::npos);
  EXPECT_NE(problem.what.find("64x48"), std::string::npos);
}

TEST_F(Sources, FirstFrameBeyondTheEndIsAnError) {
  const std::string file = video("short.avi", 3);
  EXPECT_EQ(problem_of([&] {
              open_file_source(camera(), {file, {}, 3});
            }).fault,
            SourceFault::no_frames);
  EXPECT_EQ(problem_of([&] {
              open_file_source(camera(), {file, {}, 3});
            }).what,
            file + ": has no frame 3");
}

// Picture k of a sequence has the level k; one of them cannot be decoded.
TEST_F(Sources, BackgroundTakesEveryNthFrameOfTheSequence) {
  const auto levels = [&](int count) {
    const fs::path folder = folder_ / std::to_string(count);
    fs::create_directories(folder);
    for (int f = 0; f < count; ++f) {
      const std::string file = (folder / ("f" + std::to_string(f) + ".bmp")).string();
      cv::imwrite(file, cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(f)));
      if (f == 4) std::ofstream(file) << "no picture";
    }
    std::vector<int> found;
    for (const cv::Mat& image : read_background(camera(), (folder / "f%d.bmp").string()))
      found.push_back(image.at<cv::Vec3b>(0, 0)[0]);
    return found;
  };
  const auto expected = [](int step, int end) {
    std::vector<int> result;
    for (int f = 0; f < end; f += step)
      if (f != 4) result.push_back(f);
    return result;
  };
  EXPECT_EQ(levels(7), expected(1, 7));
  EXPECT_EQ(levels(5), expected(1, 4));
  EXPECT_EQ(levels(40), expected(1, 40));
  EXPECT_EQ(levels(64), expected(1, 64));
  EXPECT_EQ(levels(65), expected(2, 65));
  EXPECT_EQ(levels(150), expected(3, 150));
}

// Pictures by tens, as a program numbers them that keeps every tenth image.
TEST_F(Sources, BackgroundOfASequenceWithGapsIsThatOfItsPictures) {
  for (int f = 0; f < 100; ++f)
    cv::imwrite((folder_ / ("f" + std::to_string(10 * f) + ".bmp")).string(),
                cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(f)));
  const std::vector<cv::Mat> images = read_background(camera(), (folder_ / "f%d.bmp").string());
  ASSERT_EQ(images.size(), 50u);
  for (std::size_t i = 0; i < images.size(); ++i)
    EXPECT_EQ(images[i].at<cv::Vec3b>(0, 0)[0], 2 * i);
}

TEST_F(Sources, APercentSignInAFolderIsNoPattern) {
  const fs::path folder = folder_ / "50%d";
  fs::create_directories(folder);
  cv::imwrite((folder / "f7.png").string(), picture(3));
  for (const char* name : {"f7.png", "f%d.png"})
    EXPECT_EQ(shown(*open_file_source(camera(), {(folder / name).string(), {}, 0}), 0), 3) << name;
}

// A stream of JPEG images has no header that states their number.
TEST_F(Sources, BackgroundFramesOfAStreamWithoutALengthAreEvenlySpaced) {
  const auto levels = [&](int frames) {
    const std::string file = (folder_ / "stream.mjpeg").string();
    std::ofstream stream(file, std::ios::binary);
    std::vector<unsigned char> jpeg;
    for (int f = 0; f < frames; ++f) {
      cv::imencode(".jpg", cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(f)), jpeg);
      stream.write(reinterpret_cast<const char*>(jpeg.data()), std::ssize(jpeg));
    }
    stream.close();
    std::vector<int> found;
    for (const cv::Mat& image : read_background(camera(), file))
      found.push_back(int(std::lround(cv::mean(image)[1])));
    return found;
  };
  for (const auto& [frames, step] : {std::pair{5, 1}, {64, 1}, {65, 2}, {150, 4}}) {
    const std::vector<int> found = levels(frames);
    ASSERT_EQ(std::ssize(found), (frames + step - 1) / step) << frames;
    for (int i = 0; i < std::ssize(found); ++i) EXPECT_NEAR(found[i], i * step, 1) << frames;
  }
}

TEST_F(Sources, BackgroundFramesAreEvenlySpaced) {
  EXPECT_EQ(read_background(camera(), video("few.avi", 5)).size(), 5u);
  EXPECT_EQ(read_background(camera(), video("many.avi", 100)).size(), 50u);
  EXPECT_EQ(int(read_background(camera(), video("most.avi", 128)).size()), kMaxBackgroundFrames);
  cv::imwrite((folder_ / "plate.png").string(), picture(4));
  EXPECT_EQ(read_background(camera(), (folder_ / "plate.png").string()).size(), 1u);
  for (int f = 0; f < 64; ++f)
    cv::imwrite((folder_ / ("empty" + std::to_string(f) + ".png")).string(), picture(f % 3));
  EXPECT_EQ(int(read_background(camera(), (folder_ / "empty%d.png").string()).size()),
            kMaxBackgroundFrames);
}

TEST_F(Sources, ErrorNamesTheMissingDeviceAndListsTheConnectedOnes) {
  for (const std::string device : {"97", "/dev/v4l/by-id/usb-no-such-camera"}) {
    try {
      open_v4l2_source(camera(), {device, {}});
      FAIL() << "no SourceError";
    } catch (const HardwareMissing& missing) {
      EXPECT_EQ(missing.problems()[0].fault, SourceFault::hardware_missing);
      EXPECT_NE(std::string(missing.what()).find(device == "97" ? "/dev/video97" : device),
                std::string::npos);
      EXPECT_NE(std::string(missing.what()).find("connected"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace fivepipe::capture
