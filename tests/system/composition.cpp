#include "tests/system/composition.h"

#include <algorithm>
#include <cmath>

#include "common/hull/oracle/reference.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// OpenGL places vertices at 1/256 px and rasterises in float.
constexpr double kBorder_px = 0.02;
// A sphere of 1280 triangles is drawn as facets. A facet's corners are 0.094 rad from its center,
// so it is up to 1 - cos(0.094) = 0.0044 radii below the sphere. A ray that meets the sphere with
// this cosine or more meets the facet at a normal within 0.0044 / 0.3 = 0.015 rad, which changes
// the light by at most 3 of 255 levels.
constexpr double kMinSphereCosine = 0.3;
constexpr double kFacetError_levels = 3;
// Rounding of OpenGL's depth buffer at the depths of the tests, and of the hull's depth [m].
constexpr double kDepthRounding_m = 2e-4;
// Half a level by rounding to 8 bits, and the shader's float.
constexpr double kRounding_levels = 0.6;

// The constants of the light and of the colours of the hull are those that render_node's and
// recon_node's headers and shaders state.
constexpr double kHighlightStrength = 0.8;
const Vector3d kHighlightRgb(0.80, 0.02, 0.02);  // linear
constexpr double kProbes_m[] = {0.02, 0.04, 0.08, 0.16};

double linear(double srgb) {
  return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}
double srgb(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

// The pixel that contains the projection of p; nullopt if it is outside the image.
std::optional<Eigen::Vector2i> pixel_of(const geometry::Camera& camera, const Vector3d& p_world_m) {
  const Vector3d p = camera.camera_from_world * p_world_m;
  if (!(p.z() > 0)) return std::nullopt;
  const geometry::Pinhole& k = camera.pinhole;
  const Eigen::Vector2i pixel(int(std::floor(k.fx_px * p.x() / p.z() + k.cx_px + 0.5)),
                              int(std::floor(k.fy_px * p.y() / p.z() + k.cy_px + 0.5)));
  if (pixel.x() < 0 || pixel.y() < 0 || pixel.x() >= k.width_px || pixel.y() >= k.height_px)
    return std::nullopt;
  return pixel;
}
bool is_object(const hull::Silhouette& silhouette, const Vector3d& p_world_m) {
  const auto pixel = pixel_of(silhouette.camera, p_world_m);
  return pixel && silhouette.pixels.contains(pixel->x(), pixel->y());
}

// Where the ray enters the box; the face is 1 to 6.
struct Entry {
  double parameter;
  int face;
  Vector3d normal;
};
std::optional<Entry> enters(const config::BoxShape& box, const Vector3d& from, const Vector3d& d) {
  double near = -INFINITY, far = INFINITY;
  Entry entry{0, 0, Vector3d::Zero()};
  for (int axis = 0; axis < 3; ++axis) {
    const double half = box.size_m[axis] / 2;
    if (d[axis] == 0) {
      if (std::abs(from[axis]) > half) return std::nullopt;
      continue;
    }
    const double a = (-half - from[axis]) / d[axis], b = (half - from[axis]) / d[axis];
    if (std::min(a, b) > near) {
      near = std::min(a, b);
      entry = {near, 2 * axis + (a < b ? 1 : 2), Vector3d::Unit(axis) * (a < b ? -1.0 : 1.0)};
    }
    far = std::min(far, std::max(a, b));
  }
  if (!(near <= far && near > 0)) return std::nullopt;
  return entry;
}
std::optional<Entry> enters(const config::SphereShape& sphere, const Vector3d& from,
                            const Vector3d& d) {
  const double a = d.squaredNorm(), b = from.dot(d),
               discriminant = b * b - a * (from.squaredNorm() - sphere.radius_m * sphere.radius_m);
  if (discriminant < 0) return std::nullopt;
  const double t = (-b - std::sqrt(discriminant)) / a;
  if (!(t > 0)) return std::nullopt;
  return Entry{t, 1, (from + t * d).normalized()};
}
template <class Other>
std::optional<Entry> enters(const Other&, const Vector3d&, const Vector3d&) {
  throw std::logic_error("the composition has boxes and spheres only");
}

}  // namespace

bool ExpectedColour::matches(const Vector3d& found_bgr) const {
  return std::any_of(bgr.begin(), bgr.end(), [&](const Vector3d& one) {
    return (found_bgr - one).cwiseAbs().maxCoeff() <= error_levels;
  });
}

