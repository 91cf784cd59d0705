#include "capture_node/synthetic/render.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "capture_node/lens/undistortion.h"
#include "capture_node/synthetic/shading.h"

namespace fivepipe::capture {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

// Long capsules are cut into short pieces, so that their bounding rectangles contain few other
// pixels. The union of the pieces is the original body. A box is one piece.
struct Piece {
  std::variant<hull::Capsule, geometry::OrientedBox> shape;
  // The piece is the convex hull of these spheres.
  std::vector<Vector3d> centers_world_m;
  double radius_m;
  const SyntheticPart* part;
};

void add_pieces(const hull::Capsule& whole, const SyntheticPart& part, std::vector<Piece>& pieces) {
  constexpr double kMaxPieceLength_radii = 3;
  const Vector3d segment = whole.b_world_m - whole.a_world_m;
  const int n =
      std::max(1, int(std::ceil(segment.norm() / (kMaxPieceLength_radii * whole.radius_m))));
  for (int i = 0; i < n; ++i) {
    const Vector3d a = whole.a_world_m + (double(i) / n) * segment,
                   b = whole.a_world_m + (double(i + 1) / n) * segment;
    pieces.push_back({hull::Capsule{a, b, whole.radius_m}, {a, b}, whole.radius_m, &part});
  }
}

void add_pieces(const geometry::OrientedBox& box, const SyntheticPart& part,
                std::vector<Piece>& pieces) {
  std::vector<Vector3d> corners;
  for (int corner = 0; corner < 8; ++corner)
    corners.push_back(box.world_from_box *
                      box.half_m.cwiseProduct(
                          Vector3d(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1)));
  pieces.push_back({box, std::move(corners), 0, &part});
}

std::vector<Piece> pieces_of(std::span<const SyntheticPart> parts) {
  std::vector<Piece> pieces;
  for (const SyntheticPart& part : parts)
    std::visit([&](const auto& shape) { add_pieces(shape, part, pieces); }, part.shape);
  return pieces;
}

std::optional<double> entry(const Piece& piece, const geometry::Ray& ray) {
  if (const auto* capsule = std::get_if<hull::Capsule>(&piece.shape))
    return hull::ray_entry(*capsule, ray);
  return geometry::ray_entry(std::get<geometry::OrientedBox>(piece.shape), ray);
}

void put(cv::Mat& bgr, int u, int v, const Vector3f& levels) {
  std::uint8_t* pixel = bgr.ptr(v) + 3 * u;
  for (int c = 0; c < 3; ++c) pixel[c] = std::uint8_t(std::clamp(levels[c], 0.0f, 255.0f) + 0.5f);
}

}  // namespace

SyntheticCamera::SyntheticCamera(const config::SyntheticWorld& world,
                                 const config::RigCamera& camera,
                                 std::shared_ptr<const Surroundings> surroundings)
    : world_(world), camera_(camera), surroundings_(std::move(surroundings)) {
  const int width = camera.source.width_px, height = camera.source.height_px;
  const std::size_t pixels = std::size_t(width) * height;
  xy_.resize(pixels);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      const Vector2d xy = geometry::undistorted(camera.source, camera.distortion, {u, v});
      seen_xy_.extend(xy);
      xy_[std::size_t(v) * width + u] = xy.cast<float>();
    }
  surface_.resize(pixels);
  nearest_.resize(pixels);
  visibility_.resize(pixels);
}

config::RigCamera with_finer_pixels(config::RigCamera camera, int n) {
  geometry::Pinhole& k = camera.source;
  k.width_px *= n;
  k.height_px *= n;
  k.fx_px *= n;
  k.fy_px *= n;
  k.cx_px = n * (k.cx_px + 0.5) - 0.5;
  k.cy_px = n * (k.cy_px + 0.5) - 0.5;
  return camera;
}

cv::Mat mean_of_pixels(const cv::Mat& fine, int n) {
  if (n == 1) return fine;
  cv::Mat mean;
  cv::resize(fine, mean, {fine.cols / n, fine.rows / n}, 0, 0, cv::INTER_AREA);
  return mean;
}

