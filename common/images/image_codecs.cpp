#include "common/images/image_codecs.h"

#include "common/images/image_codecs_module.h"

namespace fivepipe::images {
namespace {

Decode* decode_function() {
  static auto* const found = reinterpret_cast<Decode*>(function_of(kImagesModule, kDecode));
  return found;
}

}  // namespace

cv::Mat decode(const std::string& bytes, int flags) {
  cv::Mat image;
  decode_function()(bytes, flags, image);
  return image;
}

}  // namespace fivepipe::images