Composition::Composition(const config::Deployment& deployment, const ComposedFrame& frame)
    : deployment_(deployment),
      frame_(frame),
      eye_{config::recon_pinhole(deployment.viewer), frame.eye_from_world} {
  // The light has its nominal strength at the center of the scene at its start.
  Eigen::AlignedBox3d bounds;
  for (const config::SceneObject& object : deployment.scene.objects) {
    Vector3d half = Vector3d::Zero();
    if (const auto* box = std::get_if<config::BoxShape>(&object.shape)) half = box->size_m / 2;
    if (const auto* sphere = std::get_if<config::SphereShape>(&object.shape))
      half.setConstant(sphere->radius_m);
    for (int corner = 0; corner < 8; ++corner)
      bounds.extend(object.world_from_object * Vector3d(corner & 1 ? half.x() : -half.x(),
                                                        corner & 2 ? half.y() : -half.y(),
                                                        corner & 4 ? half.z() : -half.z()));
  }
  light_reach_m_ = (bounds.center() - deployment.scene.light_world_m).norm();
  const hull::View view{eye_, deployment.viewer.near_m, deployment.viewer.far_m};
  for (int v = 0; v < eye_.pinhole.height_px; ++v)
    for (int u = 0; u < eye_.pinhole.width_px; ++u)
      depth_m_.push_back(hull::reference_depth_m(frame.silhouettes, view, u, v).value_or(0));
}

double Composition::hull_depth_m(int u_px, int v_px) const {
  return depth_m_[std::size_t(v_px * eye_.pinhole.width_px + u_px)];
}

Composition::Hit Composition::cast(const Vector2d& uv_px) const {
  const geometry::Ray ray = geometry::ray_through(eye_, uv_px);
  Hit nearest;
  for (const config::SceneObject& object : deployment_.scene.objects) {
    const auto moved = frame_.world_from_object.find(object.name);
    const Eigen::Isometry3d world_from_object =
        moved == frame_.world_from_object.end() ? object.world_from_object : moved->second;
    const Eigen::Isometry3d object_from_world = world_from_object.inverse();
    const auto entry = std::visit(
        [&](const auto& shape) {
          return enters(shape, Vector3d(object_from_world * ray.origin_world_m),
                        Vector3d(object_from_world.linear() * ray.direction_world));
        },
        object.shape);
    if (!entry || (nearest.object && nearest.depth_m <= entry->parameter)) continue;
    nearest = {&object, entry->face, entry->parameter,
               ray.origin_world_m + entry->parameter * ray.direction_world,
               world_from_object.linear() * entry->normal};
  }
  return nearest;
}

// A point light whose light decreases as 1 / (1 + d^2), and light from the sky.
Vector3d Composition::lit_srgb(const Hit& hit) const {
  const Vector3d to_light = (deployment_.scene.light_world_m - hit.p_world_m) / light_reach_m_;
  const double diffuse = 1.6 * std::max(0.0, hit.normal_world.dot(to_light)) / to_light.norm() /
                         (1 + to_light.squaredNorm()),
               up = hit.normal_world.z();
  Vector3d albedo;
  for (int c = 0; c < 3; ++c) albedo[c] = linear(hit.object->colour_rgb[std::size_t(c)]);
  if (frame_.colliding.contains(hit.object->name))
    albedo += kHighlightStrength * (kHighlightRgb - albedo);
  const Vector3d light = Vector3d(0.135, 0.1425, 0.155) + up * Vector3d(0.065, 0.0775, 0.095) +
                         diffuse * Vector3d(1, 0.97, 0.92);
  Vector3d bgr;
  for (int c = 0; c < 3; ++c) bgr[2 - c] = 255 * srgb(std::clamp(albedo[c] * light[c], 0.0, 1.0));
  return bgr;
}

// 1, or less if a probe on the way to the camera is in the hull, as seen by the other cameras.
double Composition::visibility(const ColourImage& image, const Vector3d& p_world_m) const {
  const Vector3d center = geometry::camera_center_world_m(image.camera);
  // At the border of the camera's own silhouette the point does not project to an object pixel.
  if (image.object) {
    const auto own = pixel_of(image.camera, p_world_m);
    if (!own || !image.object->contains(own->x(), own->y())) return 1;
  }
  double factor = 1;
  for (const double probe_m : kProbes_m) {
    const double distance_m = (center - p_world_m).norm();
    if (!(probe_m < distance_m)) continue;
    const Vector3d probe = p_world_m + probe_m / distance_m * (center - p_world_m);
    const bool hidden = std::all_of(frame_.silhouettes.begin(), frame_.silhouettes.end(),
                                    [&](const hull::Silhouette& s) {
                                      return &s.pixels == image.object || is_object(s, probe);
                                    });
    if (hidden) factor = std::min(factor, probe_m == kProbes_m[0] ? 0.3 : 1e-9);
  }
  return factor;
}

