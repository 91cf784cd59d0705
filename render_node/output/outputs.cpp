#include "render_node/output/outputs.h"

#include <png.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <vector>

namespace fivepipe::render {
namespace {

// On Linux each thread has its own niceness.
constexpr int kBackgroundNiceness = 10;

void check_folder(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error))
    throw OutputError(file.string() + ": folder " + folder.string() + " does not exist");
  if (access(folder.c_str(), W_OK) != 0)
    throw OutputError(file.string() + ": folder " + folder.string() +
                      " is not writable: " + std::strerror(errno));
}

// Returns why the disk counts as full, or an empty text if at least min_free_bytes are free.
std::string why_disk_full(const std::filesystem::path& file, std::uintmax_t min_free_bytes) {
  std::error_code error;
  const auto space =
      std::filesystem::space(file.has_parent_path() ? file.parent_path() : ".", error);
  if (error) return file.string() + ": " + error.message();
  if (space.available >= min_free_bytes) return {};
  return file.string() + ": disk full: " + std::to_string(space.available >> 20) + " MiB free, " +
         std::to_string(min_free_bytes >> 20) + " MiB needed; free disk space";
}

// Throws OutputError.
std::unique_ptr<VideoWriter> open_encoder(const std::filesystem::path& file, cv::Size size_px,
                                          double frame_rate_hz) {
  MakeVideoEncoder* make = nullptr;
  try {
    make = reinterpret_cast<MakeVideoEncoder*>(function_of(kVideoModule, kMakeVideoEncoder));
  } catch (const std::runtime_error& error) {
    throw OutputError(file.string() + ": " + error.what());
  }
  std::unique_ptr<VideoWriter> encoder;
  make(file, size_px, frame_rate_hz, encoder);
  return encoder;
}

// Returns the bytes of the PNG file. By libpng: to load OpenCV's codecs takes 0.15 s, during which
// the other threads wait for memory. Throws OutputError.
std::vector<std::uint8_t> png_of(const std::filesystem::path& file, const cv::Mat& image_bgr) {
  const auto fail = [&](const char* why) {
    throw OutputError(file.string() + ": not an image that PNG supports" + why);
  };
  if (image_bgr.empty() || image_bgr.type() != CV_8UC3) fail("");
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = png_uint_32(image_bgr.cols);
  image.height = png_uint_32(image_bgr.rows);
  image.format = PNG_FORMAT_BGR;
  image.flags = PNG_IMAGE_FLAG_FAST;
  std::vector<std::uint8_t> png(PNG_IMAGE_PNG_SIZE_MAX(image));
  png_alloc_size_t size = png.size();
  if (!png_image_write_to_memory(&image, png.data(), &size, 0, image_bgr.data,
                                 png_int_32(image_bgr.step), nullptr))
    fail((std::string(": ") + image.message).c_str());
  png.resize(size);
  return png;
}

}  // namespace

VideoFile::VideoFile(const std::filesystem::path& file, cv::Size size_px,
                     const VideoOptions& options)
    : file_(file),
      size_px_(size_px),
      options_(options),
      queue_(options.queue_frames + 1),  // the queue counts the frame in the encoder
      deadline_(Clock::time_point::max()) {
  check_folder(file);
  if (!(options.frame_rate_hz > 0))
    throw OutputError(file.string() + ": the frame rate is not above 0");
  // YUV 4:2:0, the format that every player supports, halves the chroma in both directions.
  if (size_px.width < 2 || size_px.height < 2 || size_px.width % 2 || size_px.height % 2)
    throw OutputError(file.string() + ": a video's width and height must be even, not " +
                      std::to_string(size_px.width) + "x" + std::to_string(size_px.height));
  if (const std::string full = why_disk_full(file, options.min_free_bytes); !full.empty())
    throw OutputError(full);
  std::promise<void> opened;
  opened_ = opened.get_future();
  encoder_ =
      std::thread([this, promise = std::move(opened)]() mutable { encode(std::move(promise)); });
}

