// Images of textures. The target checks and decodes them as render_node does.
#include <opencv2/imgcodecs.hpp>

#include "common/config/mesh/image_header.h"
#include "common/config/mesh/mesh_file.h"
#include "render_node/materials/texture.h"
#include "tests/fuzz/mutations.h"
#include "tests/fuzz/target.h"

namespace fivepipe::fuzz {
namespace {

constexpr char kFile[] = "texture";

std::vector<File> input(Random& random) {
  const int width_px = 1 + int(below(random, 40)), height_px = 1 + int(below(random, 40));
  cv::Mat image(height_px, width_px, one_in(random, 3) ? CV_8UC1 : CV_8UC3);
  for (int v = 0; v < height_px; ++v)
    for (std::size_t i = 0; i < std::size_t(width_px) * image.elemSize(); ++i)
      image.ptr(v)[i] = std::uint8_t(random());
  std::vector<std::uint8_t> bytes;
  if (one_in(random, 2))
    cv::imencode(".png", image, bytes);
  else
    cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_PROGRESSIVE, int(below(random, 2))});
  File file{kFile, {bytes.begin(), bytes.end()}};
  for (std::size_t mutations = below(random, 4); mutations > 0; --mutations)
    mutate_bytes(random, file.bytes);
  return {file};
}

// A damaged header may state 16384x16384 pixels, for which a decoder needs 0.8 GB. The target
// decodes no image with more pixels than this.
constexpr std::size_t kMaxPixels = 1 << 24;

Verdict check(const std::filesystem::path& folder) {
  const config::ImageOrReason file = config::read_texture_image({folder / kFile});
  if (!file.reason.empty()) return {};
  const auto size = config::image_size(file.bytes);
  if (!size) return {true, "an accepted image without a size"};
  if (std::size_t(size->width_px) * size->height_px > kMaxPixels) return {};
  const render::DecodedImage image = render::decoded(file.bytes);
  if (!image.reason.empty()) return {};
  if (image.bgr.type() != CV_8UC3) return {true, "an image of another type"};
  if (image.bgr.cols != int(size->width_px) || image.bgr.rows != int(size->height_px))
    return {true, "an image of another size than its header states"};
  return {true, ""};
}

}  // namespace

Target texture_target() { return {"texture", "PNG and JPEG images of textures", input, check}; }

}  // namespace fivepipe::fuzz
