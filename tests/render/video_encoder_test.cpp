#include "render_node/output/video_encoder.h"
#include "tests/support/process/file_size_limit.h"
#include "tests/support/sanitizer.h"
#include "tests/support/test_folder.h"

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include <functional>
#include <numeric>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <set>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

// The codecs that FFmpeg lacks.
static std::set<AVCodecID> missing_codecs;
extern "C" const AVCodec* avcodec_find_encoder(AVCodecID id) {
  if (missing_codecs.contains(id)) return nullptr;
  static const auto next =
      reinterpret_cast<const AVCodec* (*)(AVCodecID)>(dlsym(RTLD_NEXT, "avcodec_find_encoder"));
  return next(id);
}

namespace fivepipe::render {
namespace {

namespace fs = std::filesystem;

constexpr int kBits = 12, kBit_px = 16;
const cv::Size kVideoSize(kBits* kBit_px, 64);

// The codec holds back 40 frames to plan its bits, 3 to reorder them, and one per further thread,
// of which libx264 starts at most one for each 32 lines.
constexpr int kReordered = 3, kMaxHeldBack = 40 + kReordered + 64 / 32;

// A picture of soft gradients; its upper half shows the number in squares, the lowest bit first.
cv::Mat numbered(int number) {
  cv::Mat image(kVideoSize, CV_8UC3);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      image.at<cv::Vec3b>(y, x) = cv::Vec3b(uchar(60 + x / 2), uchar(200 - y), uchar(100 + x / 4));
  for (int bit = 0; bit < kBits; ++bit)
    image(cv::Rect(bit * kBit_px, 0, kBit_px, kVideoSize.height / 2))
        .setTo((number >> bit) & 1 ? cv::Scalar::all(235) : cv::Scalar::all(20));
  return image;
}

int number_of(const cv::Mat& image) {
  int number = 0;
  for (int bit = 0; bit < kBits; ++bit)
    if (image.at<cv::Vec3b>(kVideoSize.height / 4, bit * kBit_px + kBit_px / 2)[1] > 128)
      number |= 1 << bit;
  return number;
}

std::vector<int> numbers(int count) {
  std::vector<int> all(std::size_t(count), 0);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

std::string why_not(const std::function<void()>& act) {
  try {
    act();
  } catch (const OutputError& error) {
    return error.what();
  }
  return "no error";
}

class VideoEncoderTest : public testing::Test {
 protected:
  void TearDown() override { missing_codecs.clear(); }

  void write(VideoEncoder& encoder, int images) {
    for (int i = 0; i < images; ++i) encoder.write(numbered(i));
  }
  static cv::VideoCapture opened(const fs::path& file) {
    return cv::VideoCapture(file.string(), cv::CAP_FFMPEG);
  }
  static std::vector<int> numbers_in(const fs::path& file) {
    cv::VideoCapture video = opened(file);
    std::vector<int> found;
    for (cv::Mat image; video.read(image);) found.push_back(number_of(image));
    return found;
  }

  const test::TestFolder folder_;
  const fs::path file_ = folder_.path / "v.mp4";
};

TEST_F(VideoEncoderTest, TheFileHasTheImagesTheirSizeAndTheirRate) {
  for (const double rate_hz : {30.0, 29.97, 12.5, 0.5}) {
    VideoEncoder encoder(file_, kVideoSize, rate_hz);
    write(encoder, 70);
    encoder.finish();
    cv::VideoCapture video = opened(file_);
    EXPECT_NEAR(video.get(cv::CAP_PROP_FPS), rate_hz, 1e-3 * rate_hz);
    EXPECT_EQ(video.get(cv::CAP_PROP_FRAME_COUNT), 70) << rate_hz;
    EXPECT_EQ(video.get(cv::CAP_PROP_FRAME_WIDTH), kVideoSize.width);
    EXPECT_EQ(video.get(cv::CAP_PROP_FRAME_HEIGHT), kVideoSize.height);
    EXPECT_EQ(numbers_in(file_), numbers(70)) << rate_hz;
  }
}

// The time of the first image [us], as a player sees it.
std::int64_t start_us(const fs::path& file) {
  AVFormatContext* video = nullptr;
  if (avformat_open_input(&video, file.c_str(), nullptr, nullptr) < 0) return -1;
  const int found = avformat_find_stream_info(video, nullptr);
  const std::int64_t start = video->start_time;
  avformat_close_input(&video);
  return found < 0 ? -1 : start;
}

// The codec reorders the frames, so that the first one is decoded two frames before it is shown.
TEST_F(VideoEncoderTest, TheFirstImageIsAtTimeZero) {
  VideoEncoder encoder(file_, kVideoSize, 30);
  write(encoder, 70);
  encoder.finish();
  EXPECT_EQ(start_us(file_), 0);
}

// CRF 23 keeps smooth pictures within 36 dB, an error of 4 of 255 levels (RMS). Colours that are
// exchanged or shifted, or a wrong range of levels, are off by more.
TEST_F(VideoEncoderTest, TheImagesAreThoseThatWereWritten) {
  for (const bool has_h264 : {true, false}) {
    missing_codecs.clear();
    if (!has_h264) missing_codecs.insert(AV_CODEC_ID_H264);
    VideoEncoder encoder(file_, kVideoSize, 30);
    write(encoder, 40);
    encoder.finish();
    cv::VideoCapture video = opened(file_);
    EXPECT_EQ(int(video.get(cv::CAP_PROP_FOURCC)),
              has_h264 ? cv::VideoWriter::fourcc('a', 'v', 'c', '1')
                       : cv::VideoWriter::fourcc('m', 'p', '4', 'v'));
    cv::Mat image;
    for (int i = 0; i < 40; ++i) {
      ASSERT_TRUE(video.read(image)) << i;
      EXPECT_GT(cv::PSNR(image, numbered(i)), 36) << i << (has_h264 ? " H.264" : " MPEG-4");
    }
  }
}

TEST_F(VideoEncoderTest, WithoutACodecNothingIsWritten) {
  missing_codecs = {AV_CODEC_ID_H264, AV_CODEC_ID_MPEG4};
  EXPECT_EQ(why_not([&] { VideoEncoder(file_, kVideoSize, 30); }),
            file_.string() +
                ": FFmpeg cannot encode it as H.264 or MPEG-4 part 2: it has neither encoder");
  EXPECT_FALSE(fs::exists(file_));
}

TEST_F(VideoEncoderTest, APartOfALargerImageIsWritten) {
  VideoEncoder encoder(file_, kVideoSize, 30);
  for (int i = 0; i < 5; ++i) {
    cv::Mat larger(100, 301, CV_8UC3, cv::Scalar::all(128));
    cv::Mat part = larger(cv::Rect({50, 20}, kVideoSize));
    numbered(i).copyTo(part);
    encoder.write(part);
  }
  encoder.finish();
  EXPECT_EQ(numbers_in(file_), numbers(5));
}

// A reader finds every frame, also one in the middle of a fragment and between key frames.
TEST_F(VideoEncoderTest, ReadersSeekToAnyFrame) {
  VideoEncoder encoder(file_, kVideoSize, 30);
  write(encoder, 600);
  encoder.finish();
  cv::VideoCapture video = opened(file_);
  EXPECT_EQ(video.get(cv::CAP_PROP_FRAME_COUNT), 600);
  for (const int number : {300, 299, 10, 0, 599, 250, 33, 251, 598, 1, 470}) {
    cv::Mat image;
    ASSERT_TRUE(video.set(cv::CAP_PROP_POS_FRAMES, number) && video.read(image)) << number;
    EXPECT_EQ(number_of(image), number);
  }
}

// The kernel has what a killed process has written. The last fragment was complete at most one
// second before the last frame that the codec has finished.
TEST_F(VideoEncoderTest, AnUnfinishedFileIsPlayableUpToItsLastFragment) {
  constexpr int kRate_hz = 10, kImages = 200;
  std::optional<VideoEncoder> encoder(std::in_place, file_, kVideoSize, kRate_hz);
  write(*encoder, kImages);
  const fs::path killed = folder_.path / "killed.mp4";
  fs::copy_file(file_, killed);
  encoder.reset();
  for (const fs::path& file : {killed, file_}) {
    const std::vector<int> found = numbers_in(file);
    ASSERT_GE(int(found.size()), kImages - kMaxHeldBack - kRate_hz) << file;
    // The frames before the last one may depend on it, so that it precedes them in the file.
    const std::vector<int> in_order(found.begin(), found.end() - kReordered);
    EXPECT_EQ(in_order, numbers(int(in_order.size()))) << file;
    EXPECT_LE(found.back(), int(found.size()) - 1 + kReordered) << file;
    EXPECT_EQ(opened(file).get(cv::CAP_PROP_FRAME_COUNT), double(found.size())) << file;
  }
}

TEST_F(VideoEncoderTest, AFileWithoutImagesIsNoError) {
  VideoEncoder encoder(file_, kVideoSize, 30);
  encoder.finish();
  EXPECT_EQ(numbers_in(file_), std::vector<int>());
}

// An index of the whole file would need 56 bytes per image, a table of its fragments 1.5.
TEST_F(VideoEncoderTest, TheMemoryDoesNotGrowWithTheNumberOfImages) {
  if (test::kHasSanitizer) GTEST_SKIP() << "the sanitizer replaces malloc";
  const cv::Size tiny(64, 48);
  VideoEncoder encoder(file_, tiny, 30);
  const auto allocated_bytes_after = [&](int images) {
    for (int i = 0; i < images; ++i)
      encoder.write(cv::Mat(tiny, CV_8UC3, cv::Scalar::all(i % 256)));
    const struct mallinfo2 heap = mallinfo2();
    return std::int64_t(heap.uordblks + heap.hblkhd);
  };
  constexpr int kMore = 8000;
  const std::int64_t before = allocated_bytes_after(2000);
  EXPECT_LT(allocated_bytes_after(kMore) - before, kMore);  // less than a byte per image
}

TEST_F(VideoEncoderTest, AnErrorNamesTheFileTheStepAndTheReason) {
  const fs::path nowhere = folder_.path / "missing" / "v.mp4";
  EXPECT_EQ(why_not([&] { VideoEncoder(nowhere, kVideoSize, 30); }),
            nowhere.string() + ": cannot create it: No such file or directory");
  EXPECT_EQ(why_not([&] { VideoEncoder(folder_.path, kVideoSize, 30); }),
            folder_.path.string() + ": cannot create it: Is a directory");
  const std::string too_large = file_.string() + ": cannot write it: File too large";
  {
    VideoEncoder encoder(file_, kVideoSize, 30);
    const test::FileSizeLimit limit(100);  // has the effect of a full disk
    EXPECT_EQ(why_not([&] { write(encoder, 1000); }), too_large);
  }
  VideoEncoder encoder(file_, kVideoSize, 30);
  write(encoder, 5);
  const test::FileSizeLimit limit(100);
  EXPECT_EQ(why_not([&] { encoder.finish(); }), too_large);
}

// The text before a colon is not the name of a protocol.
TEST_F(VideoEncoderTest, AFileMayHaveAnyName) {
  const fs::path before = fs::current_path();
  fs::current_path(folder_.path);
  {
    VideoEncoder encoder("left:1.mp4", kVideoSize, 30);
    write(encoder, 3);
    encoder.finish();
  }
  fs::current_path(before);
  EXPECT_EQ(numbers_in(folder_.path / "left:1.mp4"), numbers(3));
}

}  // namespace
}  // namespace fivepipe::render
