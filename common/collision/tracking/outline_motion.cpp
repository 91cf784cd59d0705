#include "common/collision/tracking/outline_motion.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/collision/tracking/rotation.h"

namespace fivepipe::collision {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

// Smallest baseline between two cameras as a fraction of the object's distance, and smallest sine
// of the angle between a ray and the baseline. Below them, calibration errors dominate the planes.
constexpr double kMinSine = 0.15;
// Largest distance of a common tangent point from the centroid [RMS size]. Rays that meet farther
// away do not touch the same point.
constexpr double kMaxTangentDistance_sizes = 3;
// Minimum number of tangencies for the six unknowns. One camera, or two cameras at two times, have
// fewer.
constexpr int kMinTangencies = 24;
// The tangent points change from step to step. After kFullSteps the fit takes half steps to prevent
// oscillation.
constexpr int kMaxSteps = 12, kFullSteps = 4;
// The fit has converged if a step rotates [rad] and moves [RMS size] less than this over the
// window: about a tenth of a pixel for an object of 10 cm.
constexpr double kConvergence_rad = 2e-3;
// Trial rotation that tests whether the shape determines an axis [rad]. It moves points
// kMinLeverArm from the axis by more than a pixel.
constexpr double kTrialRotation_rad = 0.2;
// Smallest lever arm of the tangent points about a determined axis [RMS size], from how far the
// trial rotation separates the planes. With noise, a pipe reaches at most 0.07, a hand at least
// 0.27.
constexpr double kMinLeverArm = 0.15;
// If the motion changes by more than this over the window [rad; RMS size], the axes are tested
// again, at most kMaxAxisUpdates times.
constexpr double kMaxAxisDrift_rad = 0.1;
constexpr int kMaxAxisUpdates = 3;
// A motion must reduce the residual at rest by this factor: by moving the object further than about
// a third of a pixel over the window. Else an object at rest with few tangent points gets a motion
// that grows from fit to fit.
constexpr double kBetterThanRest = 0.95;
// Limits on pairs of outlines per step, for the final fit and for trials. They bound the time of a
// fit for any window and number of cameras. Above the limit, evenly spaced times are dropped, but
// each remaining one keeps kMinCameraPairs pairs of cameras: fewer double the rotation's error.
constexpr std::size_t kMaxPairs = 1024, kMaxTrialPairs = 256, kMinCameraPairs = 64;

// Orthonormal axes: along the baseline (axis), towards the object (across), and up.
struct Frame {
  Vector3d across, up, axis;
};

// The ray at which a plane through the baseline is tangent to an outline, as (across, up, axis)
// with across = 1.
using EpipolarTangency = Vector3d;

// Returns the two outermost tangencies, or nullopt if a ray is too close to the baseline.
std::optional<std::array<EpipolarTangency, 2>> epipolar_tangencies(const ComponentOutline& outline,
                                                                   const Frame& frame) {
  double min_slope = std::numeric_limits<double>::infinity(), max_slope = -min_slope;
  const Vector3d *min_ray = nullptr, *max_ray = nullptr;
  for (const Vector3d& ray : outline.corners_world) {
    const double across = ray.dot(frame.across);
    if (!(across > 0)) return std::nullopt;
    const double slope = ray.dot(frame.up) / across;
    if (slope < min_slope) min_slope = slope, min_ray = &ray;
    if (slope > max_slope) max_slope = slope, max_ray = &ray;
  }
  if (!min_ray || !max_ray) return std::nullopt;
  const std::array<EpipolarTangency, 2> ends{
      EpipolarTangency(1, min_slope, min_ray->dot(frame.axis) / min_ray->dot(frame.across)),
      EpipolarTangency(1, max_slope, max_ray->dot(frame.axis) / max_ray->dot(frame.across))};
  for (const EpipolarTangency& t : ends)
    if (!(t.head<2>().squaredNorm() > kMinSine * kMinSine * t.squaredNorm())) return std::nullopt;
  return ends;
}

// Solves matrix x = right. The matrix is symmetric.
Vector3d solved(const Matrix3d& matrix, const Vector3d& right) {
  return matrix.ldlt().solve(right);
}

// Normal equations. Unknowns: velocity [m/s], then angular velocity [rad/s] at the centre of the
// window.
struct Equations {
  Matrix6d matrix = Matrix6d::Zero();
  Vector6d right = Vector6d::Zero();
  double squares_m2 = 0, seconds2 = 0;  // sums of squared residuals and time differences
  int count = 0;

