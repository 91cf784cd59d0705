#include "common/images/image_codecs_module.h"

#include <opencv2/imgcodecs.hpp>

extern "C" {

void fivepipe_decode_image(const std::string& bytes, int flags, cv::Mat& image) {
  const cv::Mat file(1, int(bytes.size()), CV_8U, const_cast<char*>(bytes.data()));
  image = cv::imdecode(file, flags);
}

}  // extern "C"