cv::Mat SyntheticCamera::image(std::span<const SyntheticPart> parts,
                               const Eigen::Isometry3d& camera_from_world) {
  if (room_.empty() || camera_from_world_.matrix() != camera_from_world.matrix())
    render_room(camera_from_world);
  cv::Mat bgr = room_.clone();
  if (world_.cast_shadow) draw_shadow(parts, bgr);
  draw_object(parts, bgr);
  return bgr;
}

Vector3f SyntheticCamera::direction_world(int u_px, int v_px,
                                          const Eigen::Matrix3f& world_from_camera) const {
  const Eigen::Vector2f& xy = xy_[std::size_t(v_px) * camera_.source.width_px + u_px];
  return world_from_camera.col(0) * xy.x() + world_from_camera.col(1) * xy.y() +
         world_from_camera.col(2);
}

// Renders the room once for a fixed camera, with four samples per pixel. A camera on the viewer
// needs a new room every frame, with one sample per four pixels.
void SyntheticCamera::render_room(const Eigen::Isometry3d& camera_from_world) {
  camera_from_world_ = camera_from_world;
  const Eigen::Isometry3f world_from_camera =
      camera_from_world.inverse(Eigen::Isometry).cast<float>();
  const Eigen::Matrix3f rotation = world_from_camera.linear();
  const Vector3f origin = world_from_camera.translation();
  const int width = camera_.source.width_px, height = camera_.source.height_px;
  if (camera_.mount == config::Mount::viewer) {
    cv::Mat half((height + 1) / 2, (width + 1) / 2, CV_8UC3);
    for (int v = 0; v < height; v += 2)
      for (int u = 0; u < width; u += 2) {
        const int right = std::min(u + 1, width - 1), lower = std::min(v + 1, height - 1);
        const Surroundings::RayHit seen = surroundings_->trace_ray(
            origin,
            0.5f * (direction_world(u, v, rotation) + direction_world(right, lower, rotation)));
        for (const int row : {v, lower})
          for (const int column : {u, right})
            surface_[std::size_t(row) * width + column] = seen.surface;
        put(half, u / 2, v / 2, seen.bgr);
      }
    cv::resize(half, room_, {width, height}, 0, 0, cv::INTER_LINEAR);
    return;
  }
  const Vector3f dx = rotation.col(0) * float(0.25 / camera_.source.fx_px),
                 dy = rotation.col(1) * float(0.25 / camera_.source.fy_px);
  room_.create(height, width, CV_8UC3);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      const Vector3f direction = direction_world(u, v, rotation);
      surface_[std::size_t(v) * width + u] = surroundings_->trace_ray(origin, direction).surface;
      Vector3f sum = Vector3f::Zero();
      for (const Vector3f& offset :
           {Vector3f(-dx - dy), Vector3f(dx - dy), Vector3f(dy - dx), Vector3f(dx + dy)})
        sum += surroundings_->trace_ray(origin, direction + offset).bgr;
      put(room_, u, v, 0.25f * sum);
    }
}

