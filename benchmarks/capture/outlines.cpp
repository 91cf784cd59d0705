#include "benchmarks/capture/outlines.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <sstream>

namespace fivepipe::capture_bench {
namespace {

namespace fs = std::filesystem;

std::vector<std::vector<Outline::Vertex>> read_rings(const fs::path& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  std::vector<std::vector<Outline::Vertex>> rings;
  bool is_new = true;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (line.find_first_not_of(" \t\r") == std::string::npos) {
      is_new = true;
      continue;
    }
    line = line.substr(0, line.find('#'));
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    std::istringstream text(line);
    Outline::Vertex vertex{};
    std::string rest;
    if (!(text >> vertex.u_px >> vertex.v_px) || text >> rest || !std::isfinite(vertex.u_px) ||
        !std::isfinite(vertex.v_px))
      throw std::runtime_error(
          fmt::format("{}:{}: expected a vertex 'u v', is '{}'", file.string(), number, line));
    if (is_new) rings.emplace_back();
    is_new = false;
    rings.back().push_back(vertex);
  }
  if (rings.empty() ||
      std::any_of(rings.begin(), rings.end(), [](const auto& ring) { return ring.size() < 3; }))
    throw std::runtime_error(file.string() + ": a ring has fewer than three vertices");
  return rings;
}

int frame_of(const fs::path& file) {
  const std::string name = file.stem().string();
  int frame = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), frame);
  if (error != std::errc() || end != name.data() + name.size() || frame < 0)
    throw std::runtime_error(file.string() + ": the name is not the number of a frame");
  return frame;
}

}  // namespace

std::vector<Outline> read_outlines(const fs::path& folder) {
  std::vector<Outline> outlines;
  std::error_code error;
  for (const auto& camera : fs::directory_iterator(folder, error)) {
    if (!camera.is_directory()) continue;
    for (const auto& file : fs::directory_iterator(camera.path()))
      if (file.path().extension() == ".txt")
        outlines.push_back(
            {camera.path().filename().string(), frame_of(file.path()), read_rings(file.path())});
  }
  if (error || outlines.empty())
    throw std::runtime_error(folder.string() + ": there are no outlines in this folder");
  std::sort(outlines.begin(), outlines.end(), [](const Outline& a, const Outline& b) {
    return std::tie(a.camera, a.frame) < std::tie(b.camera, b.frame);
  });
  return outlines;
}

hull::ObjectPixels pixels_inside(const Outline& outline, int width_px, int height_px) {
  hull::ObjectPixels pixels(width_px, height_px);
  for (int v = 0; v < height_px; ++v) {
    std::vector<double> crossings;
    for (const auto& ring : outline.rings)
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const Outline::Vertex &a = ring[i], &b = ring[(i + 1) % ring.size()];
        if ((a.v_px > v) != (b.v_px > v))
          crossings.push_back(a.u_px + (v - a.v_px) / (b.v_px - a.v_px) * (b.u_px - a.u_px));
      }
    std::sort(crossings.begin(), crossings.end());
    for (std::size_t i = 0; i + 1 < crossings.size(); i += 2) {
      const int begin = int(std::clamp(std::ceil(crossings[i]), 0.0, double(width_px))),
                end = int(std::clamp(std::ceil(crossings[i + 1]), 0.0, double(width_px)));
      if (begin < end) pixels.set_run(begin, end, v);
    }
  }
  return pixels;
}

}  // namespace fivepipe::capture_bench
