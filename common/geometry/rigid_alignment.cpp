#include "common/geometry/rigid_alignment.h"

#include <Eigen/SVD>
#include <cmath>
#include <stdexcept>

namespace fivepipe::geometry {
namespace {

// Second singular value of the centered points as a part of the first one: less is a line.
constexpr double kLine = 0.01;

Eigen::Matrix3Xd columns(std::span<const Eigen::Vector3d> points) {
  Eigen::Matrix3Xd columns(3, Eigen::Index(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) columns.col(Eigen::Index(i)) = points[i];
  return columns;
}

bool is_line(const Eigen::Matrix3Xd& points) {
  const Eigen::Matrix3Xd centered = points.colwise() - points.rowwise().mean();
  const Eigen::Vector3d singular =
      Eigen::JacobiSVD<Eigen::Matrix3d>(centered * centered.transpose()).singularValues();
  return !(std::sqrt(singular[1]) > kLine * std::sqrt(singular[0]));
}

}  // namespace

RigidAlignment align_points(std::span<const Eigen::Vector3d> from,
                            std::span<const Eigen::Vector3d> to) {
  if (from.size() != to.size() || from.size() < 3)
    throw std::invalid_argument("an alignment needs three or more pairs of points");
  const Eigen::Matrix3Xd a = columns(from), b = columns(to);
  if (!a.allFinite() || !b.allFinite())
    throw std::invalid_argument("a coordinate of a point is not finite");
  if (is_line(a) || is_line(b))
    throw std::invalid_argument(
        "the points are nearly on a line, so the rotation about it is unknown; touch a point "
        "beside it");
  RigidAlignment found;
  found.to_from = Eigen::Isometry3d(Eigen::umeyama(a, b, false));
  for (Eigen::Index i = 0; i < a.cols(); ++i) {
    found.residuals_m.push_back((found.to_from * Eigen::Vector3d(a.col(i)) - b.col(i)).norm());
    found.rms_m += found.residuals_m.back() * found.residuals_m.back();
  }
  found.rms_m = std::sqrt(found.rms_m / double(a.cols()));
  return found;
}

}  // namespace fivepipe::geometry
