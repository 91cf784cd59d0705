// The paths of pictures, videos and sequences of pictures in a deployment file.
#pragma once
#include <string>

#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

// Reads the path of a picture, a video, or a sequence by a printf pattern (frame_%04d.png) whose
// first number is first_frame or the next. An unreadable file is a problem if the node runs on this
// machine (is_here); files of other hosts cannot be checked.
std::string read_image_path(YamlMap& map, const std::string& key, int first_frame, bool is_here);

// Returns true if the path names one picture: a png, jpg, bmp, tif or ppm file without a pattern.
bool is_single_picture(const std::string& path);

}  // namespace fivepipe::config
