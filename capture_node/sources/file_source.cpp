#include <algorithm>
#include <filesystem>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <utility>

#include "capture_node/sources/image_source.h"
#include "common/base/readable_file.h"
#include "common/config/capture/image_path.h"

namespace fivepipe::capture {
namespace {

namespace fs = std::filesystem;

std::string size_text(int width_px, int height_px) {
  return std::to_string(width_px) + "x" + std::to_string(height_px);
}

std::string size_problem(const std::string& file, const cv::Mat& image,
                         const config::RigCamera& camera) {
  return file + ": images are " + size_text(image.cols, image.rows) +
         " px, image_size_px of the rig is " +
         size_text(camera.source.width_px, camera.source.height_px);
}

// Random access to the frames of one file or sequence; does not loop.
class Frames {
 public:
  virtual ~Frames() = default;
  // Returns nullopt if the frame is beyond the end or unreadable.
  virtual std::optional<cv::Mat> at(std::int64_t index) = 0;
  // Returns the number of frames, or nullopt until it is known. A video's header contains only an
  // estimate; reading to its end gives the exact number.
  virtual std::optional<std::int64_t> count() const = 0;
  virtual std::int64_t count_guess() const = 0;
  // The indices of the frames that are not missing; empty if it is not known.
  virtual std::vector<std::int64_t> present() const { return {}; }
  // The number in the file name of frame 0; nullopt for a video or a single picture.
  virtual std::optional<std::int64_t> first_number() const { return std::nullopt; }
};

class VideoFrames final : public Frames {
 public:
  explicit VideoFrames(std::string file) : file_(std::move(file)), video_(file_, cv::CAP_FFMPEG) {}
  bool opened() const { return video_.isOpened(); }

  // Decodes all frames before `index`, because decoders seek to key frames only, or to wrong
  // frames.
  std::optional<cv::Mat> at(std::int64_t index) override {
    if (count_ && index >= *count_) return std::nullopt;
    if (index == image_index_) return image_;
    if (index < next_) {
      video_.open(file_, cv::CAP_FFMPEG);
      next_ = 0;
    }
    for (; next_ <= index; ++next_)
      if (!video_.grab()) {
        count_ = next_;
        return std::nullopt;
      }
    // Images of megabytes from new memory cost more than their copies: the last one's is used again
    // unless the caller still holds it.
    if (image_.u != nullptr && image_.u->refcount > 1) image_.release();
    if (!video_.retrieve(image_)) image_.release();
    image_index_.reset();
    if (image_.empty()) return std::nullopt;
    image_index_ = index;
    return image_;
  }
  std::optional<std::int64_t> count() const override { return count_; }
  std::int64_t count_guess() const override {
    return count_ ? *count_ : std::int64_t(video_.get(cv::CAP_PROP_FRAME_COUNT));
  }

 private:
  std::string file_;
  cv::VideoCapture video_;
  cv::Mat image_;
  std::optional<std::int64_t> image_index_;  // nullopt: image_ is empty
  std::int64_t next_ = 0;
  std::optional<std::int64_t> count_;
};

// Index 0 is the smallest number present. A gap in the numbers is a missing frame.
class SequenceFrames final : public Frames {
 public:
  SequenceFrames(std::map<std::int64_t, fs::path> files, bool has_alpha)
      : files_(std::move(files)), flags_(has_alpha ? cv::IMREAD_UNCHANGED : cv::IMREAD_COLOR) {}
  std::optional<cv::Mat> at(std::int64_t index) override {
    const auto file = files_.find(files_.begin()->first + index);
    if (file == files_.end()) return std::nullopt;
    cv::Mat image = cv::imread(file->second.string(), flags_);
    if (image.empty()) return std::nullopt;
    return image;
  }
  std::optional<std::int64_t> count() const override {
    return files_.rbegin()->first - files_.begin()->first + 1;
  }
  std::int64_t count_guess() const override { return *count(); }
  std::vector<std::int64_t> present() const override {
    std::vector<std::int64_t> indices;
    for (const auto& [number, path] : files_) indices.push_back(number - files_.begin()->first);
    return indices;
  }
  std::optional<std::int64_t> first_number() const override {
    return files_.size() > 1 ? std::optional(files_.begin()->first) : std::nullopt;
  }