  double mean_square_m2() const { return squares_m2 / count; }
  Matrix3d by_velocity() const { return matrix.topLeftCorner<3, 3>(); }
  // Returns the change of velocity that fits a change of angular velocity best.
  Vector3d velocity_with(const Vector3d& turn_rad_s) const {
    return solved(by_velocity(), -matrix.topRightCorner<3, 3>() * turn_rad_s);
  }
  // Squared lever arms of the tangencies about axes through the centroid, after elimination of the
  // velocity (Schur complement).
  Matrix3d levers_m2() const {
    const Matrix3d mixed = matrix.topRightCorner<3, 3>();
    return (matrix.bottomRightCorner<3, 3>() -
            mixed.transpose() * by_velocity().ldlt().solve(mixed)) /
           seconds2;
  }
};

class Fit {
 public:
  Fit(const std::deque<OutlineSnapshot>& frames, double size_m) : frames_(frames), size_m_(size_m) {
    for (const OutlineSnapshot& f : frames)
      center_s_ += f.time_s / double(frames.size()),
          center_world_m_ += f.centroid_world_m / double(frames.size());
    for (const OutlineSnapshot& f : frames)
      max_cameras_ = std::max(max_cameras_, f.outlines.size());
  }
  double size_m() const { return size_m_; }
  double window_s() const { return frames_.back().time_s - frames_.front().time_s; }

  // more_rad_s: extra angular velocity about an axis that moves with the object.
  Equations equations(const UniformMotion& motion, std::size_t max_pairs,
                      const Vector3d& more_rad_s = Vector3d::Zero()) const {
    Equations e;
    const std::size_t half_window = frames_.size() / 2, count = frames_.size() - half_window,
                      cameras2 = max_cameras_ * max_cameras_;
    const std::size_t times =
        std::min(count, max_pairs / std::clamp<std::size_t>(cameras2, 1, kMinCameraPairs));
    const std::size_t every =
        std::max<std::size_t>(1, (times * cameras2 + max_pairs - 1) / max_pairs);
    for (std::size_t k = 0; k < times; ++k) {
      const std::size_t i = (2 * k + 1) * count / (2 * times);
      add_times(frames_[i], frames_[i + half_window], {every, k, max_cameras_}, motion, more_rad_s,
                e);
    }
    return e;
  }

 private:
  // Selects one in `every` pairs of cameras.
  struct Chosen {
    std::size_t every, first, cameras;
    bool has(std::size_t a, std::size_t b) const {
      return (a * (cameras + 1) + b + first) % every == 0;
    }
  };

  // The motion between two times. Times are relative to the window's centre.
  struct Between {
    double before_s, after_s, seconds;
    Matrix3d turned;    // rotation since the window's centre
    Matrix3d turn;      // rotation from before to after
    Vector3d from, to;  // the object's centre before and after
  };

  void add_times(const OutlineSnapshot& before, const OutlineSnapshot& after, const Chosen& chosen,
                 const UniformMotion& motion, const Vector3d& more_rad_s, Equations& e) const {
    const double seconds = after.time_s - before.time_s, before_s = before.time_s - center_s_,
                 after_s = after.time_s - center_s_;
    const Matrix3d turned = rotation(after_s * motion.angular_velocity_world_rad_s);
    const Matrix3d turn = rotation(seconds * turned * more_rad_s) *
                          rotation(seconds * motion.angular_velocity_world_rad_s);
    const Vector3d from = center_world_m_ + before_s * motion.velocity_world_m_s,
                   to = center_world_m_ + after_s * motion.velocity_world_m_s;
    const Between between{before_s, after_s, seconds, turned, turn, from, to};
    for (std::size_t a = 0; a < before.outlines.size(); ++a)
      for (std::size_t b = 0; b < after.outlines.size(); ++b)
        if (chosen.has(a, b)) add_cameras(before.outlines[a], after.outlines[b], between, e);
  }

