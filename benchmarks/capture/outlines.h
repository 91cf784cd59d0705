// Outlines that a person has drawn around the object in images of real footage.
#pragma once
#include <filesystem>
#include <vector>

#include "common/hull/object_pixels.h"

namespace fivepipe::capture_bench {

// One image of a camera of a rig.
struct Outline {
  std::string camera;
  int frame;
  // Vertices (u, v) [px] of closed rings. A pixel whose centre is inside an odd number of them
  // shows the object.
  struct Vertex {
    double u_px, v_px;
  };
  std::vector<std::vector<Vertex>> rings;
};

// Reads FOLDER/CAMERA/FRAME.txt: a vertex per line, an empty line between rings; # begins a
// comment. Sorted by camera and frame. Throws std::runtime_error if the folder cannot be read, or a
// line is no vertex.
std::vector<Outline> read_outlines(const std::filesystem::path& folder);

hull::ObjectPixels pixels_inside(const Outline& outline, int width_px, int height_px);

}  // namespace fivepipe::capture_bench
