// The functions of the module fivepipe_images.so.
#pragma once
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "common/base/process/optional_module.h"

namespace fivepipe::images {

inline constexpr base::OptionalModule kImagesModule{"fivepipe_images.so", "OpenCV's imgcodecs",
                                                    "libopencv-imgcodecs-dev"};

inline constexpr const char* kDecode = "fivepipe_decode_image";
using Decode = void(const std::string& bytes, int flags, cv::Mat& image);

inline constexpr const char* kEncodePng = "fivepipe_encode_png";
using EncodePng = void(const cv::Mat& image, std::vector<std::uint8_t>& bytes);

}  // namespace fivepipe::images
