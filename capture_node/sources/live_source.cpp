#include "capture_node/sources/live_source.h"

#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

namespace fivepipe::capture {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// Between two attempts to open a stream again.
constexpr auto kRetryPeriod = 500ms;
// Lets the node exit within two seconds of Ctrl-C.
constexpr auto kReaderStopTimeout = 1s;

// Shared with the reader thread, which may outlive the source while the driver blocks.
class Mailbox {
 public:
  struct Newest {
    cv::Mat bgr;
    std::int64_t taken_ns = 0;
    std::uint64_t number = 0;  // of images so far
  };

  // For the reader thread.

  // Returns false if the reader is to stop.
  bool goes_on() {
    const std::lock_guard lock(mutex_);
    return !stop_;
  }
  // Returns false if the reader is to stop, or no image can follow.
  bool put(NextImage next) {
    const std::lock_guard lock(mutex_);
    switch (next.status) {
      case NextImage::Status::image:
        newest_ = {std::move(next.bgr), next.taken_ns, newest_.number + 1};
        hint_.clear();
        fault_.reset();
        break;
      case NextImage::Status::none: hint_ = std::move(next.why); return !stop_;
      case NextImage::Status::lost:
      case NextImage::Status::failed:
        fault_ = {
            SourceFault::hardware_failed,
            (newest_.number > 0 ? "stopped delivering: " : "delivers no images: ") + next.why};
        lost_ = fault_->what;
        is_final_ = next.status == NextImage::Status::failed;
        break;
      case NextImage::Status::end: has_ended_ = true; break;
    }
    changed_.notify_all();
    return !stop_ && !is_final_ && !has_ended_;
  }
  // The stream cannot be opened, at the start or again. Keeps the reason why it was lost.
  void put_fault(StreamFault fault) {
    const std::lock_guard lock(mutex_);
    if (!lost_.empty()) fault.what = lost_ + "; connecting again: " + fault.what;
    fault_ = std::move(fault);
    changed_.notify_all();
  }
  // Returns false if the reader is to stop.
  bool wait_to_retry() {
    std::unique_lock lock(mutex_);
    return !changed_.wait_for(lock, kRetryPeriod, [&] { return stop_; });
  }
  void reader_has_ended() {
    const std::lock_guard lock(mutex_);
    reader_has_ended_ = true;
    changed_.notify_all();
  }

  // For the source.

