#include "benchmarks/capture/scores.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "capture_node/segmentation/bit_morphology.h"

namespace fivepipe::capture_bench {
namespace {

// Object pixels with a neighbour that is none.
hull::ObjectPixels outline(const hull::ObjectPixels& pixels) {
  hull::ObjectPixels result = pixels;
  result.remove(capture::eroded(pixels, 1));
  return result;
}

// The distance of each pixel to the nearest one that is set; kMaxDistance_px without any.
cv::Mat distances_to(const hull::ObjectPixels& pixels) {
  cv::Mat is_unset(pixels.height_px(), pixels.width_px(), CV_8UC1, cv::Scalar(1)), distance;
  bool any = false;
  pixels.for_each_run({0, 0, pixels.width_px(), pixels.height_px()},
                      [&](int v, int begin, int end) {
                        any = true;
                        std::fill(is_unset.ptr(v) + begin, is_unset.ptr(v) + end, std::uint8_t(0));
                      });
  if (!any) return cv::Mat(is_unset.size(), CV_32FC1, cv::Scalar(Score::kMaxDistance_px));
  cv::distanceTransform(is_unset, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  return distance;
}

}  // namespace

void Score::add(const hull::ObjectPixels& found, const hull::ObjectPixels& truth) {
  both_ += double(found.count_common(truth));
  found_ += double(found.count());
  true_ += double(truth.count());
  const hull::ObjectPixels outlines[2] = {outline(found), outline(truth)};
  for (int from = 0; from < 2; ++from) {
    const cv::Mat distance_px = distances_to(outlines[1 - from]);
    outlines[from].for_each_run(
        {0, 0, truth.width_px(), truth.height_px()}, [&](int v, int begin, int end) {
          for (int u = begin; u < end; ++u)
            distance_px_ += std::min(kMaxDistance_px, double(distance_px.at<float>(v, u)));
          outline_px_ += end - begin;
        });
  }
}

double Score::f1() const { return found_ + true_ > 0 ? 2 * both_ / (found_ + true_) : 1; }
double Score::iou() const {
  const double either = found_ + true_ - both_;
  return either > 0 ? both_ / either : 1;
}
double Score::recall() const { return true_ > 0 ? both_ / true_ : 1; }
double Score::boundary_error_px() const { return outline_px_ > 0 ? distance_px_ / outline_px_ : 0; }

}  // namespace fivepipe::capture_bench