 private:
  std::map<std::int64_t, fs::path> files_;
  int flags_;
};

// Throws SourceError if the file is missing or cannot be decoded.
std::unique_ptr<Frames> open_frames(const config::RigCamera& camera, const std::string& file,
                                    bool has_alpha = false) {
  const auto fail = [&](SourceFault fault, const std::string& what) {
    throw_problems({{camera.name, fault, file + ": " + what}});
  };
  std::unique_ptr<Frames> frames;
  if (config::is_sequence(file)) {
    config::Pictures pictures = config::pictures_of(file);
    if (!pictures.problem.empty()) fail(SourceFault::not_found, pictures.problem);
    for (const auto& [index, path] : pictures.files)
      if (const auto why = base::why_unreadable(path))
        fail(SourceFault::not_found, path.filename().string() + ": " + *why);
    frames = std::make_unique<SequenceFrames>(std::move(pictures.files), has_alpha);
  } else if (const auto why = base::why_unreadable(file)) {
    fail(SourceFault::not_found, *why);
  } else if (config::is_single_picture(file)) {
    frames =
        std::make_unique<SequenceFrames>(std::map<std::int64_t, fs::path>{{0, file}}, has_alpha);
  } else if (has_alpha) {
    fail(SourceFault::not_decodable,
         "alpha needs pictures, such as frame_%04d.png; a video is decoded without its alpha");
  } else {
    auto video = std::make_unique<VideoFrames>(file);
    if (!video->opened()) fail(SourceFault::not_decodable, "cannot decode this video");
    frames = std::move(video);
  }
  return frames;
}

class FileSource final : public ImageSource {
 public:
  FileSource(const config::RigCamera& camera, const config::VideoSource& source)
      : file_(source.file),
        width_px_(camera.source.width_px),
        height_px_(camera.source.height_px),
        first_(source.first_frame),
        frames_(open_frames(camera, source.file,
                            std::holds_alternative<config::AlphaChannel>(source.key))) {
    const std::optional<cv::Mat> first = frames_->at(first_);
    if (!first) {
      const bool none = frames_->count() && *frames_->count() <= first_;
      throw_problems({{camera.name, none ? SourceFault::no_frames : SourceFault::not_decodable,
                       file_ + (none ? ": has no frame " : ": cannot decode frame ") +
                           std::to_string(first_)}});
    }
    if (first->cols != width_px_ || first->rows != height_px_)
      throw_problems({{camera.name, SourceFault::wrong_size, size_problem(file_, *first, camera)}});
    first_image_ = *first;
  }

  ReadStatus read(std::int64_t frame, cv::Mat& bgr) override {
    const std::int64_t index = first_ + frame;
    cv::Mat decoded_at_start = std::exchange(first_image_, cv::Mat());
    if (frame == 0 && !decoded_at_start.empty()) {
      bgr = decoded_at_start;
      return ReadStatus::image;
    }
    if (const std::optional<cv::Mat> image = frames_->at(index)) {
      if (image->cols == width_px_ && image->rows == height_px_) {
        bgr = *image;
        return ReadStatus::image;
      }
      last_error_ =
          file_ + ": frame " + std::to_string(index) + " is " + size_text(image->cols, image->rows);
      return ReadStatus::missing;
    }
    if (frames_->count() && index >= *frames_->count())
      return ReadStatus::end;  // at() has just determined the count, if it was unknown
    last_error_ = file_ + ": frame " + std::to_string(index) + " is missing or cannot be decoded";
    return ReadStatus::missing;
  }
  std::string last_error() const override { return last_error_; }
  std::optional<std::int64_t> first_number() const override { return frames_->first_number(); }
  std::optional<std::int64_t> length(std::int64_t up_to) override {
    if (!frames_->count()) frames_->at(first_ + up_to);
    const std::optional<std::int64_t> count = frames_->count();
    return count && *count - first_ <= up_to ? std::optional(*count - first_) : std::nullopt;
  }

