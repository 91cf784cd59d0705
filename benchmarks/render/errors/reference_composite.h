// Which surface each pixel of a frame must show: casts the ray through its centre against every
// triangle and particle, in double, and compares the depths with that of the hull. Uses no OpenGL.
#pragma once
#include <opencv2/core/mat.hpp>
#include <span>

#include "benchmarks/render/errors/shown_surfaces.h"
#include "common/config/deployment.h"
#include "common/hull/hull.h"

namespace fivepipe::render_bench {

class ReferenceComposite {
 public:
  // The image of a viewer whose eye is at eye_from_world; it shows only the background.
  ReferenceComposite(const config::Viewer& viewer, const Eigen::Isometry3d& eye_from_world,
                     const SurfaceNumbers& numbers);

  // Adds the objects in the poses of the scene. At equal depth a virtual surface hides the hull.
  void add_objects(const config::Scene& scene);
  // Adds balls of the sources' radii.
  void add_particles(const config::Scene& scene, std::span<const render::ParticleCloud> particles);
  // Adds the hull of these silhouettes at every pixel inside `part` and at every seventh of the
  // others, by the exact reference for hull depth, which is slow.
  void add_exact_hull(std::span<const hull::Silhouette> silhouettes, const hull::PixelRect& part);
  // Adds what a pixel shows of a hull that is known in the texels of another image.
  void add_texels(const render::HullFrame& hull);

  ReferenceComposite copy() const;

  // The numbers of the surfaces, CV_16U.
  const cv::Mat& surfaces() const { return surfaces_; }

 private:
  void add_triangle(const std::array<Eigen::Vector3d, 3>& corners_world_m, int number);
  void add_hull(int u_px, int v_px, double depth_m);
  // The pixels that can show the convex hull of the points; the whole image if one is not in front
  // of the eye.
  hull::PixelRect bounds_of(std::span<const Eigen::Vector3d> points_world_m,
                            double margin_px) const;

  geometry::Camera camera_;
  double near_m_, far_m_;
  SurfaceNumbers numbers_;
  cv::Mat surfaces_, depth_m_;  // CV_16U, CV_64F
};

// The references of a frame without particles.
struct FrameReference {
  // silhouettes: those from which `hull` was reconstructed.
  FrameReference(const config::Scene& scene, const config::Viewer& viewer,
                 const SurfaceNumbers& numbers, const render::HullFrame& hull,
                 std::span<const hull::Silhouette> silhouettes);
  ReferenceComposite exact;    // of the exact hull
  ReferenceComposite drawing;  // of the hull in the texels that the renderer receives
};

// Pixels of a frame that show another surface than they must.
struct WrongPixels {
  std::size_t wrong = 0;          // by the exact hull: all errors together
  std::size_t wrong_drawing = 0;  // by the texels: the renderer's own errors
  std::size_t pixels = 0;

  WrongPixels& operator+=(const WrongPixels& other);
  double percent() const { return 100.0 * double(wrong) / double(pixels); }
  double drawing_percent() const { return 100.0 * double(wrong_drawing) / double(pixels); }
};
// shown: what the renderer shows of the frame.
WrongPixels wrong_pixels(const config::Scene& scene, const FrameReference& reference,
                         std::span<const render::ParticleCloud> particles, const cv::Mat& shown);

}  // namespace fivepipe::render_bench