// Bounds of the captured pixels that can see the convex hull of the spheres: maps the exact bounds
// in the normalised plane through the lens model. Returns the whole image if a sphere reaches the
// camera's plane.
hull::PixelRect SyntheticCamera::image_bounds_of(std::span<const Vector3d> centers_world_m,
                                                 std::span<const double> radii_m) const {
  const hull::PixelRect all{0, 0, camera_.source.width_px, camera_.source.height_px};
  // At a depth of one radius the bounds become infinite.
  constexpr double kMinDepth_radii = 1.05;
  Eigen::AlignedBox2d bounds;
  for (std::size_t i = 0; i < centers_world_m.size(); ++i) {
    const Vector3d c = camera_from_world_ * centers_world_m[i];
    if (!(c.z() > kMinDepth_radii * radii_m[i])) return all;
    for (int axis = 0; axis < 2; ++axis) {
      const double center_angle = std::atan2(c[axis], c.z()),
                   half_angle = std::asin(radii_m[i] / std::hypot(c[axis], c.z()));
      Vector2d low = bounds.min(), high = bounds.max();
      low[axis] = std::min(low[axis], std::tan(center_angle - half_angle));
      high[axis] = std::max(high[axis], std::tan(center_angle + half_angle));
      bounds = Eigen::AlignedBox2d(low, high);
    }
  }
  const Eigen::AlignedBox2d visible = bounds.intersection(seen_xy_);
  if (visible.isEmpty()) return {};
  const geometry::Pinhole& k = camera_.source;
  Eigen::AlignedBox2d pixels;
  // Samples per side. The distortion between two samples is far below kMargin_px.
  constexpr int kSteps = 8;
  for (int i = 0; i <= kSteps; ++i)
    for (int side = 0; side < 4; ++side) {
      const double fraction = double(i) / kSteps;
      const Vector2d at(side < 2 ? fraction : side - 2.0, side < 2 ? double(side) : fraction);
      const Vector2d xy =
          geometry::distorted(camera_.distortion, visible.min() + at.cwiseProduct(visible.sizes()));
      pixels.extend(Vector2d(xy.x() * k.fx_px + k.cx_px, xy.y() * k.fy_px + k.cy_px));
    }
  constexpr double kMargin_px = 2;
  return hull::intersection(all, {int(std::floor(pixels.min().x() - kMargin_px)),
                                  int(std::floor(pixels.min().y() - kMargin_px)),
                                  int(std::ceil(pixels.max().x() + kMargin_px)) + 1,
                                  int(std::ceil(pixels.max().y() + kMargin_px)) + 1});
}

// Finds the nearest piece of each pixel, piece by piece from front to back; then shades each pixel
// once.
void SyntheticCamera::draw_object(std::span<const SyntheticPart> parts, cv::Mat& bgr) {
  const Eigen::Isometry3d world_from_camera = camera_from_world_.inverse(Eigen::Isometry);
  const Vector3d eye = world_from_camera.translation();
  const std::size_t width = std::size_t(camera_.source.width_px);
  const auto ray_of = [&](std::size_t at) {
    return geometry::Ray{
        eye, world_from_camera.linear() * Vector3d(double(xy_[at].x()), double(xy_[at].y()), 1)};
  };
  std::vector<Piece> pieces = pieces_of(parts);
  const auto nearest_depth = [&](const Piece& piece) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vector3d& center : piece.centers_world_m)
      nearest = std::min(nearest, (camera_from_world_ * center).z());
    return nearest - piece.radius_m;
  };
  std::stable_sort(pieces.begin(), pieces.end(), [&](const Piece& a, const Piece& b) {
    return nearest_depth(a) < nearest_depth(b);
  });
  std::vector<hull::PixelRect> rects;
  for (const Piece& piece : pieces) {
    const std::vector<double> radii(piece.centers_world_m.size(), piece.radius_m);
    rects.push_back(image_bounds_of(piece.centers_world_m, radii));
    for (int v = rects.back().v0_px; v < rects.back().v1_px; ++v)
      std::fill_n(nearest_.begin() + std::ptrdiff_t(v * width + rects.back().u0_px),
                  rects.back().width_px(), Nearest{});
  }
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const auto from = float(nearest_depth(pieces[i]));
    for (int v = rects[i].v0_px; v < rects[i].v1_px; ++v)
      for (int u = rects[i].u0_px; u < rects[i].u1_px; ++u) {
        const std::size_t at = v * width + std::size_t(u);
        if (nearest_[at].depth_m <= from) continue;
        const std::optional<double> depth = entry(pieces[i], ray_of(at));
        if (depth && float(*depth) < nearest_[at].depth_m) nearest_[at] = {float(*depth), int(i)};
      }
  }
  for (const hull::PixelRect& rect : rects)
    for (int v = rect.v0_px; v < rect.v1_px; ++v)
      for (int u = rect.u0_px; u < rect.u1_px; ++u) {
        Nearest& nearest = nearest_[v * width + std::size_t(u)];
        if (nearest.piece < 0) continue;
        const geometry::Ray ray = ray_of(v * width + std::size_t(u));
        put(bgr, u, v,
            shaded(*pieces[std::size_t(nearest.piece)].part,
                   eye + double(nearest.depth_m) * ray.direction_world, eye));
        nearest.piece = -1;  // done: overlapping rectangles skip this pixel
      }
}

