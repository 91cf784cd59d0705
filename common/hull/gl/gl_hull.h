// Backend `gl`: compute shaders find the first hull point of every ray of a view, exactly. The
// depths stay on the GPU. The method is that of backend `cpu` (ray_simd.h): a camera that sees a
// point of the ray outside its object moves the candidate on to where the ray's image leaves the
// empty box around it, in closed form. A camera that sees it inside is not tested again before the
// image leaves the box of object pixels around it.
//
// Rays are traced in float. rays.comp derives a bound of float's rounding; a ray with a decision
// that rounding could change is traced again in double (resolve_exact.comp). Depth is computed in
// double and then rounded to float. With Limits::seen all rays are traced in double.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "common/gl/objects.h"
#include "common/hull/hull.h"

namespace fivepipe::hull {

inline constexpr std::size_t kMaxGlCameras = 64;

// Requires a current OpenGL 4.5 context from construction to destruction. Changes no OpenGL state
// except bindings; read_back() also sets GL_PACK_ALIGNMENT.
class GlHull {
 public:
  GlHull();  // throws GlError

  // Uploads the object pixels and prepares them. Buffers are reused from frame to frame. The hull
  // is empty if there is no silhouette or a camera is not finite; with Limits::all also if a
  // silhouette has no object pixel. The depths do not depend on the order of the silhouettes.
  // Throws std::invalid_argument for more than kMaxGlCameras silhouettes, and GlError if the object
  // pixels exceed the driver's largest storage block; the hull is then empty.
  void set_silhouettes(std::span<const Silhouette> silhouettes, const HullRule& rule = {});

  // Computes the depths of the rects, which must not overlap. A view that is not finite has no
  // hull. A pixel's depth does not depend on how a view is divided into rects. Throws
  // std::invalid_argument if the view's image is empty or larger than kMaxViewSize_px, or a rect
  // extends beyond it.
  void trace(const View& view, std::span<const PixelRect> rects);

  // Returns the depths as in DepthTile [m]: an R32F texture of the view's size, row 0 at the top.
  // Valid in the rects of the last trace(), for texture fetches, image loads and framebuffer reads.
  // The texture exists after the first trace() (std::logic_error before) and is replaced when the
  // view's size changes.
  const gl::GlTexture& depth() const;
  DepthTile read_back(const PixelRect& rect) const;  // the rect is inside the view's image

  // Calls trace(), then returns read_back() of every rect.
  std::vector<DepthTile> depth(const View& view, std::span<const PixelRect> rects);

  // Returns counts of the last trace(). Waits for the GPU. Tests use it to prove that both passes
  // run. rays_in_double is 0 with Limits::seen.
  struct Counts {
    std::size_t tiles, traced_tiles, rays_in_double;
  };
  Counts counts() const;

  // Within the texture size of every driver; the tiles of such a view fit into one dispatch.
  static constexpr int kMaxViewSize_px = 16000;

 private:
  struct Map {
    geometry::Camera camera;
    int u0_px = 0, v0_px = 0;  // the crop's corner in the camera's image
    PixelRect bounds;          // bounds of the object pixels, in the crop
    std::uint32_t pixel_words = 0, pixel_rows = 0, first_pixel_word = 0;
    std::uint32_t cell_words = 0, cell_rows = 0, first_cell_word = 0;
  };
  void prepare();
  void write_view(const View& view);
  void write_candidates(std::span<const PixelRect> rects);
  void run(std::size_t cameras);

  gl::GlProgram cells_, strips_, distances_, tiles_, resolve_exact_;
  struct RaysProgram {
    std::size_t max_cameras;
    std::unique_ptr<gl::GlProgram> program;  // compiled when first needed
  };
  std::vector<RaysProgram> rays_, seen_rays_;
  std::unique_ptr<gl::GlProgram> seen_tiles_;  // compiled when first needed
  gl::GlBuffer bit_buffer_, distance_buffer_, grid_buffer_, strip_buffer_, view_buffer_,
      candidate_buffer_, tile_buffer_, work_buffer_;
  std::unique_ptr<gl::GlTexture> depth_;
  HullRule rule_;
  std::vector<Map> maps_;
  std::vector<std::uint32_t> bits_;  // all crops, then room for their cells
  std::size_t words_ = 0, candidates_ = 0;
  bool empty_ = true;
};

}  // namespace fivepipe::hull
