#include "common/hull/pbm.h"

#include <fstream>
#include <stdexcept>

#include "common/base/readable_file.h"

namespace fivepipe::hull {

ObjectPixels read_pbm(const std::filesystem::path& file, int width_px, int height_px) {
  if (const auto why = base::why_unreadable(file))
    throw std::runtime_error(file.string() + ": " + *why);
  std::ifstream in(file, std::ios::binary);
  std::string magic;
  int width = 0, height = 0;
  in >> magic >> width >> height;
  in.get();
  if (!in || magic != "P4" || width != width_px || height != height_px)
    throw std::runtime_error(file.string() + ": not a binary PBM of " + std::to_string(width_px) +
                             "x" + std::to_string(height_px));
  ObjectPixels pixels(width_px, height_px);
  std::vector<char> row(std::size_t(width_px + 7) / 8);
  for (int v = 0; v < height_px; ++v) {
    if (!in.read(row.data(), std::streamsize(row.size())))
      throw std::runtime_error(file.string() + ": the file ends in row " + std::to_string(v));
    for (int u = 0; u < width_px; ++u)
      if (row[std::size_t(u) / 8] >> (7 - u % 8) & 1) pixels.set(u, v);
  }
  return pixels;
}

void write_pbm(const std::filesystem::path& file, const ObjectPixels& pixels) {
  std::ofstream out(file, std::ios::binary);
  out << "P4\n" << pixels.width_px() << ' ' << pixels.height_px() << '\n';
  for (int v = 0; v < pixels.height_px(); ++v) {
    std::vector<char> row(std::size_t(pixels.width_px() + 7) / 8);
    for (int u = 0; u < pixels.width_px(); ++u)
      if (pixels.contains(u, v)) row[std::size_t(u) / 8] |= char(0x80 >> u % 8);
    out.write(row.data(), std::streamsize(row.size()));
  }
  if (!out.flush()) throw std::runtime_error(file.string() + " cannot be written");
}

}  // namespace fivepipe::hull
