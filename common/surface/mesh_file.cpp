// Formats: PLY (Turk, 1994), OBJ with vertex colours (as MeshLab), binary STL.
#include "common/surface/mesh_file.h"

#include <fmt/format.h>

#include <bit>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "common/surface/byte_buffer.h"
#include "common/surface/glb.h"

namespace fivepipe::surface {
namespace {

using Eigen::Vector3d;

constexpr std::pair<std::string_view, MeshFormat> kFormats[] = {{"ply", MeshFormat::ply},
                                                                {"obj", MeshFormat::obj},
                                                                {"stl", MeshFormat::stl},
                                                                {"glb", MeshFormat::glb}};

std::string ply_of(const MeshFile& content) {
  const geometry::Mesh& mesh = content.mesh;
  const bool has_normals = !mesh.triangles.empty();
  std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment fivepipe: metres, z up\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n",
      mesh.vertices_m.size());
  if (has_normals) header += "property float nx\nproperty float ny\nproperty float nz\n";
  if (!content.colours.empty())
    header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  if (!mesh.triangles.empty())
    header += fmt::format("element face {}\nproperty list uchar int vertex_indices\n",
                          mesh.triangles.size());
  ByteBuffer bytes(header + "end_header\n");
  const std::vector<Vector3d> normals =
      has_normals ? vertex_normals(mesh, content.normal_steps) : std::vector<Vector3d>{};
  for (std::size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    bytes.add_floats(mesh.vertices_m[i]);
    if (has_normals) bytes.add_floats(normals[i]);
    if (!content.colours.empty())
      for (const std::uint8_t value : content.colours[i]) bytes.add(value);
  }
  for (const auto& triangle : mesh.triangles) {
    bytes.add(std::uint8_t{3});
    for (const std::uint32_t vertex : triangle) bytes.add(vertex);
  }
  return std::move(bytes).text();
}

std::string obj_of(const MeshFile& content) {
  fmt::memory_buffer text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "# fivepipe: metres, z up\n");
  for (std::size_t i = 0; i < content.mesh.vertices_m.size(); ++i) {
    const Vector3d& p = content.mesh.vertices_m[i];
    fmt::format_to(out, "v {:.6f} {:.6f} {:.6f}", p.x(), p.y(), p.z());
    if (!content.colours.empty())
      for (const std::uint8_t value : content.colours[i])
        fmt::format_to(out, " {:.4f}", value / 255.0);
    fmt::format_to(out, "\n");
  }
  for (const auto& [a, b, c] : content.mesh.triangles)
    fmt::format_to(out, "f {} {} {}\n", a + 1, b + 1, c + 1);
  if (content.mesh.triangles.empty())
    for (std::size_t i = 1; i <= content.mesh.vertices_m.size(); ++i)
      fmt::format_to(out, "p {}\n", i);
  return fmt::to_string(text);
}

std::string stl_of(const geometry::Mesh& mesh) {
  constexpr std::size_t kHeaderBytes = 80;
  std::string header = "fivepipe: metres, z up";
  header.resize(kHeaderBytes, ' ');
  ByteBuffer bytes(std::move(header));
  bytes.add(std::uint32_t(mesh.triangles.size()));
  for (const auto& [ia, ib, ic] : mesh.triangles) {
    const Vector3d &a = mesh.vertices_m[ia], &b = mesh.vertices_m[ib], &c = mesh.vertices_m[ic];
    bytes.add_floats((b - a).cross(c - a).stableNormalized());
    for (const Vector3d* const corner : {&a, &b, &c}) bytes.add_floats(*corner);
    bytes.add(std::uint16_t{0});
  }
  return std::move(bytes).text();
}

std::string bytes_of(const MeshFile& content, MeshFormat format) {
  switch (format) {
    case MeshFormat::ply: return ply_of(content);
    case MeshFormat::obj: return obj_of(content);
    case MeshFormat::stl: return stl_of(content.mesh);
    case MeshFormat::glb: return glb_of(content);
  }
  return {};
}

}  // namespace

std::optional<MeshFormat> mesh_format_from(std::string_view text) {
  for (const auto& [name, format] : kFormats)
    if (name == text) return format;
  return std::nullopt;
}

std::string extension_of(MeshFormat format) {
  for (const auto& [name, of_name] : kFormats)
    if (of_name == format) return '.' + std::string(name);
  return {};
}

std::vector<Vector3d> vertex_normals(const geometry::Mesh& mesh, int steps) {
  std::vector<Vector3d> normals(mesh.vertices_m.size(), Vector3d::Zero());
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3d twice_area =
        (mesh.vertices_m[b] - mesh.vertices_m[a]).cross(mesh.vertices_m[c] - mesh.vertices_m[a]);
    for (const std::uint32_t vertex : {a, b, c}) normals[vertex] += twice_area;
  }
  const auto normalize = [&] {
    for (Vector3d& normal : normals)
      normal = normal.squaredNorm() > 0 ? normal.stableNormalized() : Vector3d::UnitZ();
  };
  normalize();
  for (int step = 0; step < steps; ++step) {
    const std::vector<Vector3d> before = normals;
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t vertex : triangle)
        for (const std::uint32_t other : triangle) normals[vertex] += before[other];
    normalize();
  }
  return normals;
}

void write_mesh(const std::filesystem::path& file, const MeshFile& content, MeshFormat format) {
  if (!content.colours.empty() && content.colours.size() != content.mesh.vertices_m.size())
    throw std::invalid_argument("mesh file: one colour per vertex is needed");
  if (format == MeshFormat::stl && content.mesh.triangles.empty() &&
      !content.mesh.vertices_m.empty())
    throw std::invalid_argument("mesh file: STL holds no points without triangles");
  std::error_code ignored;  // opening the file reports the failure
  std::filesystem::create_directories(file.parent_path(), ignored);
  std::ofstream out(file, std::ios::binary);
  const std::string bytes = bytes_of(content, format);
  out.write(bytes.data(), std::streamsize(bytes.size()));
  if (!out.flush()) throw std::runtime_error("cannot write " + file.string());
}

}  // namespace fivepipe::surface