Vector3d Composition::blended(const Vector3d& p_world_m) const {
  const Vector3d to_eye = (geometry::camera_center_world_m(eye_) - p_world_m).normalized();
  Vector3d sum = Vector3d::Zero();
  double weights = 0;
  for (const ColourImage& image : frame_.images) {
    const auto uv = geometry::project(image.camera, p_world_m);
    if (!uv) continue;
    const double view_weight = std::pow(
        0.5 *
            (1 +
             (geometry::camera_center_world_m(image.camera) - p_world_m).normalized().dot(to_eye)),
        16);
    const int u0 = int(std::floor(uv->x())), v0 = int(std::floor(uv->y()));
    Vector3d colour = Vector3d::Zero();
    double covered = 0;
    for (int du = 0; du < 2; ++du)
      for (int dv = 0; dv < 2; ++dv) {
        const int u = u0 + du, v = v0 + dv;
        if (!image.sent.contains(u, v) || (image.object && !image.object->contains(u, v))) continue;
        const double part = (1 - std::abs(uv->x() - u)) * (1 - std::abs(uv->y() - v));
        const cv::Vec3b& bgr = image.bgr.at<cv::Vec3b>(v, u);
        colour += part * Vector3d(bgr[0], bgr[1], bgr[2]);
        covered += part;
      }
    if (covered == 0) continue;
    const double weight = view_weight * visibility(image, p_world_m);
    sum += weight * colour;
    weights += weight * covered;
  }
  if (weights == 0) return Vector3d::Constant(128);  // no image contains the point
  return sum / weights;
}

ExpectedColour Composition::hull_bgr(int u_px, int v_px) const {
  const geometry::Ray ray = geometry::ray_through(eye_, Vector2d(u_px, v_px));
  const double depth_m = hull_depth_m(u_px, v_px);
  // A point of the hull is at the border of a silhouette, so rounding decides whether it projects
  // to an object pixel of that camera. Half a level is rounding, a quarter the images that
  // recon_node neglects.
  ExpectedColour colour{{}, 0.5 + 0.25 + 0.01};
  for (const double error : {-kHullDepthError, 0.0, kHullDepthError})
    colour.bgr.push_back(blended(ray.origin_world_m + (1 + error) * depth_m * ray.direction_world));
  return colour;
}

std::optional<Composition::Pixel> Composition::composite(int u_px, int v_px) const {
  const Hit hit = cast(Vector2d(u_px, v_px));
  for (const double du : {-kBorder_px, kBorder_px})
    for (const double dv : {-kBorder_px, kBorder_px})
      if (const Hit beside = cast(Vector2d(u_px + du, v_px + dv));
          beside.object != hit.object || beside.face != hit.face)
        return std::nullopt;
  if (const double depth_m = hull_depth_m(u_px, v_px); depth_m > 0) {
    if (hit.object && std::abs(depth_m - hit.depth_m) < kDepthRounding_m) return std::nullopt;
    if (!hit.object || depth_m < hit.depth_m) {
      // OpenGL interpolates between texels whose weight is rounding, and rounds again.
      ExpectedColour colour = hull_bgr(u_px, v_px);
      colour.error_levels += kRounding_levels;
      return Pixel{Shown::hull, colour};
    }
  }
  if (!hit.object) {
    // From 0.8 of the background colour at the lower border to 1.2 at the upper one.
    const double height = 1 - (v_px + 0.5) / eye_.pinhole.height_px;
    Vector3d bgr;
    for (int c = 0; c < 3; ++c)
      bgr[2 - c] = 255 * (0.8 + 0.4 * height) * deployment_.scene.background_rgb[std::size_t(c)];
    return Pixel{Shown::background, {{bgr}, kRounding_levels}};
  }
  const bool is_sphere = std::holds_alternative<config::SphereShape>(hit.object->shape);
  const Vector3d towards_eye = (geometry::camera_center_world_m(eye_) - hit.p_world_m).normalized();
  if (is_sphere && hit.normal_world.dot(towards_eye) < kMinSphereCosine) return std::nullopt;
  // Rounding, and 0.41 levels of the shader's curve.
  const double error_levels = 0.95 + (is_sphere ? kFacetError_levels : 0);
  return Pixel{
      frame_.colliding.contains(hit.object->name) ? Shown::highlighted_object : Shown::object,
      {{lit_srgb(hit)}, error_levels}};
}

}  // namespace fivepipe::test
