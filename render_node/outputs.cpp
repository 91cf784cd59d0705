#include "render_node/outputs.h"

#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <vector>

namespace fivepipe::render {
namespace {

// The encoder must not slow down the nodes. On Linux each thread has its own niceness.
constexpr int kEncoderNiceness = 10;

void check_folder(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error))
    throw OutputError(file.string() + ": folder " + folder.string() + " does not exist");
  if (access(folder.c_str(), W_OK) != 0)
    throw OutputError(file.string() + ": folder " + folder.string() +
                      " may not be written: " + std::strerror(errno));
}

// Returns why the disk counts as full, or an empty text if at least min_free_bytes are free.
// cv::VideoWriter does not report a full disk.
std::string why_disk_full(const std::filesystem::path& file, std::uintmax_t min_free_bytes) {
  std::error_code error;
  const auto space =
      std::filesystem::space(file.has_parent_path() ? file.parent_path() : ".", error);
  if (error) return file.string() + ": " + error.message();
  if (space.available >= min_free_bytes) return {};
  return file.string() + ": disk full: " + std::to_string(space.available >> 20) + " MB left, " +
         std::to_string(min_free_bytes >> 20) + " MB are kept free";
}

bool open(cv::VideoWriter& writer, const std::filesystem::path& file, const std::string& codec,
          double frame_rate_hz, cv::Size size_px) {
  return writer.open(file.string(), cv::CAP_FFMPEG,
                     cv::VideoWriter::fourcc(codec[0], codec[1], codec[2], codec[3]), frame_rate_hz,
                     size_px);
}

}  // namespace

VideoFile::VideoFile(const std::filesystem::path& file, cv::Size size_px,
                     const VideoOptions& options)
    : file_(file), size_px_(size_px), options_(options) {
  check_folder(file);
  if (!(options.frame_rate_hz > 0))
    throw OutputError(file.string() + ": frame rate must be above 0");
  // YUV 4:2:0, the format that every player supports, halves the chroma in both directions.
  if (size_px.width < 2 || size_px.height < 2 || size_px.width % 2 || size_px.height % 2)
    throw OutputError(file.string() + ": a video's width and height must be even, not " +
                      std::to_string(size_px.width) + "x" + std::to_string(size_px.height));
  if (const std::string full = why_disk_full(file, options.min_free_bytes); !full.empty())
    throw OutputError(full);
  std::promise<std::string> opened;
  std::future<std::string> codec = opened.get_future();
  encoder_ =
      std::thread([this, promise = std::move(opened)]() mutable { encode(std::move(promise)); });
  codec_ = codec.get();
  if (codec_.empty()) {
    encoder_.join();
    throw OutputError(file.string() +
                      ": OpenCV can't write it, neither as H.264 (avc1) nor as MPEG-4 (mp4v)");
  }
}

VideoFile::~VideoFile() { close(kFinishTimeout); }

bool VideoFile::add(const cv::Mat& image_bgr) {
  const std::lock_guard lock(mutex_);
  if (ending_ || !failure_.empty() || queue_.size() >= options_.queue_frames ||
      image_bgr.size() != size_px_ || image_bgr.type() != CV_8UC3) {
    ++dropped_;
    return false;
  }
  queue_.push_back(image_bgr);
  changed_.notify_one();
  return true;
}

// Runs in the encoder thread. It also opens and closes the file, because the codec's own threads
// inherit the niceness of the thread that opens it.
void VideoFile::encode(std::promise<std::string> opened) {
  setpriority(PRIO_PROCESS, id_t(gettid()), kEncoderNiceness);
  cv::VideoWriter writer;
  std::string codec;
  for (const char* candidate : {"avc1", "mp4v"})
    if (codec.empty() && open(writer, file_, candidate, options_.frame_rate_hz, size_px_))
      codec = candidate;
  opened.set_value(codec);
  if (codec.empty()) return;
  for (;;) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return ending_ || !queue_.empty(); });
    if (ending_ && std::chrono::steady_clock::now() >= give_up_) {
      dropped_ += queue_.size();
      queue_.clear();
    }
    if (queue_.empty()) break;
    const cv::Mat image = std::move(queue_.front());
    queue_.pop_front();
    lock.unlock();
    std::string failure = why_disk_full(file_, options_.min_free_bytes);
    if (failure.empty()) try {
        writer.write(image);
      } catch (const cv::Exception& error) {
        failure = file_.string() + ": " + error.what();
      }
    lock.lock();
    if (failure.empty()) {
      ++written_;
      continue;
    }
    failure_ = failure;
    dropped_ += 1 + queue_.size();
    queue_.clear();
    break;
  }
  writer.release();
}

void VideoFile::close(std::chrono::milliseconds timeout) {
  {
    const std::lock_guard lock(mutex_);
    if (!ending_) give_up_ = std::chrono::steady_clock::now() + timeout;
    ending_ = true;
    changed_.notify_one();
  }
  if (encoder_.joinable()) encoder_.join();
}

void VideoFile::finish(std::chrono::milliseconds timeout) {
  if (!encoder_.joinable()) return;
  close(timeout);
  if (!failure_.empty()) throw OutputError(failure_);
  std::error_code error;
  if (written_ > 0 && (std::filesystem::file_size(file_, error) == 0 || error))
    throw OutputError(file_.string() + ": nothing was written" +
                      (error ? ": " + error.message() : std::string()));
}

std::uint64_t VideoFile::written() const {
  const std::lock_guard lock(mutex_);
  return written_;
}

std::uint64_t VideoFile::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

std::string VideoFile::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

void write_png(const std::filesystem::path& file, const cv::Mat& image_bgr) {
  check_folder(file);
  std::vector<std::uint8_t> png;
  if (image_bgr.empty() || !cv::imencode(".png", image_bgr, png))
    throw OutputError(file.string() + ": not an image that PNG can hold");
  const std::filesystem::path part = file.string() + ".part";
  const auto fail = [&](const std::string& what) {
    const std::string reason = std::strerror(errno);
    std::remove(part.c_str());
    throw OutputError(file.string() + ": " + what + ": " + reason);
  };
  std::FILE* out = std::fopen(part.c_str(), "wb");
  if (!out) fail("can't be made");
  const bool all = std::fwrite(png.data(), 1, png.size(), out) == png.size();
  const bool flushed = all && std::fflush(out) == 0 && fsync(fileno(out)) == 0;
  const bool closed = std::fclose(out) == 0;
  if (!flushed || !closed) fail("can't be written");
  if (std::rename(part.c_str(), file.c_str()) != 0) fail("can't be put in its place");
}

}  // namespace fivepipe::render
