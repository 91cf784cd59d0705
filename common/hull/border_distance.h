// How far each pixel of a map is from the border of its object: the skipping structure of the CPU's volume queries.
//
// Chessboard distances, by dilation of bit planes: one word moves 64 pixels one step (mathematical morphology on packed bits, van den
// Boomgaard and van Balen, 1992). Exact up to 8 px; beyond, what an 8x8 grid of cells, treated alike, can promise. Measured against
// cells of packed bits, run tables and exact distance transforms: docs/hull.md.
#pragma once
#include <cstdint>
#include <vector>

#include "common/hull/object_pixels.h"

namespace fivepipe {

class BorderDistance {
 public:
  // The map's region in store reaches at least so far beyond its object pixels [px].
  static constexpr int kMargin_px = 8;
  // No value is larger [px].
  static constexpr int kMost_px = 113;

  BorderDistance() = default;
  explicit BorderDistance(const ObjectPixels& pixels) { assign(pixels); }
  void assign(const ObjectPixels& pixels);  // reuses the memory

  const PixelRect& bounds() const { return bounds_; }  // of the object pixels
  // What is in store: bounds and margin, all of whose pixels are in no image in part. Empty without object pixels.
  const PixelRect& stored() const { return stored_; }

  // Inside `stored`. r > 0: not an object pixel, nor is any whose column and row are both less than r away.
  // r < 0: an object pixel, and so are all that are less than -r away (outside the image there is none).
  int at(int u_px, int v_px) const { return bytes_[std::size_t(v_px - stored_.v0_px) * stride_ + std::size_t(u_px - stored_.u0_px)]; }
  // The same for any pixel: the bounds alone tell outside `stored`.
  int anywhere(int u_px, int v_px) const;

  // Row by row from stored's first pixel; three more bytes may be read after the last row.
  const std::int8_t* bytes() const { return bytes_.data(); }
  int stride() const { return stride_; }

 private:
  PixelRect bounds_, stored_;
  int stride_ = 0;
  std::vector<std::int8_t> bytes_;
};

}  // namespace fivepipe
