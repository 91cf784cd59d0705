#include "benchmarks/render/errors/reference_composite.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "benchmarks/render/oracle/hull_pixel.h"
#include "benchmarks/render/oracle/triangle_ray.h"
#include "common/hull/oracle/analytic.h"
#include "common/hull/oracle/reference.h"

namespace fivepipe::render_bench {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// The bounds of an image include pixels whose centres rounding puts beside them.
constexpr double kMargin_px = 1;
// The exact hull can cover pixels beside those texels that show it, by less than a texel.
constexpr int kMargin_texels = 2;

// The part of the image around the texels that show the hull.
hull::PixelRect part_of_image(const render::HullFrame& hull, const geometry::Pinhole& image) {
  const hull::PixelRect& c = hull.covered;
  if (c.empty()) return {};
  const auto u = [&](int texel) { return texel * image.width_px / hull.recon.width_px; };
  const auto v = [&](int texel) { return texel * image.height_px / hull.recon.height_px; };
  return hull::intersection({0, 0, image.width_px, image.height_px},
                            {u(c.u0_px - kMargin_texels), v(c.v0_px - kMargin_texels),
                             u(c.u1_px + kMargin_texels), v(c.v1_px + kMargin_texels)});
}

// Every kStride_px-th pixel of each row outside the part is tested, too: part_of_image() follows
// the query that drew the texels.
constexpr int kStride_px = 7;

std::size_t differing(const cv::Mat& a, const cv::Mat& b) {
  std::size_t count = 0;
  for (int v = 0; v < a.rows; ++v)
    for (int u = 0; u < a.cols; ++u)
      count += a.at<std::uint16_t>(v, u) != b.at<std::uint16_t>(v, u);
  return count;
}

}  // namespace

ReferenceComposite::ReferenceComposite(const config::Viewer& viewer,
                                       const Eigen::Isometry3d& eye_from_world,
                                       const SurfaceNumbers& numbers)
    : camera_{config::render_pinhole(viewer), eye_from_world},
      near_m_(viewer.near_m),
      far_m_(viewer.far_m),
      numbers_(numbers),
      surfaces_(camera_.pinhole.height_px, camera_.pinhole.width_px, CV_16U,
                cv::Scalar(SurfaceNumbers::kBackground)),
      depth_m_(surfaces_.size(), CV_64F, cv::Scalar(viewer.far_m)) {}

hull::PixelRect ReferenceComposite::bounds_of(std::span<const Vector3d> points_world_m,
                                              double margin_px) const {
  const hull::PixelRect all{0, 0, camera_.pinhole.width_px, camera_.pinhole.height_px};
  Eigen::AlignedBox2d box;
  for (const Vector3d& p : points_world_m) {
    const std::optional<Vector2d> uv = geometry::project(camera_, p);
    if (!uv || !((camera_.camera_from_world * p).z() > near_m_)) return all;
    box.extend(*uv);
  }
  const Vector2d limit(all.u1_px, all.v1_px), zero = Vector2d::Zero();
  const Vector2d low = (box.min().array() - margin_px).floor().matrix().cwiseMax(zero),
                 high = (box.max().array() + margin_px + 1).ceil().matrix().cwiseMin(limit);
  // `low` may be far beyond the image: compare before the conversion to int.
  if (!(low.x() < high.x() && low.y() < high.y())) return {};
  return {int(low.x()), int(low.y()), int(high.x()), int(high.y())};
}

void ReferenceComposite::add_triangle(const std::array<Vector3d, 3>& corners_world_m, int number) {
  const hull::PixelRect rect = bounds_of(corners_world_m, kMargin_px);
  for (int v = rect.v0_px; v < rect.v1_px; ++v)
    for (int u = rect.u0_px; u < rect.u1_px; ++u) {
      const auto hit =
          render::plane_hit(corners_world_m, geometry::ray_through(camera_, Vector2d(u, v)));
      double& depth_m = depth_m_.at<double>(v, u);
      if (!hit || !(hit->barycentric.minCoeff() >= 0) || !(hit->distance >= near_m_) ||
          !(hit->distance <= depth_m))
        continue;
      depth_m = hit->distance;
      surfaces_.at<std::uint16_t>(v, u) = std::uint16_t(number);
    }
}

void ReferenceComposite::add_objects(const config::Scene& scene) {
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const geometry::Mesh mesh = config::mesh_of(scene.objects[i]);
    for (const auto& triangle : mesh.triangles) {
      std::array<Vector3d, 3> corners_m;
      for (std::size_t c = 0; c < 3; ++c)
        corners_m[c] = scene.objects[i].world_from_object * mesh.vertices_m[triangle[c]];
      add_triangle(corners_m, numbers_.object(i));
    }
  }
}

