// Image sequences for the cameras of the small deployment (deployments.h).
#pragma once
#include <filesystem>
#include <fstream>
#include <string>

namespace fivepipe::test {

// Writes FOLDER/f0.ppm to f{count - 1}.ppm: an empty grey room, and from picture 1 on a white
// square that moves to the right.
inline void write_pictures(const std::filesystem::path& folder, int count) {
  constexpr int kWidth_px = 180, kHeight_px = 122;
  std::filesystem::create_directories(folder);
  for (int i = 0; i < count; ++i) {
    std::ofstream file(folder / ("f" + std::to_string(i) + ".ppm"), std::ios::binary);
    file << "P6 " << kWidth_px << ' ' << kHeight_px << " 255\n";
    const int left = 50 + 2 * (i - 1);
    for (int v = 0; v < kHeight_px; ++v)
      for (int u = 0; u < kWidth_px; ++u) {
        const bool is_square = i > 0 && u >= left && u < left + 40 && v >= 30 && v < 90;
        file << std::string(3, is_square ? '\xf0' : '\x40');
      }
  }
}

// The value of `sources` of a capture_node that reads the pictures.
inline std::string picture_sources() {
  const std::string source = "{video: f%d.ppm, background: f0.ppm}";
  return "{left: " + source + ", far: " + source + ", right: " + source + "}";
}

}  // namespace fivepipe::test
