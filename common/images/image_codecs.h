// Image files by OpenCV's module imgcodecs. Its codecs bring 200 shared libraries, whose start
// takes longer than that of all others of a node, so they are in the module fivepipe_images.so,
// which the first call loads.
#pragma once
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

namespace fivepipe::images {

// All functions may be called from any thread, and throw std::runtime_error if the module cannot be
// loaded.

// cv::imdecode() of the bytes of a file; `flags` are cv::ImreadModes. Returns an empty image if the
// bytes are no image. Throws cv::Exception.
cv::Mat decode(const std::string& bytes, int flags);

// cv::imencode(): the bytes of a PNG file. Returns nothing if PNG does not support the image.
std::vector<std::uint8_t> png_of(const cv::Mat& image);

}  // namespace fivepipe::images