// For the table and for the floor: finds the pixels that each piece's shadow can cover, computes
// the visible fraction of the lamp there, and darkens the image accordingly.
void SyntheticCamera::draw_shadow(std::span<const SyntheticPart> parts, cv::Mat& bgr) {
  const Eigen::Isometry3f world_from_camera =
      camera_from_world_.inverse(Eigen::Isometry).cast<float>();
  const Eigen::Matrix3f rotation = world_from_camera.linear();
  const Vector3f eye = world_from_camera.translation();
  const Vector3d lamp_m = lamp::kPosition_world_m.cast<double>();
  const std::size_t width = std::size_t(camera_.source.width_px);
  // The radius below is that of a distant lamp; near the lamp the ellipse is slightly longer.
  constexpr double kEllipseMargin = 1.1;
  const std::vector<Piece> pieces = pieces_of(parts);
  for (const Surface surface : {Surface::table_top, Surface::floor}) {
    const float z_m = surface == Surface::table_top ? kTableTop_z_m : kFloor_z_m;
    std::vector<hull::PixelRect> rects;
    for (const Piece& piece : pieces) {
      std::vector<Vector3d> centers;
      std::vector<double> radii;
      for (const Vector3d& end : piece.centers_world_m) {
        const Vector3d down = end - lamp_m;
        // Projects the centre from the lamp onto the surface; 1: it is on the surface.
        const double scale = std::max(1.0, (double(z_m) - lamp_m.z()) / down.z());
        centers.push_back(lamp_m + scale * down);
        // A sphere's shadow on the surface is an ellipse, elongated by the slant of the light;
        // includes the penumbra.
        radii.push_back((scale * piece.radius_m + (scale - 1) * lamp::kRadius_m) * down.norm() /
                        -down.z() * kEllipseMargin);
      }
      rects.push_back(image_bounds_of(centers, radii));
      for (int v = rects.back().v0_px; v < rects.back().v1_px; ++v)
        std::fill_n(visibility_.begin() + std::ptrdiff_t(v * width + rects.back().u0_px),
                    rects.back().width_px(), 1.0f);
    }
    const auto seen_at = [&](int u, int v) {
      const Vector3f direction = direction_world(u, v, rotation);
      return Vector3f(eye + (z_m - eye.z()) / direction.z() * direction);
    };
    for (std::size_t i = 0; i < pieces.size(); ++i)
      for (int v = rects[i].v0_px; v < rects[i].v1_px; ++v)
        for (int u = rects[i].u0_px; u < rects[i].u1_px; ++u) {
          const std::size_t at = v * width + std::size_t(u);
          if (surface_[at] != surface || visibility_[at] == 0) continue;
          const Vector3f p = seen_at(u, v);
          visibility_[at] =
              std::min(visibility_[at],
                       std::visit([&](const auto& shape) { return lamp_visibility_past(shape, p); },
                                  pieces[i].shape));
        }
    for (const hull::PixelRect& rect : rects)
      for (int v = rect.v0_px; v < rect.v1_px; ++v)
        for (int u = rect.u0_px; u < rect.u1_px; ++u) {
          float& visible = visibility_[v * width + std::size_t(u)];
          if (visible == 1) continue;
          const Vector3f p = seen_at(u, v), up = Vector3f::UnitZ();
          const std::uint8_t* lit = room_.ptr(v) + 3 * u;
          put(bgr, u, v,
              Vector3f(lit[0], lit[1], lit[2]) *
                  (brightness(p, up, visible) / brightness(p, up, 1)));
          visible = 1;  // done: overlapping rectangles skip this pixel
        }
  }
}

}  // namespace fivepipe::capture