void ReferenceComposite::add_particles(const config::Scene& scene,
                                       std::span<const render::ParticleCloud> particles) {
  for (const render::ParticleCloud& cloud : particles) {
    const double radius_m = scene.particles[cloud.source].radius_m;
    for (std::size_t i = 0; i < cloud.p_world_m.size(); i += 3) {
      const Vector3d p = Eigen::Map<const Eigen::Vector3f>(&cloud.p_world_m[i]).cast<double>();
      const double depth_m = (camera_.camera_from_world * p).z() - radius_m;
      if (!(depth_m > near_m_)) continue;
      // In perspective a ball's image is larger than that of its disc, by less than its slant.
      const double margin_px = 2 * radius_m * camera_.pinhole.fx_px / depth_m + kMargin_px;
      const hull::PixelRect rect = bounds_of({&p, 1}, margin_px);
      for (int v = rect.v0_px; v < rect.v1_px; ++v)
        for (int u = rect.u0_px; u < rect.u1_px; ++u) {
          const auto entry = hull::ray_entry(hull::Capsule{p, p, radius_m},
                                             geometry::ray_through(camera_, Vector2d(u, v)));
          if (!entry || !(*entry <= depth_m_.at<double>(v, u))) continue;
          depth_m_.at<double>(v, u) = *entry;
          surfaces_.at<std::uint16_t>(v, u) = std::uint16_t(numbers_.particle(cloud.source));
        }
    }
  }
}

void ReferenceComposite::add_hull(int u_px, int v_px, double depth_m) {
  if (!(depth_m < depth_m_.at<double>(v_px, u_px))) return;
  depth_m_.at<double>(v_px, u_px) = depth_m;
  surfaces_.at<std::uint16_t>(v_px, u_px) = std::uint16_t(numbers_.hull);
}

void ReferenceComposite::add_exact_hull(std::span<const hull::Silhouette> silhouettes,
                                        const hull::PixelRect& part) {
  const hull::View view{camera_, near_m_, far_m_};
  for (int v = 0; v < surfaces_.rows; ++v) {
    const bool in_rows = v >= part.v0_px && v < part.v1_px;
    for (int u = 0; u < surfaces_.cols; ++u) {
      const bool in_part = in_rows && u >= part.u0_px && u < part.u1_px;
      if (!in_part && (u + v) % kStride_px != 0) continue;
      if (const auto depth_m = hull::reference_depth_m(silhouettes, view, u, v))
        add_hull(u, v, *depth_m);
    }
  }
}

void ReferenceComposite::add_texels(const render::HullFrame& hull) {
  const render::HullTexels texels(hull);
  for (int v = 0; v < surfaces_.rows; ++v)
    for (int u = 0; u < surfaces_.cols; ++u)
      if (const auto pixel = render::hull_pixel(texels, camera_.pinhole, u, v))
        add_hull(u, v, pixel->depth_m);
}

ReferenceComposite ReferenceComposite::copy() const {
  ReferenceComposite copied = *this;
  copied.surfaces_ = surfaces_.clone();
  copied.depth_m_ = depth_m_.clone();
  return copied;
}

WrongPixels& WrongPixels::operator+=(const WrongPixels& other) {
  wrong += other.wrong;
  wrong_drawing += other.wrong_drawing;
  pixels += other.pixels;
  return *this;
}

FrameReference::FrameReference(const config::Scene& scene, const config::Viewer& viewer,
                               const SurfaceNumbers& numbers, const render::HullFrame& hull,
                               std::span<const hull::Silhouette> silhouettes)
    : exact(viewer, hull.eye_from_world, numbers), drawing(exact) {
  exact.add_objects(scene);
  drawing = exact.copy();
  exact.add_exact_hull(silhouettes, part_of_image(hull, config::render_pinhole(viewer)));
  drawing.add_texels(hull);
}

WrongPixels wrong_pixels(const config::Scene& scene, const FrameReference& reference,
                         std::span<const render::ParticleCloud> particles, const cv::Mat& shown) {
  const auto wrong = [&](const ReferenceComposite& without_particles) {
    ReferenceComposite composite = without_particles.copy();
    composite.add_particles(scene, particles);
    return differing(shown, composite.surfaces());
  };
  return {wrong(reference.exact), wrong(reference.drawing), shown.total()};
}

}  // namespace fivepipe::render_bench
