#include "render_node/output/notice.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace fivepipe::render {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kBarHeight = 1.0 / 16;  // of the image's height
constexpr double kTextHeight = 0.5;      // of the bar's height
constexpr double kTextWidth = 0.94;      // of the eye's width, at most
constexpr double kMinText_px = 4;        // smaller letters cannot be read
constexpr double kDark = 0.25;           // brightness that the bar leaves

}  // namespace

void draw_notice(cv::Mat& image_bgr, const std::string& text, int eyes) {
  const int width_px = image_bgr.cols / eyes,
            bar_px = std::max(1, int(kBarHeight * image_bgr.rows));
  int baseline_px = 0;
  const cv::Size unit = cv::getTextSize(text, kFont, 1, 1, &baseline_px);
  const double scale = std::min(kTextHeight * bar_px / std::max(1, unit.height),
                                kTextWidth * width_px / std::max(1, unit.width));
  image_bgr.rowRange(image_bgr.rows - bar_px, image_bgr.rows) *= kDark;
  if (scale * unit.height < kMinText_px) return;
  const int thickness = std::max(1, int(1.5 * scale));
  const cv::Size size = cv::getTextSize(text, kFont, scale, thickness, &baseline_px);
  cv::Mat bar = image_bgr.rowRange(image_bgr.rows - bar_px, image_bgr.rows);
  for (int eye = 0; eye < eyes; ++eye)
    cv::putText(bar, text,
                {eye * width_px + (width_px - size.width) / 2, (bar_px + size.height) / 2}, kFont,
                scale, cv::Scalar::all(255), thickness, cv::LINE_AA);
}

}  // namespace fivepipe::render
