#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "common/geometry/camera.h"
#include "common/geometry/gl_camera.h"
#include "common/geometry/mesh.h"

namespace fivepipe::geometry {
namespace {

Camera test_camera() {
  return {{640, 480, 500, 510, 310.5, 245.25}, look_at({1.2, -2.0, 1.1}, {0, 0, 0.3})};
}

TEST(Camera, ProjectsTheRayThroughAPixelBackToIt) {
  const Camera camera = test_camera();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(-0.5, 639.5), v(-0.5, 479.5), depth_m(0.01, 20);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector2d uv_px{u(random), v(random)};
    const Ray ray = ray_through(camera, uv_px);
    const double z_m = depth_m(random);
    const Eigen::Vector3d p_world_m = ray.origin_world_m + z_m * ray.direction_world;
    EXPECT_LT((*project(camera, p_world_m) - uv_px).norm(), 1e-8);
    EXPECT_NEAR((camera.camera_from_world * p_world_m).z(), z_m, 1e-12 * (1 + z_m));
  }
}

TEST(Camera, PointBehindOrAtTheCameraHasNoPixel) {
  const Camera camera{{640, 480, 500, 500, 319.5, 239.5}, Eigen::Isometry3d::Identity()};
  EXPECT_FALSE(project(camera, {0, 0, 0}));
  EXPECT_FALSE(project(camera, {0.1, 0.1, -1e-9}));
  EXPECT_TRUE(project(camera, {0, 0, 1e-9}));
  EXPECT_FALSE(project(camera, {0, 0, std::numeric_limits<double>::quiet_NaN()}));
}

TEST(Camera, LookAtPutsTheTargetOnThePrincipalPointWithUpTowardsSmallerV) {
  const Camera camera = test_camera();
  const Eigen::Vector2d center = *project(camera, {0, 0, 0.3});
  EXPECT_NEAR(center.x(), 310.5, 1e-9);
  EXPECT_NEAR(center.y(), 245.25, 1e-9);
  EXPECT_LT(project(camera, {0, 0, 0.4})->y(), center.y());
  EXPECT_NEAR(camera.camera_from_world.linear().determinant(), 1, 1e-12);
}

TEST(Camera, ADefaultPinholeHasNoPixels) {
  EXPECT_EQ(Pinhole{}, (Pinhole{0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(why_unusable({}), "image size is not positive");
}

TEST(PixelFromCamera, CentreOfPixelIsAtHalf) {
  const Pinhole pinhole{640, 480, 500, 510, 310.25, 250.5};
  const Camera camera{pinhole};
  for (const Eigen::Vector2d& uv_px : {Eigen::Vector2d(0, 0), {3, 7}, {639, 479}}) {
    const Ray ray = ray_through(camera, uv_px);
    const Eigen::Vector3d p = ray.origin_world_m + 2.5 * ray.direction_world;
    const Eigen::Vector3d pixel = pixel_from_camera(pinhole) * p,
                          centered = centered_pixel_from_camera(pinhole) * p;
    EXPECT_EQ(pixel.z(), 2.5);
    EXPECT_NEAR(pixel.x() / pixel.z(), uv_px.x() + 0.5, 1e-12);
    EXPECT_NEAR(pixel.y() / pixel.z(), uv_px.y() + 0.5, 1e-12);
    EXPECT_NEAR(centered.x() / centered.z(), uv_px.x(), 1e-12);
    EXPECT_NEAR(centered.y() / centered.z(), uv_px.y(), 1e-12);
  }
}

TEST(Camera, ResizedImageSeesTheSameEdges) {
  const Pinhole full{640, 480, 500, 510, 310.5, 245.25}, half = resized(full, 320, 240);
  const auto u_of = [](const Pinhole& k, double x_over_z) { return k.fx_px * x_over_z + k.cx_px; };
  const double left = (-0.5 - full.cx_px) / full.fx_px, right = (639.5 - full.cx_px) / full.fx_px;
  EXPECT_NEAR(u_of(half, left), -0.5, 1e-12);
  EXPECT_NEAR(u_of(half, right), 319.5, 1e-12);
  const Pinhole flat = resized(full, 320, 120);
  EXPECT_EQ(flat.height_px, 120);
  EXPECT_NEAR((-0.5 - flat.cy_px) / flat.fy_px, (-0.5 - full.cy_px) / full.fy_px, 1e-12);
  EXPECT_NEAR((119.5 - flat.cy_px) / flat.fy_px, (479.5 - full.cy_px) / full.fy_px, 1e-12);
}

TEST(Camera, FieldOfViewIsThatBetweenTheLeftAndTheRightEdge) {
  const Pinhole k = pinhole_from_fov(640, 480, M_PI / 3);
  EXPECT_EQ(k.width_px, 640);
  EXPECT_EQ(k.height_px, 480);
  EXPECT_NEAR((-0.5 - k.cx_px) / k.fx_px, -std::tan(M_PI / 6), 1e-12);
  EXPECT_NEAR((639.5 - k.cx_px) / k.fx_px, std::tan(M_PI / 6), 1e-12);
  EXPECT_EQ(k.fy_px, k.fx_px);
  EXPECT_EQ(k.cy_px, 239.5);
}

TEST(Camera, EachIntrinsicParameterIsValidated) {
  const double infinity = std::numeric_limits<double>::infinity(),
               nan = std::numeric_limits<double>::quiet_NaN();
  const auto why = [](const Pinhole& k) {
    return why_unusable({k, Eigen::Isometry3d::Identity()}).value_or("");
  };
  EXPECT_EQ(why({1, 1, 0.5, 0.25, -7, 1e6}), "");
  for (const int size_px : {0, -1}) {
    EXPECT_EQ(why({size_px, 480, 500, 500, 320, 240}), "image size is not positive");
    EXPECT_EQ(why({640, size_px, 500, 500, 320, 240}), "image size is not positive");
  }
  for (const double f_px : {0.0, -1.0, infinity, nan}) {
    EXPECT_EQ(why({640, 480, f_px, 500, 320, 240}), "focal length is not positive and finite");
    EXPECT_EQ(why({640, 480, 500, f_px, 320, 240}), "focal length is not positive and finite");
  }
  for (const double c_px : {infinity, -infinity, nan}) {
    EXPECT_EQ(why({640, 480, 500, 500, c_px, 240}), "principal point is not finite");
    EXPECT_EQ(why({640, 480, 500, 500, 320, c_px}), "principal point is not finite");
  }
}

TEST(Camera, RotationsMayDifferFromOrthonormalByAThousandth) {
  Camera camera = test_camera();
  const Eigen::Matrix3d rotation = camera.camera_from_world.linear();
  camera.camera_from_world.linear() = std::sqrt(1 + 0.99e-3) * rotation;
  EXPECT_FALSE(why_unusable(camera));
  camera.camera_from_world.linear() = std::sqrt(1 + 1.01e-3) * rotation;
  EXPECT_EQ(why_unusable(camera), "rotation is not orthonormal");
}

TEST(Camera, UnusableCalibrationHasAReason) {
  Camera camera = test_camera();
  EXPECT_FALSE(why_unusable(camera));
  camera.pinhole.fx_px = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(why_unusable(camera)->find("focal"), std::string::npos);
  camera = test_camera();
  camera.camera_from_world.translation().x() = std::numeric_limits<double>::infinity();
  EXPECT_NE(why_unusable(camera)->find("not finite"), std::string::npos);
  camera = test_camera();
  camera.camera_from_world.linear().row(0) *= -1;
  EXPECT_NE(why_unusable(camera)->find("mirrored"), std::string::npos);
  camera = test_camera();
  camera.camera_from_world.linear() *= 1.01;
  EXPECT_NE(why_unusable(camera)->find("orthonormal"), std::string::npos);
}

TEST(Camera, NearRotationIsOrthonormalized) {
  Camera camera = test_camera();
  camera.camera_from_world.linear()(0, 1) += 1e-6;
  EXPECT_FALSE(why_unusable(camera));
  const Eigen::Matrix3d r = nearest_rotation(camera.camera_from_world.linear());
  EXPECT_LT((r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-14);
}

// The centre of a pixel maps to the centre of the framebuffer pixel, with rows counted from the
// bottom. A shift by half a pixel fails.
TEST(GlCamera, PixelCentresLandOnFramebufferPixelCentres) {
  const Pinhole k{640, 480, 500, 510, 310.5, 245.25};
  const Eigen::Matrix4d clip_from_camera = gl_clip_from_camera(k, 0.1, 5);
  for (const Eigen::Vector2d& uv_px :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(639, 479), Eigen::Vector2d(100, 300)}) {
    const Eigen::Vector4d p_camera((uv_px.x() - k.cx_px) / k.fx_px * 2,
                                   (uv_px.y() - k.cy_px) / k.fy_px * 2, 2, 1);
    const Eigen::Vector4d clip = clip_from_camera * p_camera;
    const double x_window = (clip.x() / clip.w() + 1) / 2 * k.width_px,
                 y_window = (clip.y() / clip.w() + 1) / 2 * k.height_px;
    EXPECT_NEAR(x_window, uv_px.x() + 0.5, 1e-9);
    EXPECT_NEAR(y_window, k.height_px - 1 - uv_px.y() + 0.5, 1e-9);
    EXPECT_NEAR(depth_m_from_window_depth((clip.z() / clip.w() + 1) / 2, 0.1, 5), 2, 1e-9);
  }
}

TEST(GlCamera, NearAndFarAreTheEndsOfTheDepthRange) {
  const Eigen::Matrix4d m = gl_clip_from_camera({640, 480, 500, 500, 319.5, 239.5}, 0.1, 5);
  const Eigen::Vector4d at_near = m * Eigen::Vector4d(0, 0, 0.1, 1),
                        at_far = m * Eigen::Vector4d(0, 0, 5, 1);
  EXPECT_NEAR(at_near.z() / at_near.w(), -1, 1e-12);
  EXPECT_NEAR(at_far.z() / at_far.w(), 1, 1e-12);
}

TEST(GlCamera, TextureCoordinatesHitTexelCentres) {
  const Pinhole k{720, 486, 600, 610, 350, 240};
  const Eigen::Vector4d p_camera((17 - k.cx_px) / k.fx_px * 3, (400 - k.cy_px) / k.fy_px * 3, 3, 1);
  const Eigen::Vector3d stq = texture_from_camera(k) * p_camera;
  EXPECT_NEAR(stq.x() / stq.z() * k.width_px, 17.5, 1e-9);
  EXPECT_NEAR(stq.y() / stq.z() * k.height_px, 400.5, 1e-9);
}

double signed_volume_m3(const Mesh& mesh) {
  double volume = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    volume += mesh.vertices_m[a].dot(mesh.vertices_m[b].cross(mesh.vertices_m[c])) / 6;
  return volume;
}

// How often each directed edge occurs.
std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges_of(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& [a, b, c] : mesh.triangles) ++edges[{a, b}], ++edges[{b, c}], ++edges[{c, a}];
  return edges;
}

// A closed surface of one orientation: two triangles meet at each edge, in opposite directions.
void expect_closed(const Mesh& mesh) {
  const auto edges = edges_of(mesh);
  for (const auto& [edge, count] : edges) {
    ASSERT_LT(edge.first, mesh.vertices_m.size());
    ASSERT_EQ(count, 1) << edge.first << ' ' << edge.second;
    ASSERT_TRUE(edges.contains({edge.second, edge.first})) << edge.first << ' ' << edge.second;
  }
  EXPECT_EQ(mesh.vertices_m.size() + mesh.triangles.size(), edges.size() / 2 + 2);  // Euler
}

TEST(Mesh, EveryTriangleOfABoxIsOnAFaceAndFacesOutwards) {
  const Eigen::Vector3d size_m(0.2, 0.31, 0.5);
  for (const double cell_m : {0.0, 0.06}) {
    const Mesh mesh = box_mesh(size_m, cell_m);
    expect_closed(mesh);
    EXPECT_TRUE(bounds_m(mesh).max().isApprox(0.5 * size_m, 1e-12));
    EXPECT_TRUE(bounds_m(mesh).min().isApprox(-0.5 * size_m, 1e-12));
    std::map<std::pair<int, bool>, double> area_m2;  // by axis and side
    for (const auto& [a, b, c] : mesh.triangles) {
      const Eigen::Vector3d &pa = mesh.vertices_m[a], &pb = mesh.vertices_m[b],
                            &pc = mesh.vertices_m[c];
      const Eigen::Vector3d normal = 0.5 * (pb - pa).cross(pc - pa);
      int axis;
      const double area = normal.cwiseAbs().maxCoeff(&axis);
      EXPECT_NEAR(normal.norm(), area, 1e-15) << "parallel to an axis";
      const double side_m = std::copysign(0.5 * size_m[axis], normal[axis]);
      for (const Eigen::Vector3d& p : {pa, pb, pc}) EXPECT_NEAR(p[axis], side_m, 1e-15);
      area_m2[{axis, normal[axis] > 0}] += area;
    }
    EXPECT_EQ(area_m2.size(), 6u);
    for (const auto& [side, area] : area_m2)
      EXPECT_NEAR(area, size_m.prod() / size_m[side.first], 1e-12);
  }
  EXPECT_EQ(box_mesh(size_m).vertices_m.size(), 8u);
}

TEST(Mesh, ABoxOfHeightZeroHasCells) {
  const Mesh mesh = box_mesh({0.2, 0.1, 0}, 0.06);
  EXPECT_EQ(mesh.triangles.size(), 4u * (4 * 2 + 4 + 2));
  for (const Eigen::Vector3d& p_m : mesh.vertices_m) EXPECT_EQ(p_m.z(), 0);
}

TEST(Mesh, ASphereIsASubdividedIcosahedron) {
  const Mesh icosahedron = sphere_mesh(2, 0);
  EXPECT_EQ(icosahedron.vertices_m.size(), 12u);
  EXPECT_EQ(icosahedron.triangles.size(), 20u);
  for (const auto& [edge, count] : edges_of(icosahedron))
    EXPECT_NEAR((icosahedron.vertices_m[edge.first] - icosahedron.vertices_m[edge.second]).norm(),
                2 / std::sin(0.4 * M_PI), 1e-12);
  for (const int subdivisions : {0, 1, 3}) {
    const Mesh mesh = sphere_mesh(2, subdivisions);
    expect_closed(mesh);
    EXPECT_GT(signed_volume_m3(mesh), 0);
    for (const Eigen::Vector3d& p_m : mesh.vertices_m) EXPECT_NEAR(p_m.norm(), 2, 1e-12);
  }
}

TEST(Mesh, TheCurtainIsASheetWithFolds) {
  constexpr int kColumns = 4, kRows = 3;
  const Mesh mesh = curtain_mesh(0.8, 0.6, kColumns, kRows, 0.02, 1.5);
  ASSERT_EQ(mesh.vertices_m.size(), std::size_t((kColumns + 1) * (kRows + 1)));
  std::vector<int> found(mesh.vertices_m.size());
  for (const Eigen::Vector3d& p_m : mesh.vertices_m) {
    const double column = (p_m.x() + 0.4) / 0.2, row = -p_m.z() / 0.2;
    EXPECT_NEAR(column, std::round(column), 1e-9);
    EXPECT_NEAR(row, std::round(row), 1e-9);
    ++found.at(std::size_t(std::lround(row) * (kColumns + 1) + std::lround(column)));
    // 1.5 periods of a sine that begins at the left edge.
    EXPECT_NEAR(p_m.y(), 0.02 * std::sin(3 * M_PI * (p_m.x() + 0.4) / 0.8), 1e-12);
  }
  EXPECT_EQ(found, std::vector<int>(found.size(), 1));
  const auto edges = edges_of(mesh);
  int border = 0;
  for (const auto& [edge, count] : edges) {
    ASSERT_LT(edge.first, mesh.vertices_m.size());
    EXPECT_EQ(count, 1);
    border += !edges.contains({edge.second, edge.first});
  }
  EXPECT_EQ(border, 2 * (kColumns + kRows));
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d ab_m = mesh.vertices_m[b] - mesh.vertices_m[a],
                          ac_m = mesh.vertices_m[c] - mesh.vertices_m[a];
    EXPECT_NEAR(ab_m.cross(ac_m).y(), -0.2 * 0.2, 1e-12) << "half a cell that faces -y";
  }
}

// The signed volume is positive only if the triangles are counter-clockwise as seen from outside.
TEST(Mesh, SubdividedBoxIsClosedWithBoundedCells) {
  const Mesh mesh = box_mesh({0.2, 0.31, 0.5}, 0.06);
  EXPECT_NEAR(signed_volume_m3(mesh), 0.031, 1e-12);
  EXPECT_EQ(mesh.triangles.size(), 4u * (4 * 6 + 6 * 9 + 9 * 4));
  // Euler characteristic of a closed surface without holes.
  EXPECT_EQ(mesh.vertices_m.size(), mesh.triangles.size() / 2 + 2);
  for (const auto& [a, b, c] : mesh.triangles)
    EXPECT_LE((mesh.vertices_m[b] - mesh.vertices_m[a]).cwiseAbs().maxCoeff(), 0.06 + 1e-12);
}

TEST(Mesh, BoxHasItsVolumeWithOutwardFaces) {
  EXPECT_NEAR(signed_volume_m3(box_mesh({0.2, 0.3, 0.5})), 0.03, 1e-12);
  EXPECT_EQ(box_mesh({20, 30, 50}).triangles.size(), 12u) << "without a size of cells";
}

TEST(Mesh, SphereApproachesItsVolumeFromInside) {
  const double exact = 4.0 / 3 * M_PI * 0.001;
  const double v2 = signed_volume_m3(sphere_mesh(0.1, 2)),
               v3 = signed_volume_m3(sphere_mesh(0.1, 3));
  EXPECT_EQ(sphere_mesh(0.1, 2).triangles.size(), 320u);
  EXPECT_GT(v2, 0.95 * exact);
  EXPECT_GT(v3, v2);
  EXPECT_LT(v3, exact);
}

TEST(Mesh, CurtainOfThePaperHas720Triangles) {
  const Mesh mesh = curtain_mesh(0.7, 0.6, 18, 20, 0.02, 5);
  EXPECT_EQ(mesh.triangles.size(), 720u);
  EXPECT_NEAR(bounds_m(mesh).min().z(), -0.6, 1e-12);
  EXPECT_NEAR(bounds_m(mesh).max().x(), 0.35, 1e-12);
}

}  // namespace
}  // namespace fivepipe::geometry