  // Adds the two outermost epipolar tangencies of a pair of outlines, unless its geometry is
  // degenerate.
  void add_cameras(const ComponentOutline& a, const ComponentOutline& b, const Between& between,
                   Equations& e) const {
    const Matrix3d& turn = between.turn;
    const Vector3d eye = turn * (a.eye_world_m - between.from) + between.to,
                   baseline = b.eye_world_m - eye, to_object = between.to - eye;
    const double baseline_m = baseline.norm();
    if (!(baseline_m > kMinSine * to_object.norm())) return;
    Frame frame{Vector3d::Zero(), Vector3d::Zero(), baseline / baseline_m};
    const Vector3d perpendicular = to_object - to_object.dot(frame.axis) * frame.axis;
    const double perpendicular_m = perpendicular.norm();
    if (!(perpendicular_m > size_m_)) return;
    frame.across = perpendicular / perpendicular_m, frame.up = frame.axis.cross(frame.across);
    const auto of_b = epipolar_tangencies(b, frame);
    if (!of_b) return;
    const auto of_a =
        epipolar_tangencies(a, {turn.transpose() * frame.across, turn.transpose() * frame.up,
                                turn.transpose() * frame.axis});
    if (!of_a) return;
    for (std::size_t k = 0; k < 2; ++k) {
      const EpipolarTangency &ray = (*of_a)[k], &other = (*of_b)[k];
      // Distance from the baseline at which the two rays meet, seen along the planes.
      const double across_m = baseline_m / (ray.z() - other.z());
      if (!(std::abs(across_m - perpendicular_m) < kMaxTangentDistance_sizes * size_m_)) continue;
      const double slope = 0.5 * (ray.y() + other.y()), stretch = std::sqrt(1 + slope * slope);
      const Vector3d tangent_point =
          eye - between.to + across_m * (frame.across + slope * frame.up + ray.z() * frame.axis);
      const Vector3d normal = (frame.up - slope * frame.across) / stretch;
      add_row(across_m * (ray.y() - other.y()) / stretch, normal, tangent_point, between, e);
    }
  }

  // tangent_point_m: relative to the object's centre after the motion.
  static void add_row(double residual_m, const Vector3d& normal, const Vector3d& tangent_point_m,
                      const Between& between, Equations& e) {
    const double seconds = between.seconds;
    Vector6d row;
    row << between.after_s * normal - between.before_s * (between.turn.transpose() * normal),
        seconds * (between.turned.transpose() * tangent_point_m.cross(normal));
    e.matrix += row * row.transpose();
    e.right -= residual_m * row;
    e.squares_m2 += residual_m * residual_m;
    e.seconds2 += seconds * seconds;
    ++e.count;
  }

