// The triangles of marching cubes (Lorensen and Cline, 1987), as a table by the inside corners of a
// cube. It is computed from the loops in which a surface crosses the cube's faces.
//
//      2 ---- 3      On a face with two inside corners at opposite ends of a diagonal, each is cut
//     /|     /|      off by itself. Both cubes at a face follow this rule, so the surfaces of all
//    6 ---- 7 |      cubes form a closed one (Montani, Scateni and Scopigno, 1994). No triangle has
//    | 0 ---| 1      an edge between vertices of one face that the surface does not cross there:
//    the
//    |/     |/       cube beyond could have it, too, and four triangles would share it. A loop that
//    4 ---- 5        would need such an edge gets a vertex in its middle.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

namespace fivepipe::surface {

inline constexpr int kCubeEdges = 12;
// Edge i of a cube begins at this corner and is parallel to axis i / 4.
inline constexpr std::array<int, kCubeEdges> kEdgeCorner = {0, 2, 4, 6, 0, 1, 4, 5, 0, 1, 2, 3};
inline constexpr int kMaxLoops = 4;
constexpr int edge_axis(int edge) { return edge / 4; }

struct CubeSurface {
  // A closed sequence of crossed edges, counter-clockwise as seen from outside.
  struct Loop {
    std::vector<int> edges;
    bool has_middle;  // whether the triangles have a vertex in the loop's middle
  };
  std::vector<Loop> loops;  // at most kMaxLoops
  // A corner below kCubeEdges is the vertex on that edge; kCubeEdges + i is the middle of loop i.
  std::vector<std::array<int, 3>> triangles;
};

// inside: bit i is set if corner i is inside. The reference is valid until the program ends.
const CubeSurface& cube_surface(unsigned inside);

}  // namespace fivepipe::surface
