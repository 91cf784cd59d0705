#include "capture_node/object_finder.h"

#include <algorithm>

#include "capture_node/segmentation/coverage_estimate.h"
#include "capture_node/segmentation/image_mask.h"
#include "capture_node/segmentation/matte.h"
#include "capture_node/sources/synthetic_source.h"
#include "common/config/capture/image_path.h"

namespace fivepipe::capture {
namespace {

using Within = std::optional<hull::ObjectPixels>;

// The captured pixels in which objects are searched; nullopt: all.
Within searched_pixels(const config::RigCamera& camera, const config::SegmentationConfig& config) {
  Within within;
  if (config.volume_m) within = pixels_of_volume(camera, *config.volume_m);
  if (const auto region = config.regions.find(camera.name); region != config.regions.end()) {
    hull::ObjectPixels pixels = read_region(camera, region->second);
    if (within) pixels.keep(*within);
    within = std::move(pixels);
  }
  return within;
}

std::vector<cv::Mat> empty_frames(const config::RigCamera& camera,
                                  const config::LearnedBackground& background,
                                  ImageSource& source) {
  if (!background.file.empty()) return read_background(camera, background.file);
  std::vector<cv::Mat> images;
  if (auto* synthetic = dynamic_cast<SyntheticImageSource*>(&source)) {
    for (int i = 0; i < kSyntheticBackgroundFrames; ++i) images.push_back(synthetic->background(i));
    return images;
  }
  bool is_bgr = true;
  const int attempts = source.is_live() ? 2 * background.frames : background.frames;
  for (int i = 0; i < attempts && std::ssize(images) < background.frames; ++i) {
    source.wait_for_image(std::chrono::steady_clock::now() + kImageTimeout);
    if (cv::Mat image; source.read(i, image) == ReadStatus::image) {
      is_bgr = is_bgr && image.type() == CV_8UC3;
      images.push_back(image);
    }
  }
  if (!is_bgr)
    throw_problems({{camera.name, SourceFault::hardware_failed, "its images are not 8-bit BGR"}});
  if (images.empty())
    throw_problems({{camera.name, SourceFault::no_frames,
                     "no image of the empty scene; " + source.last_error()}});
  if (source.is_live() && std::ssize(images) < background.frames)
    throw_problems(
        {{camera.name, SourceFault::no_frames,
          "only " + std::to_string(images.size()) + " of " + std::to_string(background.frames) +
              " images of the empty scene; " + source.last_error()}});
  return images;
}

class BackgroundFinder final : public ObjectFinder {
 public:
  BackgroundFinder(Segmenter segmenter, double frame_rate_hz, bool want_coverage)
      : segmenter_(std::move(segmenter)),
        frame_rate_hz_(frame_rate_hz),
        want_coverage_(want_coverage) {}
  Found find(const cv::Mat& image, std::int64_t index) override {
    // Pacing skips frames. After a restart of the file, the index decreases.
    const std::int64_t elapsed = last_index_ && index > *last_index_ ? index - *last_index_ : 1;
    last_index_ = index;
    segmenter_.set_period_s(double(elapsed) / frame_rate_hz_);
    std::optional<Segmentation> segmentation = segmenter_.segment(image);
    if (!segmentation) return {{}, "the image is not 8-bit BGR of the size image_size_px"};
    if (want_coverage_) segmentation->coverage = segmenter_.coverage(image, *segmentation);
    return {std::move(segmentation), ""};
  }

 private:
  Segmenter segmenter_;
  double frame_rate_hz_;
  bool want_coverage_;
  std::optional<std::int64_t> last_index_;
};

// Object pixels that are known, without steps of segmentation.
ObjectFinder::Found known(hull::ObjectPixels pixels, const Within& within,
                          std::optional<hull::CoverageMap> coverage) {
  bool all_outside = false;
  if (within) {
    all_outside = pixels.count() > 0 && pixels.count_common(*within) == 0;
    pixels.keep(*within);
    if (coverage) coverage->keep(*within);
  }
  Segmentation segmentation;
  segmentation.difference = {pixels, pixels, {pixels.width_px(), pixels.height_px()}};
  segmentation.object = std::move(pixels);
  segmentation.coverage = std::move(coverage);
  return {std::move(segmentation), "", false, all_outside};
}

class MatteFinder final : public ObjectFinder {
 public:
  // offset: of the index of a mask from that of its image.
  MatteFinder(std::unique_ptr<ImageSource> masks, std::int64_t offset, Within within,
              bool want_coverage)
      : masks_(std::move(masks)),
        offset_(offset),
        within_(std::move(within)),
        want_coverage_(want_coverage) {}
  Found find(const cv::Mat&, std::int64_t index) override {
    cv::Mat mask;
    switch (masks_->read(index + offset_, mask)) {
      case ReadStatus::image:
        return known(pixels_of_mask(mask), within_,
                     want_coverage_ ? std::optional(coverage_of_mask(mask)) : std::nullopt);
      case ReadStatus::missing: return {{}, masks_->last_error()};
      case ReadStatus::end: break;
    }
    return {{}, "the file of its masks has ended", true};
  }
  std::optional<std::int64_t> length(std::int64_t up_to) override {
    const std::optional<std::int64_t> masks = masks_->length(up_to + offset_);
    return masks ? std::optional(*masks - offset_) : std::nullopt;
  }

