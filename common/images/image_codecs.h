// Image files by OpenCV's module imgcodecs. Its codecs bring 200 shared libraries, whose start
// takes longer than that of all others of a node, so they are in the module fivepipe_images.so,
// which the first call loads.
#pragma once
#include <opencv2/core/mat.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

namespace fivepipe::images {

// cv::imdecode() of the bytes of a file; `flags` are cv::ImreadModes. Returns an empty image if the
// bytes are no image. May be called from any thread. Throws cv::Exception, and std::runtime_error
// if the module cannot be loaded.
cv::Mat decode(const std::string& bytes, int flags);

}  // namespace fivepipe::images
