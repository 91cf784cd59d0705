// Composes a frame by itself, as the reference for the images of the pipeline: casts a ray through
// each pixel, finds the hull by the exact reference and the virtual objects in closed form, colours
// the hull by projection into the camera images, and lights the objects in double.
#pragma once
#include <map>
#include <opencv2/core.hpp>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "common/hull/hull.h"

namespace fivepipe::test {

// Relative error of a depth of the hull: that of its backends.
inline constexpr double kHullDepthError = 2e-6;

// An image of a camera that gives colour.
struct ColourImage {
  geometry::Camera camera;
  cv::Mat bgr;
  hull::ObjectPixels sent;  // the pixels whose colour capture_node has sent
  // The object pixels of the camera; null if it gives no shape.
  const hull::ObjectPixels* object = nullptr;
};

// The inputs of one frame.
struct ComposedFrame {
  Eigen::Isometry3d eye_from_world;
  std::vector<hull::Silhouette> silhouettes;
  std::vector<ColourImage> images;
  std::map<std::string, Eigen::Isometry3d> world_from_object;  // of the objects that have moved
  std::set<std::string> colliding;
};

// A colour with the bound of its error [levels of 255]. Several if rounding decides between them.
struct ExpectedColour {
  std::vector<Eigen::Vector3d> bgr;
  double error_levels;
  bool matches(const Eigen::Vector3d& found_bgr) const;
};

class Composition {
 public:
  // Boxes and spheres only; reconstruction and composite have the same size.
  Composition(const config::Deployment& deployment, const ComposedFrame& frame);

  // The depth of the hull at the pixel [m]; 0: none.
  double hull_depth_m(int u_px, int v_px) const;
  // The colour of the hull at a pixel that shows it.
  ExpectedColour hull_bgr(int u_px, int v_px) const;
  // What the composite shows.
  enum class Shown { background, object, highlighted_object, hull };
  struct Pixel {
    Shown shown;
    ExpectedColour colour;
  };
  // nullopt if the pixel's center is at the border of two surfaces.
  std::optional<Pixel> composite(int u_px, int v_px) const;

 private:
  struct Hit {
    const config::SceneObject* object = nullptr;  // null: the background
    int face = 0;
    double depth_m = 0;
    Eigen::Vector3d p_world_m, normal_world;
  };
  Hit cast(const Eigen::Vector2d& uv_px) const;
  Eigen::Vector3d lit_srgb(const Hit& hit) const;
  Eigen::Vector3d blended(const Eigen::Vector3d& p_world_m) const;
  double visibility(const ColourImage& image, const Eigen::Vector3d& p_world_m) const;

  const config::Deployment& deployment_;
  const ComposedFrame& frame_;
  geometry::Camera eye_;
  double light_reach_m_;
  std::vector<double> depth_m_;
};

}  // namespace fivepipe::test