VideoFile::~VideoFile() { close(kFinishTimeout); }

void VideoFile::wait_until_open() {
  if (opened_.valid()) opened_.get();
}

bool VideoFile::add(const cv::Mat& image_bgr, WhenFull when_full) {
  const bool fits = image_bgr.size() == size_px_ && image_bgr.type() == CV_8UC3;
  if (fits && (when_full == WhenFull::wait ? queue_.push(image_bgr, 1, kMaxAhead + 1)
                                           : queue_.try_push(image_bgr)))
    return true;
  ++dropped_;
  return false;
}

// Runs in the encoder thread. It also opens and closes the file, because the codec's own threads
// inherit the niceness of the thread that opens it. `opened` gets the OutputError if that failed.
void VideoFile::encode(std::promise<void> opened) {
  lower_priority();
  std::unique_ptr<VideoWriter> encoder;
  try {
    encoder = open_encoder(file_, size_px_, options_.frame_rate_hz);
  } catch (const OutputError&) {
    queue_.close();
    dropped_ += queue_.clear().size();
    opened.set_exception(std::current_exception());
    return;
  }
  opened.set_value();
  encode_frames(*encoder);
  if (!is_usable_) return;
  try {
    encoder->finish();  // also if the disk counts as full: min_free_bytes are for these frames
  } catch (const OutputError& error) {
    if (failure_.empty()) failure_ = error.what();
  }
}

void VideoFile::encode_frames(VideoWriter& encoder) {
  while (const std::optional<cv::Mat> image = queue_.pop()) {
    const bool is_late = Clock::now() >= deadline_.load();
    if (!is_late) failure_ = write(encoder, *image);
    if (is_late || !failure_.empty()) {
      queue_.close();
      dropped_ += 1 + queue_.clear().size();
    } else {
      ++written_;
    }
  }
}

// Returns why the image could not be written, or an empty text.
std::string VideoFile::write(VideoWriter& encoder, const cv::Mat& image_bgr) {
  if (const std::string full = why_disk_full(file_, options_.min_free_bytes); !full.empty())
    return full;
  try {
    encoder.write(image_bgr);
  } catch (const OutputError& error) {
    is_usable_ = false;
    return error.what();
  }
  return {};
}

void VideoFile::close(std::chrono::milliseconds timeout) {
  if (!encoder_.joinable()) return;
  deadline_ = Clock::now() + timeout;
  queue_.close();
  encoder_.join();
}

void VideoFile::finish(std::chrono::milliseconds timeout) {
  if (!encoder_.joinable()) return;
  close(timeout);
  wait_until_open();
  if (!failure_.empty()) throw OutputError(failure_);
  std::error_code error;
  if (written_ > 0 && (std::filesystem::file_size(file_, error) == 0 || error))
    throw OutputError(file_.string() + ": the encoder wrote nothing" +
                      (error ? ": " + error.message() : std::string()));
}

void lower_priority() { setpriority(PRIO_PROCESS, id_t(gettid()), kBackgroundNiceness); }

void write_png(const std::filesystem::path& file, const cv::Mat& image_bgr) {
  check_folder(file);
  const std::vector<std::uint8_t> png = png_of(file, image_bgr);
  const std::filesystem::path part = file.string() + ".part";
  const auto fail = [&](const std::string& what) {
    const std::string reason = std::strerror(errno);
    std::remove(part.c_str());
    throw OutputError(file.string() + ": " + what + ": " + reason);
  };
  std::FILE* out = std::fopen(part.c_str(), "wb");
  if (!out) fail("cannot create it");
  const bool all = std::fwrite(png.data(), 1, png.size(), out) == png.size();
  const bool flushed = all && std::fflush(out) == 0 && fsync(fileno(out)) == 0;
  const bool closed = std::fclose(out) == 0;
  if (!flushed || !closed) fail("cannot write it");
  if (std::rename(part.c_str(), file.c_str()) != 0) fail("cannot rename the temporary file");
}

}  // namespace fivepipe::render
