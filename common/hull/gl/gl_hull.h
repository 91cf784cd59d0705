// Backend `gl`: the first hull point of every ray of a view by compute shaders, exact, the depths
// left on the GPU. Source: the design's "Rays", as backend `cpu` (ray_lanes.h): a camera that sees
// a point of the ray outside its object moves the candidate on to where the ray's image leaves the
// empty box around it, in closed form; one that sees it inside is not asked again before the image
// leaves the box of object pixels around it.
//
// Rays run in float. Every decision that float's rounding, by a bound derived in
// gl_hull_shaders.cpp, might turn round sets the ray aside; such rays are traced again in double.
// Depth is computed in double and rounded to float last.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "common/gl/objects.h"
#include "common/hull/hull.h"

namespace fivepipe::hull {

inline constexpr std::size_t kMaxGlCameras = 64;

// Needs a current OpenGL 4.5 context from construction to destruction; changes no state but
// bindings.
class GlHull {
 public:
  GlHull();  // throws GlError

  // Uploads the object pixels and prepares them; buffers are reused from frame to frame.
  // Silhouettes that are not finite, or have no object pixel, and no silhouette at all, have no
  // hull. The order of the silhouettes doesn't matter. std::invalid_argument: more than
  // kMaxGlCameras, or a rule other than Limits::all. GlError: more pixels than the driver takes.
  void set_silhouettes(std::span<const Silhouette> silhouettes, const HullRule& rule = {});

  // Depths of the rects, which lie inside the view's image and don't overlap; a view that is not
  // finite has no hull. A pixel's depth does not depend on how a view is divided into rects.
  // std::invalid_argument: an image of no pixel or beyond kMaxViewSize_px, or a rect that reaches
  // out of it.
  void trace(const View& view, std::span<const PixelRect> rects);

  // R32F, as large as the view's image, row 0 at the top: DepthTile's depths [m], valid in the
  // rects of the last trace() for texture fetches, image loads and framebuffer reads. There after
  // the first trace(); replaced when the view's size changes.
  const gl::GlTexture& depth() const;
  DepthTile read_back(const PixelRect& rect) const;  // inside the view's image

  // trace() and read_back() of every rect.
  std::vector<DepthTile> depth(const View& view, std::span<const PixelRect> rects);
  DepthTile depth(const View& view, const PixelRect& rect);

  // GPU time of the last set_silhouettes() and trace() [ms]; both wait for the GPU.
  double prepare_ms() const { return prepare_timer_.elapsed_ms(); }
  double trace_ms() const { return trace_timer_.elapsed_ms(); }
  // What the last trace() did; waits for the GPU.
  struct Counts {
    std::size_t tiles, traced_tiles, rays_in_double;
  };
  Counts counts() const;

  static constexpr int kMaxViewSize_px =
      16000;  // within every driver's textures, and its tiles within one dispatch

 private:
  struct Map {
    geometry::Camera camera;
    int u0_px = 0, v0_px = 0;  // the crop's corner in the camera's image
    PixelRect bounds;          // of the object pixels, in the crop
    std::uint32_t pixel_words = 0, pixel_rows = 0, first_pixel_word = 0;
    std::uint32_t cell_words = 0, cell_rows = 0, first_cell_word = 0;
  };
  void prepare();
  void write_view(const View& view);
  void write_candidates(std::span<const PixelRect> rects);
  void run(std::size_t cameras);
  const gl::GlProgram& rays_program(std::size_t cameras);

  gl::GlProgram cells_, strips_, distances_, tiles_, resolve_exact_;
  struct RaysProgram {
    std::size_t max_cameras;
    std::unique_ptr<gl::GlProgram> program;  // made when first needed
  };
  std::vector<RaysProgram> rays_;
  gl::GlBuffer bit_buffer_, distance_buffer_, grid_buffer_, strip_buffer_, view_buffer_,
      candidate_buffer_, tile_buffer_, work_buffer_;
  gl::GlTimer prepare_timer_, trace_timer_;
  std::unique_ptr<gl::GlTexture> depth_;
  std::vector<Map> maps_;
  std::vector<std::uint32_t> bits_;  // of all crops, then room for their cells
  std::size_t words_ = 0, candidates_ = 0;
  bool empty_ = true;
};

}  // namespace fivepipe::hull
