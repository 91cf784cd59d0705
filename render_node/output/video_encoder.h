// Encodes images into an MP4 file by FFmpeg's libraries.
//
// The file is a fragmented MP4: about every second the encoder appends a fragment with its own
// index. So the memory of the encoder does not grow with the number of images, and a process that
// is killed leaves a file that is playable up to the last fragment. cv::VideoWriter keeps the index
// of the whole file in memory and writes it at the end.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

#include "render_node/output/output_error.h"
#include "render_node/output/video_module.h"

struct AVCodecContext;
struct AVFormatContext;
struct AVFrame;
struct AVPacket;
struct SwsContext;

namespace fivepipe::render {

// The stream is H.264 of constant quality (CRF 23), or MPEG-4 part 2 with 2 bits per pixel if
// FFmpeg cannot encode H.264.
class VideoEncoder final : public VideoWriter {
 public:
  // Creates or replaces the file. Width and height must be even, the rate above 0. The codec's
  // threads inherit the niceness of the calling thread. Throws OutputError.
  VideoEncoder(const std::filesystem::path& file, cv::Size size_px, double frame_rate_hz);
  // Without finish(), the file ends with the last complete fragment.
  ~VideoEncoder() override;
  VideoEncoder(const VideoEncoder&) = delete;
  VideoEncoder& operator=(const VideoEncoder&) = delete;

  // Appends an 8-bit BGR image of the file's size. The codec holds back about 50 images until it
  // has seen the following ones. Throws OutputError, and then the encoder cannot be used any more.
  void write(const cv::Mat& image_bgr) override;

  // Writes all images that have not been written, and closes the file. Throws OutputError. Call it
  // once; no write() may follow.
  void finish() override;

 private:
  struct Free {
    void operator()(AVCodecContext* codec) const;
    void operator()(AVFormatContext* muxer) const;
    void operator()(AVFrame* frame) const;
    void operator()(AVPacket* packet) const;
    void operator()(SwsContext* scaler) const;
  };

  std::string open_codec(double frame_rate_hz);
  void open_file();
  void write_packets();
  int check(int result, const char* what) const;

  const std::filesystem::path file_;
  const cv::Size size_px_;
  std::unique_ptr<AVCodecContext, Free> codec_;
  std::unique_ptr<AVFormatContext, Free> muxer_;
  std::unique_ptr<SwsContext, Free> to_yuv_;
  std::unique_ptr<AVFrame, Free> bgr_, yuv_;
  std::unique_ptr<AVPacket, Free> packet_;
  std::int64_t frames_ = 0;
};

}  // namespace fivepipe::render