 private:
  std::unique_ptr<ImageSource> masks_;
  std::int64_t offset_;
  Within within_;
  bool want_coverage_;
};

class AlphaFinder final : public ObjectFinder {
 public:
  AlphaFinder(Within within, bool want_coverage)
      : within_(std::move(within)), want_coverage_(want_coverage) {}
  Found find(const cv::Mat& image, std::int64_t) override {
    if (image.type() != CV_8UC4) return {{}, "the picture has no 8-bit alpha channel"};
    return known(pixels_of_alpha(image), within_,
                 want_coverage_ ? std::optional(coverage_of_alpha(image)) : std::nullopt);
  }

 private:
  Within within_;
  bool want_coverage_;
};

class ChromaFinder final : public ObjectFinder {
 public:
  ChromaFinder(const config::ChromaKey& key, Within within, bool want_coverage)
      : keyer_(key), within_(std::move(within)), want_coverage_(want_coverage) {}
  Found find(const cv::Mat& image, std::int64_t) override {
    if (image.type() != CV_8UC3) return {{}, "the image is not 8-bit BGR"};
    Found found = known(keyer_.object_pixels(image), within_, std::nullopt);
    // The colour of the screen differs from pixel to pixel by its light.
    if (want_coverage_)
      found.segmentation->coverage = estimated_coverage(image, found.segmentation->object, {});
    return found;
  }

 private:
  ChromaKeyer keyer_;
  Within within_;
  bool want_coverage_;
};

}  // namespace

std::unique_ptr<ObjectFinder> open_object_finder(const config::RigCamera& camera,
                                                 const config::CaptureConfig& config,
                                                 ImageSource& source, double frame_rate_hz) {
  const config::SegmentationConfig& segmentation = config.segmentation_for(camera.name);
  Within within = searched_pixels(camera, segmentation);
  const config::CameraSource& of_camera = config.sources.at(camera.name);
  const config::ObjectKey key = config::key_of(of_camera);
  const auto* const video = std::get_if<config::VideoSource>(&of_camera);
  const int first_frame = video ? video->first_frame : 0;
  if (const auto* matte = std::get_if<config::MatteFile>(&key)) {
    auto masks = open_file_source(camera, {matte->file, {}, first_frame});
    // Pictures and masks of one number belong together, also if the first ones are missing.
    const auto image_number = source.first_number(), mask_number = masks->first_number();
    const std::int64_t offset = image_number && mask_number ? *image_number - *mask_number : 0;
    // The images of a video have no numbers. Most programs begin at 0 or 1.
    if (!config::is_sequence(video->file) && mask_number.value_or(0) > 1)
      throw_problems({{camera.name, SourceFault::no_frames,
                       matte->file +
                           ": the masks of a video must begin at number 0 or 1, for its "
                           "first image; they begin at " +
                           std::to_string(*mask_number)}});
    return std::make_unique<MatteFinder>(std::move(masks), offset, std::move(within),
                                         config.coverage);
  }
  if (std::holds_alternative<config::AlphaChannel>(key))
    return std::make_unique<AlphaFinder>(std::move(within), config.coverage);
  if (const auto* screen = std::get_if<config::ChromaKey>(&key))
    return std::make_unique<ChromaFinder>(*screen, std::move(within), config.coverage);
  Segmenter segmenter(
      learn_background(empty_frames(camera, std::get<config::LearnedBackground>(key), source),
                       learning_settings(segmentation)),
      segmentation, std::move(within));
  return std::make_unique<BackgroundFinder>(std::move(segmenter), frame_rate_hz, config.coverage);
}

}  // namespace fivepipe::capture
