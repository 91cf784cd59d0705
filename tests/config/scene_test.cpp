#include "common/config/scene.h"

#include <sys/stat.h>

#include <cstdint>
#include <cstring>
#include <limits>

#include "common/config/yaml/key_suggestion.h"
#include "tests/support/base64.h"
#include "tests/support/scene_files.h"

namespace fivepipe::config {
namespace {

using ::testing::ElementsAre;

// A tetrahedron with a corner at the origin and edges of length 1 (in the file's unit) along the
// axes.
const std::string kTetrahedronVertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
const std::string kTetrahedronObj = kTetrahedronVertices + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
const std::string kTetrahedronPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
    "z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 "
    "0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
const std::string kTriangleStl =
    "solid one\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
    "0\nendloop\nendfacet\nendsolid one\n";

// Returns one triangle. The axes of glTF are x right, y up, z towards the viewer.
std::string triangle_gltf(float last_coordinate) {
  const float positions[9] = {0, 0, 0, 1, 0, 0, 0, 2, last_coordinate};
  std::string bytes(sizeof positions, '\0');
  std::memcpy(bytes.data(), positions, sizeof positions);
  return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
 "nodes": [{"mesh": 0}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                "min": [0, 0, 0], "max": [1, 2, 3]}],
 "bufferViews": [{"buffer": 0, "byteLength": 36}],
 "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,)" +
         test::base64(bytes) + "\"}]}";
}

class SceneFile : public test::SceneFiles {
 protected:
  Scene load(const std::string& text) { return test::load_scene(write("scene.yaml", text)); }
  std::vector<std::string> problems(const std::string& text) {
    return problems_of([&] { load(text); });
  }
  static std::string mesh_scene(const std::string& mesh) {
    return "name: m\nobjects:\n  - name: part\n    position_m: [0, 0, 0]\n    mesh: {" + mesh +
           "}\n";
  }
};

TEST_F(SceneFile, ReadsEveryKey) {
  const Scene scene = load(R"(
name: all
gravity_m_s2: 1.62
light_m: [1, 2, 3]
background_rgb: [0, 0.5, 1]
objects:
  - name: box
    box: {size_m: [0.1, 0.2, 0.3]}
    position_m: [1, 2, 3]
    rotation_deg: [0, 0, 90]
    reaction: none
    colour_rgb: [0.25, 0.5, 0.75]
    pattern: checker
    pattern_size_m: 0.05
  - name: ball
    sphere: {radius_m: 0.5, subdivisions: 1}
    position_m: [0, 0, 1]
    motion: dynamic
    reaction: contact
    mass_kg: 0.25
    restitution: 0.75
    friction: 0.125
    velocity_m_s: [1, -2, 3]
  - name: curtain
    curtain: {width_m: 0.6, height_m: 0.4, columns: 20, rows: 18, fold_depth_m: 0.01, fold_count: 3}
    position_m: [0, 0, 1]
    motion: cloth
    cloth:
      density_kg_m2: 0.5
      stretch_compliance_m_n: 0.01
      compression_compliance_m_n: 0.02
      shear_compliance_m_n: 0.03
      bending_compliance_1_nm: 40
      damping_s: 0.05
      air_drag_1_s: 0.06
      thickness_m: 0.007
      friction: 0.8
      self_collision: true
      object_collision: true
      v_rec: [0, 2, 0]
      pins:
        - {from_m: [1, 0.1, 0.1], to_m: [-1, -0.1, -0.01], slides_along: [3, 0, 0]}
        - {from_m: [-1, -0.1, -0.5], to_m: [-0.29, 0.1, 0]}
)");
  EXPECT_EQ(scene.name, "all");
  EXPECT_EQ(scene.gravity_m_s2, 1.62);
  EXPECT_EQ(scene.light_world_m, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(scene.background_rgb, (std::array{0.0, 0.5, 1.0}));
  ASSERT_EQ(scene.objects.size(), 3u);

  const SceneObject &box = scene.objects[0], &ball = scene.objects[1], &curtain = scene.objects[2];
  EXPECT_EQ(std::get<BoxShape>(box.shape).size_m, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_TRUE(
      (box.world_from_object * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(1, 3, 3), 1e-12))
      << "the rotation about z maps x to y";
  EXPECT_EQ(box.motion, Motion::fixed);
  EXPECT_EQ(box.reaction, Reaction::none);
  EXPECT_EQ(box.colour_rgb, (std::array{0.25, 0.5, 0.75}));
  EXPECT_EQ(box.pattern, Pattern::checker);
  EXPECT_EQ(box.pattern_size_m, 0.05);
  EXPECT_EQ(mesh_of(box).triangles.size(), 12u);

  EXPECT_EQ(std::get<SphereShape>(ball.shape).radius_m, 0.5);
  EXPECT_EQ(mesh_of(ball).triangles.size(), 80u);
  EXPECT_EQ(ball.motion, Motion::dynamic);
  EXPECT_EQ(ball.reaction, Reaction::contact);
  EXPECT_EQ(ball.mass_kg, 0.25);
  EXPECT_EQ(ball.restitution, 0.75);
  EXPECT_EQ(ball.friction, 0.125);
  EXPECT_EQ(ball.velocity_world_m_s, Eigen::Vector3d(1, -2, 3));

  EXPECT_EQ(std::get<CurtainShape>(curtain.shape).fold_count, 3);
  EXPECT_EQ(mesh_of(curtain).triangles.size(), 720u) << "the paper's curtain";
  EXPECT_EQ(curtain.motion, Motion::cloth);
  EXPECT_EQ(curtain.reaction, Reaction::yield);
  ASSERT_TRUE(curtain.cloth);
  EXPECT_EQ(curtain.cloth->density_kg_m2, 0.5);
  EXPECT_EQ(curtain.cloth->stretch_compliance_m_n, 0.01);
  EXPECT_EQ(curtain.cloth->compression_compliance_m_n, 0.02);
  EXPECT_EQ(curtain.cloth->shear_compliance_m_n, 0.03);
  EXPECT_EQ(curtain.cloth->bending_compliance_1_nm, 40);
  EXPECT_EQ(curtain.cloth->damping_s, 0.05);
  EXPECT_EQ(curtain.cloth->air_drag_1_s, 0.06);
  EXPECT_EQ(curtain.cloth->thickness_m, 0.007);
  EXPECT_EQ(curtain.cloth->friction, 0.8);
  EXPECT_TRUE(curtain.cloth->self_collision);
  EXPECT_TRUE(curtain.cloth->object_collision);
  EXPECT_EQ(curtain.cloth->v_rec_world, Eigen::Vector3d(0, 2, 0));
  ASSERT_EQ(curtain.cloth->pins.size(), 2u);
  EXPECT_EQ(curtain.cloth->pins[0].box_m.min(), Eigen::Vector3d(-1, -0.1, -0.01));
  EXPECT_EQ(curtain.cloth->pins[0].box_m.max(), Eigen::Vector3d(1, 0.1, 0.1));
  EXPECT_EQ(curtain.cloth->pins[0].slides_along, Eigen::Vector3d(3, 0, 0));
  EXPECT_FALSE(curtain.cloth->pins[1].slides_along);
}

TEST_F(SceneFile, RejectsImpossibleCloth) {
  write("line.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 2 4\n");
  EXPECT_THAT(
      problems(R"(
name: bad
objects:
  - name: a
    curtain: {width_m: 0.6, height_m: 0.4, columns: 20, rows: 18}
    position_m: [0, 0, 1]
    motion: cloth
    cloth:
      v_rec: [0, 0, 0]
      pins:
        - {from_m: [-0.3, 0, 0.9], to_m: [0.3, 0, 1]}
        - {from_m: [-0.3, 0, 0], to_m: [0.3, 0, 0], slides_along: [0, 0, 0]}
  - name: b
    mesh: {file: line.obj, unit: m}
    position_m: [0, 0, 1]
    motion: cloth
  - name: c
    box: {size_m: [1, 1, 1]}
    position_m: [0, 0, 1]
    motion: cloth
  - name: d
    box: {size_m: [1, 1, 1]}
    position_m: [0, 0, 1]
    reaction: yield
    cloth: {}
  - name: e
    curtain: {width_m: 0.6, height_m: 0.4, columns: 20, rows: 18}
    position_m: [0, 0, 1]
    motion: cloth
    reaction: bounce
    report: {first_contact: true}
history: {}
)"),
      ElementsAre(
          "scene.yaml:8:14: v_rec must not be zero: it is a direction",
          "scene.yaml:10:11: the pin holds no vertex: from_m and to_m are in the object's frame, "
          "in "
          "which the cloth extends from [-0.3, 0, -0.4] to [0.3, 0, 0]",
          "scene.yaml:11:67: slides_along must not be zero: it is a direction",
          "scene.yaml:13:11: triangle 1 of the cloth has no area: its corners are [0, 0, 0], [1, "
          "0, "
          "0] and [2, 0, 0] m; remove it from the mesh",
          "scene.yaml:19:13: motion cloth needs a curtain or a mesh",
          "scene.yaml:23:15: reaction yield needs motion cloth: only cloth yields to the hull",
          "scene.yaml:24:12: cloth has no effect without motion cloth",
          "scene.yaml:29:15: reaction bounce needs motion dynamic: only a rigid object bounces",
          "scene.yaml:30:13: first_contact needs a rigid object: a cloth has no single pose"));
}

TEST_F(SceneFile, ClothHasAtMost64Pins) {
  std::string pins;
  for (int i = 0; i < 65; ++i) pins += "        - {from_m: [-1, -1, -1], to_m: [1, 1, 1]}\n";
  EXPECT_THAT(problems("name: s\nobjects:\n  - name: a\n    curtain: {width_m: 1, height_m: 1, "
                       "columns: 2, rows: 2}\n    position_m: [0, 0, 1]\n    motion: cloth\n"
                       "    cloth:\n      pins:\n" +
                       pins),
              ElementsAre("scene.yaml:9:9: pins has 65 boxes, at most 64 are possible: one box may "
                          "hold many vertices"));
}

TEST_F(SceneFile, RotatesAboutXThenYThenZ) {
  const Scene scene = load(test::kGoodScene + "    rotation_deg: [90, 90, 0]\n");
  // The rotation about x maps z to -y; the one about y keeps -y.
  EXPECT_TRUE((scene.objects[0].world_from_object.linear() * Eigen::Vector3d(0, 0, 1))
                  .isApprox(Eigen::Vector3d(0, -1, 0), 1e-12));
  // The rotation about x keeps x; the one about y maps x to -z.
  EXPECT_TRUE((scene.objects[0].world_from_object.linear() * Eigen::Vector3d(1, 0, 0))
                  .isApprox(Eigen::Vector3d(0, 0, -1), 1e-12));
}

TEST_F(SceneFile, MeshesAreScaledToMetres) {
  write("part.obj", kTetrahedronObj);
  write("part.ply", kTetrahedronPly);
  write("part.stl", kTriangleStl);
  for (const auto& [unit, unit_m] :
       {std::pair{"m", 1.0}, {"cm", 0.01}, {"mm", 0.001}, {"in", 0.0254}})
    for (const std::string file : {"part.obj", "part.ply"}) {
      const geometry::Mesh mesh =
          mesh_of(load(mesh_scene("file: " + file + ", unit: " + unit)).objects[0]);
      EXPECT_EQ(mesh.vertices_m.size(), 4u) << "triangles share corners";
      EXPECT_EQ(mesh.triangles.size(), 4u);
      EXPECT_TRUE(geometry::bounds_m(mesh).max().isApprox(Eigen::Vector3d::Constant(unit_m), 1e-9))
          << file << ' ' << unit;
      EXPECT_TRUE(geometry::bounds_m(mesh).min().isZero());
    }
  EXPECT_EQ(mesh_of(load(mesh_scene("file: part.stl, unit: mm")).objects[0]).triangles.size(), 1u);
}

TEST_F(SceneFile, GltfIsInMetresWithItsYAxisUp) {
  write("part.gltf", triangle_gltf(3));
  const geometry::Mesh mesh = mesh_of(load(mesh_scene("file: part.gltf")).objects[0]);
  ASSERT_EQ(mesh.triangles.size(), 1u);
  EXPECT_TRUE(geometry::bounds_m(mesh).max().isApprox(Eigen::Vector3d(1, 0, 2)))
      << "y (2 m) becomes z";
  EXPECT_TRUE(geometry::bounds_m(mesh).min().isApprox(Eigen::Vector3d(0, -3, 0)))
      << "z (3 m) becomes -y";
}

TEST_F(SceneFile, MeshWindingIsPreserved) {
  write("part.obj", kTetrahedronObj);
  const geometry::Mesh mesh = mesh_of(load(mesh_scene("file: part.obj, unit: m")).objects[0]);
  double volume_m3 = 0;  // by the divergence theorem: positive if the surface faces outwards
  for (const auto& [a, b, c] : mesh.triangles)
    volume_m3 += mesh.vertices_m[a].dot(mesh.vertices_m[b].cross(mesh.vertices_m[c])) / 6;
  EXPECT_NEAR(volume_m3, 1.0 / 6, 1e-12);
}

TEST_F(SceneFile, WarnsOfImplausibleMeshSizes) {
  write("part.obj", "v 0 0 0\nv 120 0 0\nv 0 80 0\nv 0 0 60\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  EXPECT_TRUE(mesh_warnings(load(mesh_scene("file: part.obj, unit: mm"))).empty()) << "12 cm";
  EXPECT_EQ(mesh_warnings(load(mesh_scene("file: part.obj, unit: m"))),
            std::vector<std::string>{"object part is 12000 x 8000 x 6000 cm: check the unit of " +
                                     (folder() / "part.obj").string()});
  // Of a small part the unit is only suspicious beside the volume of the rig.
  write("part.obj", "v 0 0 0\nv 12 0 0\nv 0 8 0\nv 0 0 6\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const Eigen::AlignedBox3d table_m(Eigen::Vector3d(-1, -1, 0), Eigen::Vector3d(1, 1, 1)),
      hall_m(Eigen::Vector3d(-5, -5, 0), Eigen::Vector3d(5, 5, 3));
  const Scene twelve_m = load(mesh_scene("file: part.obj, unit: m"));
  EXPECT_TRUE(mesh_warnings(twelve_m).empty());
  EXPECT_TRUE(mesh_warnings(twelve_m, hall_m).empty());
  EXPECT_EQ(mesh_warnings(twelve_m, table_m).size(), 1u);
  write("part.obj",
        "v 0 0 0\nv 0.12 0 0\nv 0 0.08 0\nv 0 0 0.06\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  EXPECT_EQ(mesh_warnings(load(mesh_scene("file: part.obj, unit: mm"))).size(), 1u) << "0.12 mm";
}

TEST_F(SceneFile, MeshesInContactNeedTheirOutside) {
  const auto scene = [](const std::string& reaction) {
    return mesh_scene("file: part.obj, unit: m") +
           "    motion: dynamic\n    reaction: " + reaction + "\n";
  };
  write("part.obj", kTetrahedronObj);
  EXPECT_TRUE(mesh_warnings(load(scene("contact"))).empty());
  write("part.obj", kTetrahedronVertices + "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n");
  EXPECT_THAT(
      problems(scene("contact")),
      ElementsAre("scene.yaml:5:11: the mesh is inside out, and reaction contact needs its "
                  "outside: flip its triangles, so that each is counter-clockwise seen from "
                  "outside"));
  EXPECT_THAT(problems(scene("none")), ElementsAre());
  write("part.obj", kTetrahedronVertices + "f 1 2 4\nf 1 4 3\nf 2 3 4\n");
  EXPECT_THAT(
      mesh_warnings(load(scene("contact"))),
      ElementsAre("object part: mesh " + (folder() / "part.obj").string() +
                  " is not closed (3 open edges); reaction contact treats the counter-clockwise "
                  "side of each triangle as outside: close the mesh"));
  EXPECT_TRUE(mesh_warnings(load(scene("none"))).empty());
  // A tilted sheet of two sides has no inside.
  for (const std::string faces :
       {"f 1 2 3\nf 1 3 2\n", "f 1 3 2\nf 1 2 3\n", "f 2 1 3\nf 3 1 2\n"}) {
    write("part.obj", "v 0.1 0.7 0.3\nv 1.3 0.2 0.9\nv 0.4 1.1 0.77\n" + faces);
    EXPECT_THAT(problems(scene("contact")), ElementsAre());
  }
}

const std::string kRequests = R"(
name: requests
history: {cell_m: 0.01, window_frames: 12}
objects:
  - name: plate
    box: {size_m: [0.4, 0.4, 0.01], cell_m: 0.1}
    position_m: [0, 0, 0]
    warmth: {cap_m: 0.2, cooling_s: 9, colour_rgb: [1, 0, 0]}
    report:
      triangles: true
      response: {search: outward, apex_angle_deg: 60, height_m: 0.1, v_rec: [0, 0, 2],
                 four_point_normal: true, local_minimum_translation: true}
      contacts: 6
      proximity: {of: triangles, cap_m: 0.3, tolerance_m: 0.001}
      first_contact: true
)";

TEST_F(SceneFile, ReadsCollisionRequests) {
  const Scene scene = load(kRequests);
  ASSERT_TRUE(scene.history);
  EXPECT_EQ(scene.history->cell_m, 0.01);
  EXPECT_EQ(scene.history->window_frames, 12);
  const SceneObject& plate = scene.objects.at(0);
  EXPECT_EQ(mesh_of(plate).triangles.size(), 2u * 2 * (16 + 4 + 4));
  ASSERT_TRUE(plate.warming);
  EXPECT_EQ(plate.warming->cap_m, 0.2);
  EXPECT_EQ(plate.warming->cooling_s, 9);
  EXPECT_EQ(plate.warming->colour_rgb, (std::array<double, 3>{1, 0, 0}));
  const CollisionRequests& requests = plate.requests;
  EXPECT_TRUE(requests.triangles && requests.first_contact);
  EXPECT_EQ(requests.contacts, 6);
  ASSERT_TRUE(requests.response && requests.proximity);
  EXPECT_EQ(requests.response->search, RecoverySearch::outward);
  EXPECT_NEAR(requests.response->apex_angle_rad, 1.0471975512, 1e-9);
  EXPECT_EQ(requests.response->height_m, 0.1);
  EXPECT_EQ(requests.response->v_rec_world, Eigen::Vector3d(0, 0, 2));
  EXPECT_TRUE(requests.response->four_points && requests.response->local_minimum_translation);
  EXPECT_FALSE(requests.response->closed_form);
  EXPECT_EQ(requests.proximity->of, ProximityOf::triangles);
  EXPECT_EQ(requests.proximity->cap_m, 0.3);
  EXPECT_EQ(requests.proximity->tolerance_m, 0.001);
}

TEST_F(SceneFile, RequestsNothingByDefault) {
  const Scene scene = load(test::kGoodScene);
  EXPECT_FALSE(scene.history || scene.objects[0].warming || scene.objects[0].requests.any());
}

TEST_F(SceneFile, RejectsInvalidRequests) {
  const auto problems_with = [&](const std::string& what, const std::string& instead) {
    std::string text = kRequests;
    text.replace(text.find(what), what.size(), instead);
    return problems(text);
  };
  EXPECT_THAT(
      problems_with("    report:", "    reaction: none\n    report:"),
      ElementsAre(
          "scene.yaml:10:7: report has no effect with reaction none: the object is not queried"));
  EXPECT_THAT(
      problems_with("history: {cell_m: 0.01, window_frames: 12}\n", ""),
      ElementsAre(
          "scene.yaml:8:7: first_contact compares two frames: add `history: {}` to the scene"));
  EXPECT_THAT(problems_with("v_rec: [0, 0, 2]", "v_rec: [0, 0, 0]"),
              ElementsAre("scene.yaml:10:77: v_rec must not be zero: it is a direction"));
  EXPECT_THAT(problems_with("tolerance_m: 0.001", "tolerance_m: 0.5"),
              ElementsAre("scene.yaml:13:59: tolerance_m must be at most cap_m (0.3), is 0.5"));
  EXPECT_THAT(
      problems_with("cell_m: 0.1}", "cell_m: 0.0001}"),
      ElementsAre(
          "scene.yaml:5:45: cell_m splits the box's faces into more than 1e6 cells: increase it"));
  EXPECT_THAT(problems_with("tolerance_m: 0.001", "tolerance_m: 0.0001"),
              ElementsAre("scene.yaml:13:59: tolerance_m must be at least cap_m / 1000 (0.0003), "
                          "is 0.0001: a smaller one makes a query take seconds"));
  EXPECT_THAT(problems_with("name: plate", "name: " + std::string(65, 'a')),
              ElementsAre("scene.yaml:4:11: name has 65 characters, the limit is 64"));
  EXPECT_EQ(problems_with("contacts: 6", "contacts: -1").size(), 1u);
  EXPECT_EQ(
      problems_with("local_minimum_translation: true", "local_minimum_translatoin: true").size(),
      1u);
}

// A mesh file may name further files. Reading a pipe would wait for its writer for ever.
TEST_F(SceneFile, RejectsPipesAsMeshesAndAsTheirParts) {
  for (const char* name : {"pipe.obj", "pipe.mtl", "pipe.bin"})
    ASSERT_EQ(mkfifo((folder() / name).c_str(), 0600), 0);
  const auto problem = [&](const std::string& mesh) { return problems(mesh_scene(mesh)); };
  EXPECT_TRUE(test::contains(problem("file: pipe.obj, unit: m"), "is a pipe, not a file"));
  // Materials are not needed.
  write("material.obj", "mtllib pipe.mtl\n" + std::string(kTetrahedronObj));
  EXPECT_TRUE(problem("file: material.obj, unit: m").empty());
  std::string gltf = triangle_gltf(0);
  const std::size_t uri = gltf.find("data:"), end = gltf.find('"', uri);
  ASSERT_NE(uri, std::string::npos);
  write("buffer.gltf", gltf.replace(uri, end - uri, "pipe.bin"));
  EXPECT_TRUE(test::contains(problem("file: buffer.gltf"), "cannot read the mesh"));
}

// On such files, Assimp 5.2 crashes or never ends; which of both depends on its memory.
TEST_F(SceneFile, DamagedMeshesAreProblems) {
  const std::size_t vertices = kTetrahedronPly.find("end_header\n") + 11;
  write("comment.ply", "ply\nformat ascii 1.0\ncomment made");
  write("vertices.ply", kTetrahedronPly.substr(0, vertices + 9));
  std::string other_format = kTetrahedronPly;
  write("binary.ply", other_format.replace(other_format.find("ascii"), 5, "binary_little_endian"));
  for (const std::string name : {"comment.ply", "vertices.ply", "binary.ply"})
    EXPECT_TRUE(test::contains(problems(mesh_scene("file: " + name + ", unit: m")),
                               "scene.yaml:5:18: mesh " + (folder() / name).string() + ": "))
        << name;
}

TEST_F(SceneFile, RejectsFacesWithoutTheirVertices) {
  std::string text = kTetrahedronPly;
  write("face.ply", text.replace(text.rfind("3 1 2 3"), 7, "3 1 2 9"));
  EXPECT_TRUE(test::contains(problems(mesh_scene("file: face.ply, unit: m")),
                             "a face of the mesh refers to a vertex that does not exist"));
}

// The content of a file does not choose the importer.
TEST_F(SceneFile, RejectsMeshesWhoseContentIsOfAnotherFormat) {
  write("ply.gltf", kTetrahedronPly);
  EXPECT_TRUE(test::contains(problems(mesh_scene("file: ply.gltf")), "cannot read the mesh"));
}

TEST_F(SceneFile, RejectsUnusableMeshes) {
  write("part.obj", kTetrahedronObj);
  write("points.obj", "v 0 0 0\nv 1 0 0\n");
  write("junk.stl", "this is no mesh");
  write("empty.ply", "");
  write("nan.gltf", triangle_gltf(std::numeric_limits<float>::quiet_NaN()));
  write("nan.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
        "float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 "
        "nan\n0 1 0\n3 0 1 2\n");
  write("part.iges", kTetrahedronObj);
  std::filesystem::create_directory(folder() / "folder.obj");
  const auto problem = [&](const std::string& mesh) { return problems(mesh_scene(mesh)); };
  EXPECT_THAT(
      problem("file: part.obj"),
      ElementsAre("scene.yaml:5:11: unit is missing in mesh: set it to one of m, cm, mm, in"));
  EXPECT_TRUE(test::contains(problem("file: part.obj, unit: parsec"),
                             "scene.yaml:5:34: unit must be one of m, cm, mm, in; is \"parsec\""));
  EXPECT_TRUE(test::contains(
      problem("file: absent.obj, unit: m"),
      "scene.yaml:5:18: mesh " + (folder() / "absent.obj").string() + ": there is no such file"));
  EXPECT_TRUE(test::contains(problem("file: folder.obj, unit: m"), "is a directory"));
  EXPECT_EQ(problem("file: points.obj, unit: m").size(), 1u);
  EXPECT_EQ(problem("file: junk.stl, unit: m").size(), 1u);
  EXPECT_EQ(problem("file: empty.ply, unit: m").size(), 1u);
  EXPECT_TRUE(test::contains(problem("file: nan.gltf"), "vertex 2 of the mesh is not finite"));
  EXPECT_TRUE(
      test::contains(problem("file: nan.ply, unit: m"), "vertex 1 of the mesh is not finite"));
  EXPECT_TRUE(
      test::contains(problem("file: part.iges, unit: mm"),
                     "the file name must end in .gltf, .glb, .obj, .stl, .ply, .step or .stp"));
}

TEST_F(SceneFile, ReportsEveryProblemWithItsLocation) {
  EXPECT_THAT(
      problems(R"(
name: bad
gravity_m_s2: -1
light_m: [0, 0, .inf]
background_rgb: [0, 0, 255]
objects:
  - name: a
    box: {size_cm: [10, 20, 30]}
    position: [0, 0, 0]
  - name: b
    sphere: {radius_m: 0, subdivisions: 9}
    position_m: [0, 0]
    motion: floating
    colur_rgb: [1, 1, 1]
  - name: b
    position_m: [0, 0, 0]
  - name: c
    box: {size_m: [1, 1, 1]}
    sphere: {radius_m: 1}
    position_m: [0, 0, 0]
  - name: d
    curtain: {width_m: 1, height_m: 1, columns: 0, rows: 2.5}
    position_m: [0, 0, 0]
    motion: dynamic
  - name: e
    box: {size_m: [1, 0, 1]}
    position_m: [0, 0, 0]
    reaction: bounce
    mass_kg: 2
    pattern_size_m: 0.1
  - name: f
    box: {size_m: [1, 1, 1]}
    position_m: [0, 0, 0]
    reaction: contact
    friction: 1
    velocity_m_s: [0, 0, 1]
)"),
      ElementsAre("scene.yaml:2:15: gravity_m_s2 must be from 0 to 1000, is -1",
                  "scene.yaml:3:17: light_m[2] must be finite, is .inf",
                  "scene.yaml:4:24: background_rgb[2] must be from 0 to 1, is 255",
                  "scene.yaml:7:11: unknown key size_cm: use size_m",
                  "scene.yaml:8:5: unknown key position: use position_m",
                  "scene.yaml:10:24: radius_m must be greater than 0 and at most 10000, is 0",
                  "scene.yaml:10:41: subdivisions must be from 0 to 6, is 9",
                  "scene.yaml:11:17: position_m must be a list of 3, is a list of 2",
                  "scene.yaml:12:13: motion must be one of fixed, dynamic, cloth; is \"floating\"",
                  "scene.yaml:13:5: unknown key colur_rgb: did you mean colour_rgb?",
                  "scene.yaml:14:5: the object has no shape: set box, sphere, curtain or mesh",
                  "scene.yaml:14:11: object name b is already used in line 9",
                  "scene.yaml:18:13: box and sphere are both set: an object has one shape",
                  "scene.yaml:21:49: columns must be from 1 to 1000, is 0",
                  "scene.yaml:21:58: rows must be a whole number, is 2.5",
                  "scene.yaml:23:13: motion dynamic is for rigid objects: a curtain moves with "
                  "motion cloth",
                  "scene.yaml:25:23: size_m[1] must be greater than 0 and at most 10000, is 0",
                  "scene.yaml:27:15: reaction bounce needs motion dynamic: only a rigid object "
                  "bounces",
                  "scene.yaml:28:14: mass_kg has no effect without motion dynamic",
                  "scene.yaml:29:21: pattern_size_m has no effect on a plain object",
                  "scene.yaml:33:15: reaction contact needs motion dynamic: nothing else moves as "
                  "a rigid body",
                  "scene.yaml:34:15: friction has no effect without motion dynamic",
                  "scene.yaml:35:19: velocity_m_s has no effect without motion dynamic"));
}

TEST(KeySuggestion, SuggestsUnitsAndSpelling) {
  const std::vector<std::string> known = {"size_m", "frame_rate_hz", "horizontal_fov_deg",
                                          "gives_shape"};
  EXPECT_EQ(suggest_key("size_cm", known)->key, "size_m");
  EXPECT_TRUE(suggest_key("size_cm", known)->unit_differs);
  EXPECT_EQ(suggest_key("size", known)->key, "size_m");
  EXPECT_EQ(suggest_key("frame_rate_fps", known)->key, "frame_rate_hz");
  EXPECT_EQ(suggest_key("horizontal_fov_rad", known)->key, "horizontal_fov_deg");
  EXPECT_EQ(suggest_key("give_shape", known)->key, "gives_shape");
  EXPECT_FALSE(suggest_key("give_shape", known)->unit_differs);
  EXPECT_FALSE(suggest_key("pattern", known));
  EXPECT_FALSE(suggest_key("x", {}));
}

}  // namespace
}  // namespace fivepipe::config