  // Waits for an image after the one with this number, a fault or the end. Returns whether there is
  // such an image.
  bool wait_for_image(std::uint64_t after, Clock::time_point until) {
    std::unique_lock lock(mutex_);
    changed_.wait_until(lock, until,
                        [&] { return newest_.number > after || fault_ || has_ended_; });
    return newest_.number > after;
  }
  Newest newest() {
    const std::lock_guard lock(mutex_);
    return newest_;
  }
  std::optional<StreamFault> fault() {
    const std::lock_guard lock(mutex_);
    return fault_;
  }
  std::string hint() {
    const std::lock_guard lock(mutex_);
    return hint_;
  }
  bool has_ended() {
    const std::lock_guard lock(mutex_);
    return has_ended_;
  }
  // Returns true if no image can follow.
  bool is_final() {
    const std::lock_guard lock(mutex_);
    return is_final_ || has_ended_;
  }
  void stop() {
    const std::lock_guard lock(mutex_);
    stop_ = true;
    changed_.notify_all();
  }
  // Returns whether the reader has ended.
  bool wait_for_end_of_reader(Clock::time_point until) {
    std::unique_lock lock(mutex_);
    return changed_.wait_until(lock, until, [&] { return reader_has_ended_; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  Newest newest_;
  std::optional<StreamFault> fault_;  // why there is no image now
  std::string lost_;                  // what() of the last loss
  std::string hint_;                  // why the next image is late
  bool is_final_ = false, has_ended_ = false, stop_ = false, reader_has_ended_ = false;
};

// Calls next(); an exception, such as OpenCV's, loses the stream.
NextImage next_of(ImageStream& stream) {
  try {
    return stream.next();
  } catch (const std::exception& error) {
    return {NextImage::Status::lost, {}, 0, error.what()};
  }
}

void read_stream(std::unique_ptr<ImageStream> stream, const std::shared_ptr<Mailbox>& mailbox) {
  bool is_open = false;
  while (mailbox->goes_on()) {
    if (!is_open) {
      if (std::optional<StreamFault> fault = stream->open()) {
        mailbox->put_fault(std::move(*fault));
        if (!mailbox->wait_to_retry()) break;
        continue;
      }
      is_open = true;
    }
    NextImage next = next_of(*stream);
    const bool is_lost = next.status == NextImage::Status::lost;
    if (!mailbox->put(std::move(next))) break;
    if (!is_lost) continue;
    is_open = false;
    if (!mailbox->wait_to_retry()) break;
  }
  stream.reset();  // may block
  mailbox->reader_has_ended();
}

class LiveSource final : public ImageSource {
 public:
  LiveSource(const config::RigCamera& camera, LiveSourceSettings settings,
             std::unique_ptr<ImageStream> stream)
      : name_(std::move(settings.name)),
        width_px_(camera.source.width_px),
        height_px_(camera.source.height_px),
        mailbox_(std::make_shared<Mailbox>()),
        reader_([owned = std::move(stream), mailbox = mailbox_]() mutable {
          read_stream(std::move(owned), mailbox);
        }) {
    const auto fail = [&](SourceFault fault, const std::string& what) {
      close();
      throw_problems({{camera.name, fault, name_ + ": " + what}});
    };
    if (!mailbox_->wait_for_image(0, Clock::now() + settings.first_image_timeout)) {
      if (const auto fault = mailbox_->fault()) fail(fault->fault, fault->what);
      if (mailbox_->has_ended()) fail(SourceFault::no_frames, "has no image");
      const std::string hint = mailbox_->hint();
      fail(SourceFault::hardware_failed,
           "delivers no images: " + (hint.empty() ? settings.silence : hint));
    }
    if (const cv::Mat first = take_newest(); first.cols != width_px_ || first.rows != height_px_)
      fail(SourceFault::wrong_size,
           "delivers images of " + std::to_string(first.cols) + "x" + std::to_string(first.rows) +
               " px, image_size_px of the rig is " + std::to_string(width_px_) + "x" +
               std::to_string(height_px_));
  }
  ~LiveSource() override { close(); }

  bool wait_for_image(Clock::time_point until) override {
    return mailbox_->wait_for_image(images_read_, until);
  }
  ReadStatus read(std::int64_t, cv::Mat& bgr) override {
    if (mailbox_->newest().number == images_read_) {
      if (mailbox_->has_ended()) return ReadStatus::end;
      const std::string hint = mailbox_->hint();
      const std::optional<StreamFault> fault = mailbox_->fault();
      last_error_ =
          name_ + ": " +
          (fault ? fault->what : "no image within 0.5 s" + (hint.empty() ? "" : ": " + hint));
      return ReadStatus::missing;
    }
    const cv::Mat image = take_newest();
    if (image.cols != width_px_ || image.rows != height_px_) {
      last_error_ = name_ + ": the size of the images has changed";
      return ReadStatus::missing;
    }
    bgr = image;
    return ReadStatus::image;
  }
  std::int64_t stamp_ns() const override { return stamp_ns_; }
  std::string last_error() const override { return last_error_; }
  bool is_live() const override { return !mailbox_->is_final(); }
  void stop() override {
    if (stop_until_) return;
    mailbox_->stop();
    stop_until_ = Clock::now() + kReaderStopTimeout;
  }

 private:
  cv::Mat take_newest() {
    Mailbox::Newest newest = mailbox_->newest();
    images_read_ = newest.number;
    stamp_ns_ = newest.taken_ns;
    return std::move(newest.bgr);
  }
  void close() {
    if (!reader_.joinable()) return;
    stop();
    if (mailbox_->wait_for_end_of_reader(*stop_until_))
      reader_.join();
    else
      reader_.detach();
  }

  std::string name_, last_error_;
  int width_px_, height_px_;
  std::shared_ptr<Mailbox> mailbox_;
  std::thread reader_;
  std::uint64_t images_read_ = 0;
  std::int64_t stamp_ns_ = 0;                    // of the image read last
  std::optional<Clock::time_point> stop_until_;  // after stop()
};

}  // namespace

std::unique_ptr<ImageSource> open_live_source(const config::RigCamera& camera,
                                              LiveSourceSettings settings,
                                              std::unique_ptr<ImageStream> stream) {
  return std::make_unique<LiveSource>(camera, std::move(settings), std::move(stream));
}

}  // namespace fivepipe::capture
