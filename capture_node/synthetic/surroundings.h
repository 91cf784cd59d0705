// The synthetic cameras' room: a table with printed patterns, floor, walls and ceiling, lit by one
// lamp and ambient light.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>

namespace fivepipe::capture {

// Position and size of the lamp, and the weights of ambient and direct light. At brightness 1 a
// surface shows its own colour.
namespace lamp {
inline const Eigen::Vector3f kPosition_world_m(0.5f, -0.35f, 1.9f);
inline constexpr float kRadius_m = 0.05f;
inline constexpr float kAmbient = 0.62f, kDirect = 0.40f;
}  // namespace lamp

// Returns the brightness of a surface point; `visibility` is the visible fraction of the lamp, 0
// to 1.
float brightness(const Eigen::Vector3f& p_world_m, const Eigen::Vector3f& normal_world,
                 float visibility);

inline constexpr float kTableTop_z_m = 0.0f, kFloor_z_m = -0.75f;

enum class Surface : std::uint8_t { other, table_top, floor };

class Surroundings {
 public:
  explicit Surroundings(std::uint64_t seed);

  struct RayHit {
    Surface surface;
    Eigen::Vector3f bgr;  // grey levels of 255, lamp fully visible
  };
  // Returns the first surface that the ray hits. The direction need not be normalised.
  RayHit trace_ray(const Eigen::Vector3f& origin_world_m,
                   const Eigen::Vector3f& direction_world) const;

 private:
  cv::Mat table_, floor_;
  std::array<cv::Mat, 4> walls_;
};

}  // namespace fivepipe::capture
