// Object-pixel maps as binary PBM (P4), the netpbm format with one bit per pixel: 1 is an object
// pixel. Most image viewers can display them.
#pragma once
#include <filesystem>

#include "common/hull/object_pixels.h"

namespace fivepipe::hull {

// Throws std::runtime_error with the file's name if the file is not readable, is not a P4 of this
// size, or is too short.
ObjectPixels read_pbm(const std::filesystem::path& file, int width_px, int height_px);
// Throws std::runtime_error with the file's name if it cannot be written.
void write_pbm(const std::filesystem::path& file, const ObjectPixels& pixels);

}  // namespace fivepipe::hull
