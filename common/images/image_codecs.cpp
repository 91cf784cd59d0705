#include "common/images/image_codecs.h"

#include "common/images/image_codecs_module.h"

namespace fivepipe::images {
namespace {

Decode* decode_function() {
  static auto* const found = reinterpret_cast<Decode*>(function_of(kImagesModule, kDecode));
  return found;
}

EncodePng* encode_png_function() {
  static auto* const found = reinterpret_cast<EncodePng*>(function_of(kImagesModule, kEncodePng));
  return found;
}

}  // namespace

cv::Mat decode(const std::string& bytes, int flags) {
  cv::Mat image;
  decode_function()(bytes, flags, image);
  return image;
}

std::vector<std::uint8_t> png_of(const cv::Mat& image) {
  std::vector<std::uint8_t> bytes;
  encode_png_function()(image, bytes);
  return bytes;
}

}  // namespace fivepipe::images
