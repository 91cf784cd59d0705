// STEP files. Those of tests/config/step are of Open CASCADE's writer; the tests change their text.
#include <cmath>
#include <functional>
#include <numbers>
#include <set>

#include "common/config/mesh/mesh_file.h"
#include "common/config/mesh/step_module.h"
#include "common/geometry/closed_mesh.h"
#include "tests/support/optional_package.h"
#include "tests/support/scene_files.h"
#include "tests/support/source_text.h"
#include "tests/support/text.h"

namespace fivepipe::config {
namespace {

using Eigen::Vector3d;
using test::replaced;
using test::replaced_all;

// As docs/configuration.md states.
constexpr double kDeflection_m = 1e-4, kAngle_rad = std::numbers::pi / 9;
// Vertices are floats in metres: the parts are smaller than 0.2 m.
constexpr double kRounding_m = 2e-8;

class StepImport : public test::SceneFiles {
 protected:
  void SetUp() override {
    if (!base::exists(kStepModule))
      FIVEPIPE_SKIP_WITHOUT_PACKAGE("built without Open CASCADE (libocct-data-exchange-dev)");
  }
  static std::filesystem::path step_file(const std::string& name) {
    return FIVEPIPE_SOURCE_DIR "/tests/config/step/" + name + ".step";
  }
  static std::string text(const std::string& name) { return test::text_of(step_file(name)); }
  static geometry::Mesh mesh_of_file(const std::filesystem::path& file) {
    const MeshOrReason read = read_mesh(file, std::nullopt);
    EXPECT_EQ(read.reason, "");
    return read.mesh;
  }
  geometry::Mesh mesh_of_text(const std::string& text) {
    return mesh_of_file(write("part.step", text));
  }
  std::string reason_of_text(const std::string& text) {
    return read_mesh(write("part.step", text), std::nullopt).reason;
  }
};

// Of a closed surface whose triangles share their vertices: V - E + F, with two triangles at each
// edge; 2 for a sphere, 0 for a torus.
int euler_characteristic(const geometry::Mesh& mesh) {
  return int(mesh.vertices_m.size()) - int(mesh.triangles.size()) / 2;
}

// The largest absolute value at the middles of the triangles and of their edges.
double largest(const geometry::Mesh& mesh, const std::function<double(const Vector3d&)>& distance) {
  double found = 0;
  for (const auto& [i, j, k] : mesh.triangles) {
    const Vector3d &a = mesh.vertices_m[i], &b = mesh.vertices_m[j], &c = mesh.vertices_m[k];
    for (const Vector3d& point : {Vector3d((a + b + c) / 3), Vector3d((a + b) / 2),
                                  Vector3d((b + c) / 2), Vector3d((c + a) / 2)})
      found = std::max(found, std::abs(distance(point)));
  }
  return found;
}

constexpr double kHoleRadius_m = 0.01;
double to_axis_of_hole_m(const Vector3d& p) { return std::hypot(p.x() - 0.02, p.y() - 0.02); }
bool is_on_hole(const Vector3d& p) {
  return std::abs(to_axis_of_hole_m(p) - kHoleRadius_m) < kRounding_m;
}

// A plate of 60 x 40 x 20 mm. The hole's surface has its outside at its axis.
TEST_F(StepImport, ASolidIsAClosedMeshOfItsSize) {
  const geometry::Mesh mesh = mesh_of_file(step_file("plate_with_hole"));
  EXPECT_EQ(geometry::open_edges(mesh), 0u);
  EXPECT_EQ(euler_characteristic(mesh), 0) << "a plate with one hole";
  const Eigen::AlignedBox3d bounds_m = geometry::bounds_m(mesh);
  EXPECT_LT((bounds_m.min() - Vector3d(0, 0, 0)).norm(), kRounding_m);
  EXPECT_LT((bounds_m.max() - Vector3d(0.06, 0.04, 0.02)).norm(), kRounding_m);
  // The polygon of the hole is inside its circle, by less than the deflection.
  const double exact_m3 = 0.02 * (0.06 * 0.04 - std::numbers::pi * kHoleRadius_m * kHoleRadius_m);
  const double side_of_hole_m2 = 0.02 * 2 * std::numbers::pi * kHoleRadius_m;
  EXPECT_GT(geometry::enclosed_volume_m3(mesh), exact_m3);
  EXPECT_LT(geometry::enclosed_volume_m3(mesh), exact_m3 + kDeflection_m * side_of_hole_m2);
}

TEST_F(StepImport, TrianglesAreWithinTheLinearDeflection) {
  const geometry::Mesh plate = mesh_of_file(step_file("plate_with_hole"));
  for (const auto& [i, j, k] : plate.triangles) {
    const std::array<Vector3d, 3> corners{plate.vertices_m[i], plate.vertices_m[j],
                                          plate.vertices_m[k]};
    if (!std::ranges::all_of(corners, is_on_hole)) continue;
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_GT(to_axis_of_hole_m((corners[c] + corners[(c + 1) % 3]) / 2),
                kHoleRadius_m - kDeflection_m);
  }
  const geometry::Mesh sphere = mesh_of_file(step_file("sphere")),
                       torus = mesh_of_file(step_file("torus"));
  const auto to_sphere_m = [](const Vector3d& p) { return p.norm() - 0.05; };
  const auto to_torus_m = [](const Vector3d& p) {
    return std::hypot(std::hypot(p.x(), p.y()) - 0.05, p.z()) - 0.02;
  };
  for (const Vector3d& v : sphere.vertices_m) EXPECT_NEAR(to_sphere_m(v), 0, kRounding_m);
  for (const Vector3d& v : torus.vertices_m) EXPECT_NEAR(to_torus_m(v), 0, kRounding_m);
  EXPECT_LT(largest(sphere, to_sphere_m), kDeflection_m);
  EXPECT_LT(largest(torus, to_torus_m), kDeflection_m);
  for (const geometry::Mesh* mesh : {&sphere, &torus}) {
    EXPECT_EQ(geometry::open_edges(*mesh), 0u);
    EXPECT_GT(geometry::enclosed_volume_m3(*mesh), 0);
  }
  EXPECT_EQ(euler_characteristic(sphere), 2);
  EXPECT_EQ(euler_characteristic(torus), 0);
}

// Returns the text in another unit, as a CAD program of inches writes its own.
std::string in_unit(const std::string& text, double unit_mm) {
  const std::string length_unit = "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )";
  return replaced(
      text, length_unit,
      "( CONVERSION_BASED_UNIT('INCH',#901) LENGTH_UNIT() NAMED_UNIT(#902) );\n"
      "#901 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(" +
          std::to_string(unit_mm) +
          "),#903);\n#902 = DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);\n#903 = " + length_unit);
}

// A radius of 0.5 mm: five edges would be within the linear deflection.
TEST_F(StepImport, ASmallCircleHasEdgesWithinTheAngularDeflection) {
  const geometry::Mesh mesh = mesh_of_text(in_unit(text("plate_with_hole"), 0.05));
  const auto on_circle = std::ranges::count_if(
      mesh.vertices_m, [](const Vector3d& v) { return v.z() < kRounding_m && is_on_hole(20 * v); });
  EXPECT_GE(on_circle, int(std::ceil(2 * std::numbers::pi / kAngle_rad)));
  EXPECT_EQ(geometry::open_edges(mesh), 0u);
}

TEST_F(StepImport, TheFileStatesItsUnit) {
  const std::string plate = text("plate_with_hole"),
                    in_metres = replaced(plate, ".MILLI.,.METRE.", "$,.METRE.");
  for (const auto& [in_this_unit, unit_m] : {std::pair<std::string, double>{plate, 1e-3},
                                             {in_metres, 1},
                                             {in_unit(plate, 25.4), 0.0254}}) {
    const std::filesystem::path file = write("part.step", in_this_unit);
    const geometry::Mesh mesh = mesh_of_file(file);
    const Vector3d size_m = geometry::bounds_m(mesh).sizes();
    EXPECT_TRUE(size_m.isApprox(unit_m * Vector3d(60, 40, 20), 1e-6)) << unit_m;
    EXPECT_EQ(geometry::open_edges(mesh), 0u);
    // At 0.1 mm, a hole of 10 m has 1400 edges.
    EXPECT_LT(mesh.triangles.size(), 1000u) << "the deflection grows with the shape";
    EXPECT_EQ(read_mesh(file, unit_m).reason, "");
    EXPECT_TRUE(read_mesh(file, unit_m).mesh.vertices_m == mesh.vertices_m);
  }
  EXPECT_EQ(read_mesh(step_file("plate_with_hole"), 0.0254).reason,
            "the file's unit is 1 mm, not 25.4 mm: leave the unit out, because a STEP file states "
            "it");
}

// Two boxes of 30 x 20 x 10 mm, 100 mm apart along x, and both again, turned by 90 degrees about z
// and 50 mm higher.
TEST_F(StepImport, AnAssemblyHasItsPartsAtTheirPlaces) {
  const geometry::Mesh mesh = mesh_of_file(step_file("assembly"));
  std::set<std::array<int, 3>> expected_mm, found_mm;
  for (const int x : {0, 30, 100, 130})
    for (const int y : {0, 20})
      for (const int z : {0, 10}) {
        expected_mm.insert({x, y, z});
        expected_mm.insert({-y, x, z + 50});
      }
  for (const Vector3d& v : mesh.vertices_m) {
    const Vector3d mm = 1e3 * v;
    EXPECT_LT((mm - mm.array().round().matrix()).norm(), 1e3 * kRounding_m);
    found_mm.insert({int(std::lround(mm.x())), int(std::lround(mm.y())), int(std::lround(mm.z()))});
  }
  EXPECT_EQ(found_mm, expected_mm);
  EXPECT_EQ(mesh.vertices_m.size(), expected_mm.size());
  EXPECT_EQ(mesh.triangles.size(), 4u * 12);
  EXPECT_EQ(geometry::open_edges(mesh), 0u);
  EXPECT_NEAR(geometry::enclosed_volume_m3(mesh), 4 * 0.03 * 0.02 * 0.01, 1e-11);
}

TEST_F(StepImport, TheExtensionMayBeInUpperCase) {
  for (const char* name : {"PART.STEP", "part.stp", "part.Stp"})
    EXPECT_EQ(read_mesh(write(name, text("assembly")), std::nullopt).reason, "") << name;
  EXPECT_TRUE(has_unit("a.STP"));
  EXPECT_FALSE(has_unit("a.stl"));
  EXPECT_EQ(read_mesh(write("part.obj", ""), std::nullopt).reason,
            "the format has no unit of length");
}

TEST_F(StepImport, TextThatIsNoStepFileIsRefused) {
  const std::string plate = text("plate_with_hole");
  for (const std::string& bad : {std::string(), std::string("solid x\nendsolid x\n"),
                                 plate.substr(0, 700), plate.substr(0, plate.size() / 2),
                                 plate.substr(0, plate.rfind("ENDSEC")), std::string(100, '\0')})
    EXPECT_EQ(reason_of_text(bad), "the file is no complete STEP file (ISO 10303-21)")
        << bad.size();
}

TEST_F(StepImport, AShapeThatWouldBeIncompleteIsRefused) {
  const std::string plate = text("plate_with_hole"), sphere = text("sphere");
  const std::string damaged = "a part of the shape is damaged (Open CASCADE: ";
  const auto expect_reason = [&](const std::string& bad, const std::string& reason) {
    const std::string found = reason_of_text(bad);
    EXPECT_TRUE(found.starts_with(reason)) << found << "\nnot: " << reason;
  };
  // An unknown surface, no surface, no direction, a missing face, a coordinate that is infinite.
  expect_reason(replaced(plate, "CYLINDRICAL_SURFACE", "WAVY_SURFACE"), damaged);
  expect_reason(replaced(plate, "= CYLINDRICAL_SURFACE(", "= DIRECTION("), damaged);
  expect_reason(replaced_all(plate, "DIRECTION('',(0.,0.,1.))", "DIRECTION('',(0.,0.,0.))"),
                damaged);
  expect_reason(replaced(plate, "ADVANCED_FACE", "ADVANCED_FARCE"), damaged);
  expect_reason(replaced_all(plate, "(0.,0.,20.)", "(0.,0.,1.E999)"), damaged);
  expect_reason(replaced(plate, "#200,10.)", "#200,0.)"), "1 of 7 faces cannot be triangulated: ");
  // The representation lists its axes and the solid.
  expect_reason(replaced(sphere, "(#11,#15)", "(#11)"), "the file has no faces; ");
  expect_reason(replaced(plate, "GLOBAL_UNIT_ASSIGNED_CONTEXT", "GLOBAL_NOTHING"),
                "the file states no unit of length: ");
}

// Returns the plate as a mapped item, placed with a scale and with the third axis (0, 0, z).
std::string placed_plate(const std::string& plate, const std::string& scale, const std::string& z,
                         const std::string& operator_names) {
  return replaced(
      replaced(plate, "SHAPE_DEFINITION_REPRESENTATION(#4,#10)",
               "SHAPE_DEFINITION_REPRESENTATION(#4,#900)"),
      "ENDSEC;\nEND-ISO",
      "#900 = SHAPE_REPRESENTATION('',(#11,#905),#204);\n#905 = MAPPED_ITEM('',#906,#907);\n"
      "#906 = REPRESENTATION_MAP(#11,#10);\n#907 = CARTESIAN_TRANSFORMATION_OPERATOR_3D(" +
          operator_names + ",#901,#902,#903," + scale +
          ",#904);\n#901 = DIRECTION('',(1.,0.,0.));\n#902 = DIRECTION('',(0.,1.,0.));\n"
          "#903 = CARTESIAN_POINT('',(500.,0.,0.));\n#904 = DIRECTION('',(0.,0.," +
          z + "));\nENDSEC;\nEND-ISO");
}

TEST_F(StepImport, APlacementThatScalesOrMirrorsIsRefused) {
  const std::string plate = text("plate_with_hole"), names = "'','',''";
  const geometry::Mesh moved = mesh_of_text(placed_plate(plate, "1.", "1.", names));
  EXPECT_NEAR(geometry::bounds_m(moved).min().x(), 0.5, 1e-7);
  for (const auto& [scale, z] : {std::pair<std::string, std::string>{"2.", "1."}, {"1.", "-1."}})
    EXPECT_TRUE(reason_of_text(placed_plate(plate, scale, z, names))
                    .starts_with("the placement of a part scales or mirrors it"))
        << scale << ' ' << z;
}

// Open CASCADE 7.6 ends with signal 11 if the operator lacks a name.
TEST_F(StepImport, ACrashOfTheLibraryIsAReason) {
  EXPECT_NE(reason_of_text(placed_plate(text("plate_with_hole"), "1.", "1.", "'',''")), "");
}

TEST_F(StepImport, AScenesMeshNeedsNoUnit) {
  write("plate.STEP", text("plate_with_hole"));
  const auto scene_of = [&](const std::string& mesh) {
    return test::load_scene(write(
        "scene.yaml", "name: s\nobjects:\n  - name: part\n    position_m: [0, 0, 0]\n    mesh: {" +
                          mesh + "}\n    motion: dynamic\n    reaction: contact\n"));
  };
  const Scene scene = scene_of("file: plate.STEP");
  EXPECT_LT((geometry::bounds_m(mesh_of(scene.objects.at(0))).sizes() - Vector3d(0.06, 0.04, 0.02))
                .norm(),
            kRounding_m);
  EXPECT_TRUE(mesh_warnings(scene).empty()) << "closed, and of a plausible size";
  EXPECT_EQ(scene_of("file: plate.STEP, unit: mm").objects.size(), 1u);
  const std::vector<std::string> problems =
      problems_of([&] { scene_of("file: plate.STEP, unit: in"); });
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_TRUE(test::contains(problems, "scene.yaml:5:18: mesh ")) << problems[0];
  EXPECT_TRUE(test::contains(problems, "the file's unit is 1 mm, not 25.4 mm")) << problems[0];
}

}  // namespace
}  // namespace fivepipe::config