  const std::deque<OutlineSnapshot>& frames_;
  double size_m_;
  std::size_t max_cameras_ = 0;
  double center_s_ = 0;
  Vector3d center_world_m_ = Vector3d::Zero();
};

// Fits the velocity and keeps the angular velocity.
std::optional<UniformMotion> fit_velocity(const Fit& fit, UniformMotion motion) {
  for (int step = 0; step < kMaxSteps; ++step) {
    const Equations e = fit.equations(motion, kMaxTrialPairs);
    if (e.count < kMinTangencies) return std::nullopt;
    const Vector3d velocity_change =
        (step < kFullSteps ? 1 : 0.5) * solved(e.by_velocity(), e.right.head<3>());
    if (!velocity_change.allFinite()) return std::nullopt;
    motion.velocity_world_m_s += velocity_change;
    if (velocity_change.norm() * fit.window_s() < kConvergence_rad * fit.size_m()) break;
  }
  return motion;
}

// Returns the RMS separation of the planes above which the shape determines an axis.
double min_separation_m(const Fit& fit) { return kMinLeverArm * fit.size_m() * kTrialRotation_rad; }

// Returns the rotation axes that the shape determines as columns; the other columns are zero. The
// motion's velocity must fit: if planes are already separated, any rotation separates them further,
// even that of a ball.
std::optional<Matrix3d> determined_axes(const Fit& fit, const UniformMotion& motion) {
  const Equations e = fit.equations(motion, kMaxTrialPairs);
  if (e.count < kMinTangencies) return std::nullopt;
  Matrix3d axes = Eigen::SelfAdjointEigenSolver<Matrix3d>(e.levers_m2()).eigenvectors();
  int determined = 0;
  for (int k = 0; k < 3; ++k) {
    double separation_m2 = 0;
    for (const double sign : {-1.0, 1.0}) {
      const Vector3d more =
          sign * kTrialRotation_rad / std::sqrt(e.seconds2 / e.count) * axes.col(k);
      const UniformMotion tried{motion.velocity_world_m_s + e.velocity_with(more),
                                motion.angular_velocity_world_rad_s};
      separation_m2 +=
          0.5 * (fit.equations(tried, kMaxTrialPairs, more).mean_square_m2() - e.mean_square_m2());
    }
    if (separation_m2 > min_separation_m(fit) * min_separation_m(fit))
      ++determined;
    else
      axes.col(k).setZero();
  }
  // A shape that is symmetric about two axes is symmetric about the third.
  if (determined == 1) axes.setZero();
  return axes;
}

// Fits velocity and the angular velocity about the given axes, starting from `guess`.
std::optional<OutlineMotion> fitted(const Fit& fit, const UniformMotion& guess,
                                    const Matrix3d& axes, std::size_t max_pairs) {
  const Matrix3d determined = axes * axes.transpose(),
                 undetermined = Matrix3d::Identity() - determined;
  OutlineMotion found{guess, int(std::lround(determined.trace()))};
  bool converged = false;
  for (int step = 0; step <= kMaxSteps; ++step) {
    const Equations e = fit.equations(found.motion, max_pairs);
    if (e.count < kMinTangencies) return std::nullopt;
    found.residual_m = std::sqrt(e.mean_square_m2());
    if (converged) return found;
    const Vector3d velocity_only = solved(e.by_velocity(), e.right.head<3>());
    const Vector3d right = e.right.tail<3>() - e.matrix.bottomLeftCorner<3, 3>() * velocity_only;
    // Undetermined axes: the equation is replaced by "no rotation".
    const double scale = fit.size_m() * fit.size_m() * e.seconds2;
    const Matrix3d matrix =
        e.seconds2 * determined * e.levers_m2() * determined + scale * undetermined;
    const double fraction = step < kFullSteps ? 1 : 0.5;
    const Vector3d rotation_change =
        fraction *
        solved(matrix, determined * right -
                           scale * undetermined * found.motion.angular_velocity_world_rad_s);
    const Vector3d velocity_change = fraction * velocity_only + e.velocity_with(rotation_change);
    if (!rotation_change.allFinite() || !velocity_change.allFinite()) return std::nullopt;
    found.motion.velocity_world_m_s += velocity_change;
    found.motion.angular_velocity_world_rad_s += rotation_change;
    converged = rotation_change.norm() * fit.window_s() < kConvergence_rad &&
                velocity_change.norm() * fit.window_s() < kConvergence_rad * fit.size_m();
  }
  return std::nullopt;
}

// Returns the fit, or rest if that explains the outlines nearly as well.
OutlineMotion or_rest(const Fit& fit, const OutlineMotion& found) {
  const Equations e = fit.equations(UniformMotion{}, kMaxPairs);
  if (e.count < kMinTangencies) return found;
  const double rest_m = std::sqrt(e.mean_square_m2());
  if (found.residual_m < kBetterThanRest * rest_m) return found;
  return {UniformMotion{}, found.determined_axes, rest_m};
}

bool has_drifted(const Fit& fit, const UniformMotion& a, const UniformMotion& b) {
  const double turned_rad =
      (a.angular_velocity_world_rad_s - b.angular_velocity_world_rad_s).norm() * fit.window_s();
  return !(turned_rad < kMaxAxisDrift_rad &&
           (a.velocity_world_m_s - b.velocity_world_m_s).norm() * fit.window_s() <
               kMaxAxisDrift_rad * fit.size_m());
}

}  // namespace

std::optional<OutlineMotion> outline_motion(const std::deque<OutlineSnapshot>& frames,
                                            const UniformMotion& guess, double size_m) {
  if (frames.size() < 2 || !(size_m > 0)) return std::nullopt;
  const Fit fit(frames, size_m);
  UniformMotion from = guess;
  for (int judged = 0; judged < kMaxAxisUpdates; ++judged) {
    const auto at = fit_velocity(fit, from);
    const auto axes = at ? determined_axes(fit, *at) : std::nullopt;
    const auto about = axes ? fitted(fit, *at, *axes, kMaxTrialPairs) : std::nullopt;
    if (!about) return std::nullopt;
    from = about->motion;
    if (has_drifted(fit, from, *at)) continue;
    const auto found = fitted(fit, from, *axes, kMaxPairs);
    // A residual as large as the axis test's threshold means uneven motion, so that the rotation is
    // unknown.
    const bool uneven =
        found && found->determined_axes > 0 && !(found->residual_m < min_separation_m(fit));
    const auto best = uneven ? fitted(fit, from, Matrix3d::Zero(), kMaxPairs) : found;
    return best ? std::optional(or_rest(fit, *best)) : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace fivepipe::collision