 private:
  std::string file_, last_error_;
  int width_px_, height_px_;
  std::int64_t first_;
  cv::Mat first_image_;  // of frame 0, until the first read
  std::unique_ptr<Frames> frames_;
};

}  // namespace

std::unique_ptr<ImageSource> open_file_source(const config::RigCamera& camera,
                                              const config::VideoSource& source) {
  return std::make_unique<FileSource>(camera, source);
}

cv::Size image_size(const config::RigCamera& camera, const std::string& file) {
  const std::optional<cv::Mat> first = open_frames(camera, file)->at(0);
  if (!first)
    throw_problems(
        {{camera.name, SourceFault::no_frames, file + ": cannot decode its first frame"}});
  return first->size();
}

namespace {

// The indices of at most kMaxBackgroundFrames of the frames, evenly spaced.
std::vector<std::int64_t> evenly_spaced(const std::vector<std::int64_t>& indices) {
  const std::size_t step = (indices.size() + kMaxBackgroundFrames - 1) / kMaxBackgroundFrames;
  std::vector<std::int64_t> some;
  for (std::size_t i = 0; i < indices.size(); i += step) some.push_back(indices[i]);
  return some;
}

// The images of a video, evenly spaced. Some videos do not state their number of frames: then every
// second image is dropped, whenever there are too many.
std::vector<cv::Mat> images_of_video(Frames& video) {
  const bool is_count_known = video.count_guess() > 0;
  std::int64_t step = std::max<std::int64_t>(
      1, (video.count_guess() + kMaxBackgroundFrames - 1) / kMaxBackgroundFrames);
  std::vector<cv::Mat> images;
  const auto is_full = [&] { return int(images.size()) == kMaxBackgroundFrames; };
  for (std::int64_t index = 0; !(is_count_known && is_full()); index += step) {
    const std::optional<cv::Mat> image = video.at(index);
    if (!image) {
      if (video.count() && index >= *video.count()) break;
      continue;
    }
    if (is_full()) {
      for (std::size_t i = 1; 2 * i < images.size(); ++i) images[i] = images[2 * i];
      images.resize(images.size() / 2);
      step *= 2;
    }
    images.push_back(*image);
  }
  return images;
}

}  // namespace

std::vector<cv::Mat> read_background(const config::RigCamera& camera, const std::string& file) {
  const std::unique_ptr<Frames> frames = open_frames(camera, file);
  std::vector<cv::Mat> images;
  if (const std::vector<std::int64_t> present = frames->present(); present.empty())
    images = images_of_video(*frames);
  else
    for (const std::int64_t index : evenly_spaced(present))
      if (const std::optional<cv::Mat> image = frames->at(index)) images.push_back(*image);
  if (images.empty())
    throw_problems({{camera.name, SourceFault::no_frames, file + ": cannot decode any frame"}});
  for (const cv::Mat& image : images)
    if (image.cols != camera.source.width_px || image.rows != camera.source.height_px)
      throw_problems({{camera.name, SourceFault::wrong_size, size_problem(file, image, camera)}});
  return images;
}

hull::ObjectPixels read_region(const config::RigCamera& camera, const std::string& file) {
  if (const auto why = base::why_unreadable(file))
    throw_problems({{camera.name, SourceFault::not_found, file + ": " + *why}});
  const cv::Mat picture = cv::imread(file, cv::IMREAD_GRAYSCALE);
  if (picture.empty())
    throw_problems(
        {{camera.name, SourceFault::not_decodable, file + ": cannot decode this picture"}});
  if (picture.cols != camera.source.width_px || picture.rows != camera.source.height_px)
    throw_problems({{camera.name, SourceFault::wrong_size, size_problem(file, picture, camera)}});
  hull::ObjectPixels pixels(picture.cols, picture.rows);
  for (int v = 0; v < picture.rows; ++v)
    for (int u = 0; u < picture.cols; ++u)
      if (picture.at<std::uint8_t>(v, u) > 0) pixels.set(u, v);
  return pixels;
}

}  // namespace fivepipe::capture
