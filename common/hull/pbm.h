// Object-pixel maps as binary PBM (P4), the netpbm format of one bit a pixel: 1 is an object pixel.
// Any image viewer shows them.
#pragma once
#include <filesystem>

#include "common/hull/object_pixels.h"

namespace fivepipe::hull {

// Throws std::runtime_error naming the file: not readable, not a P4 of this size, too short.
ObjectPixels read_pbm(const std::filesystem::path& file, int width_px, int height_px);
// Throws std::runtime_error naming the file.
void write_pbm(const std::filesystem::path& file, const ObjectPixels& pixels);

}  // namespace fivepipe::hull
