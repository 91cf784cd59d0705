// The room that synthetic cameras stand in: a table with things printed on it, floor, walls; one
// lamp and light from all sides.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>

namespace fivepipe::capture {

// The lamp's place and size, and how its light adds up with what comes from everywhere; a level of
// 1 is a surface's own colour.
namespace lamp {
inline const Eigen::Vector3f kPosition_world_m(0.5f, -0.35f, 1.9f);
inline constexpr float kRadius_m = 0.05f;
inline constexpr float kAmbient = 0.62f, kDirect = 0.40f;
}  // namespace lamp

// Brightness of a surface; visibility of the lamp 0..1.
float brightness(const Eigen::Vector3f& p_world_m, const Eigen::Vector3f& normal_world,
                 float visibility);

inline constexpr float kTableTop_z_m = 0.0f, kFloor_z_m = -0.75f;

enum class Surface : std::uint8_t { other, table_top, floor };

class Surroundings {
 public:
  explicit Surroundings(std::uint64_t seed);

  struct RayHit {
    Surface surface;
    Eigen::Vector3f bgr;  // grey levels, lamp in sight
  };
  // What a ray meets. The direction need not be normalised.
  RayHit trace_ray(const Eigen::Vector3f& origin_world_m,
                   const Eigen::Vector3f& direction_world) const;

 private:
  cv::Mat table_, floor_;
  std::array<cv::Mat, 4> walls_;
};

}  // namespace fivepipe::capture
