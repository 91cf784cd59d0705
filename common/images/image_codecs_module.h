// The function of the module fivepipe_images.so.
#pragma once
#include <opencv2/core/mat.hpp>
#include <string>

#include "common/base/process/optional_module.h"

namespace fivepipe::images {

inline constexpr base::OptionalModule kImagesModule{"fivepipe_images.so", "OpenCV's imgcodecs",
                                                    "libopencv-imgcodecs-dev"};

inline constexpr const char* kDecode = "fivepipe_decode_image";
using Decode = void(const std::string& bytes, int flags, cv::Mat& image);

}  // namespace fivepipe::images
