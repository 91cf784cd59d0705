// The paths of pictures, videos and sequences of pictures in a deployment file.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

// Reads the path of a picture, a video, or a sequence. An unreadable file and a sequence without
// pictures are problems if the node runs on this machine (is_here); files of other hosts cannot be
// checked.
std::string read_image_path(YamlMap& map, const std::string& key, bool is_here);

// Returns true if the path names a sequence of pictures: its file name has a %, as in
// frame_%04d.png.
bool is_sequence(const std::filesystem::path& path);

// The pictures of a sequence, by their numbers.
struct Pictures {
  std::map<std::int64_t, std::filesystem::path> files;
  std::string problem;  // why they cannot be used, for the user; empty: none
};
// Finds the pictures of a sequence. The file name of the path contains one %d or %0Nd, in whose
// place the files have up to 15 digits; the width N is ignored.
Pictures pictures_of(const std::filesystem::path& sequence);

// Returns true if the path names one picture: a png, jpg, bmp, tif or ppm file, not a sequence.
bool is_single_picture(const std::filesystem::path& path);

}  // namespace fivepipe::config
