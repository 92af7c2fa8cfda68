#include "capability_map/shape_fit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace capability_map {

namespace {

constexpr double kSlack = 1e-6;  // [rad] so that the point that sets an opening stays covered in float32

/// The angle that the shape's opening is compared with; rings compare the other way round.
double angleOf(ShapeType type, const Eigen::Vector3d& axis, const Eigen::Vector3d& n) {
  const double angle = std::acos(std::clamp(axis.dot(n), -1.0, 1.0));
  return type == ShapeType::Cone ? angle : std::min(angle, M_PI - angle);
}

Eigen::Vector3d axisOf(const Points& outward, const std::vector<bool>& valid, ShapeType type) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (Eigen::Index k = 0; k < outward.rows(); ++k) {
    if (!valid[static_cast<size_t>(k)]) continue;
    const Eigen::Vector3d n = outward.row(k);
    sum += n;                         // (3.10)
    covariance += n * n.transpose();  // (3.11), up to a factor
  }
  // A sphere that is valid all around has no mean direction: any axis does for a cone that covers all.
  if (type == ShapeType::Cone)
    return sum.norm() > 1e-9 ? Eigen::Vector3d(sum.normalized()) : Eigen::Vector3d::UnitZ();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance);
  return eigen.eigenvectors().col(type == ShapeType::DoubleCone ? 2 : 0);  // (3.12), ascending order
}

struct Sorted {
  double angle;
  bool valid;
};

double errorPercent(int covered_invalid, int missed_valid, int valid) {
  return std::min(100.0, 100.0 * (covered_invalid + missed_valid) / valid);  // (3.8)
}

/// The opening that covers all valid points.
double coverAll(const std::vector<Sorted>& points, ShapeType type) {
  double opening = type == ShapeType::Ring ? M_PI_2 : 0.0;
  for (const Sorted& point : points) {
    if (!point.valid) continue;
    opening = type == ShapeType::Ring ? std::min(opening, point.angle) : std::max(opening, point.angle);
  }
  return type == ShapeType::Ring ? std::max(0.0, opening - kSlack) : opening + kSlack;
}

/// The opening of least error: between neighbouring angles nothing changes, so their middles are all there is
/// to try.
double leastError(std::vector<Sorted> points, ShapeType type) {
  if (type == ShapeType::Ring) {
    for (Sorted& point : points) point.angle = -point.angle;
  }
  std::sort(points.begin(), points.end(), [](const Sorted& a, const Sorted& b) { return a.angle < b.angle; });
  int balance = 0;  // covered invalid minus covered valid: what the error depends on
  int best = 0;
  double opening = points.front().angle - kSlack;
  for (size_t i = 0; i < points.size(); ++i) {
    balance += points[i].valid ? -1 : 1;
    const bool tied = i + 1 < points.size() && points[i + 1].angle - points[i].angle < kSlack;
    if (tied || balance >= best) continue;
    best = balance;
    opening =
        i + 1 < points.size() ? 0.5 * (points[i].angle + points[i + 1].angle) : points[i].angle + kSlack;
  }
  return type == ShapeType::Ring ? std::max(0.0, -opening) : std::max(0.0, opening);
}

}  // namespace

bool Shape::covers(const Eigen::Vector3d& n) const {
  if (type == ShapeType::Empty) return false;
  const double angle = angleOf(type, axis, n);
  return type == ShapeType::Ring ? angle >= opening_rad : angle <= opening_rad;
}

Shape fitShape(const Points& outward, const std::vector<bool>& valid, ShapeType type, AngleRule rule) {
  Shape shape;
  shape.type = type;
  shape.axis = axisOf(outward, valid, type);
  std::vector<Sorted> points;
  for (Eigen::Index k = 0; k < outward.rows(); ++k) {
    points.push_back({angleOf(type, shape.axis, outward.row(k)), valid[static_cast<size_t>(k)]});
  }
  const double largest = type == ShapeType::Cone ? M_PI : M_PI_2;
  shape.opening_rad =
      std::min(largest, rule == AngleRule::CoverAll ? coverAll(points, type) : leastError(points, type));
  int covered_invalid = 0;
  int missed_valid = 0;
  int valid_count = 0;
  for (Eigen::Index k = 0; k < outward.rows(); ++k) {
    const bool is_valid = valid[static_cast<size_t>(k)];
    const bool covered = shape.covers(outward.row(k));
    covered_invalid += covered && !is_valid ? 1 : 0;
    missed_valid += !covered && is_valid ? 1 : 0;
    valid_count += is_valid ? 1 : 0;
  }
  shape.error_percent = errorPercent(covered_invalid, missed_valid, valid_count);
  return shape;
}

Shape fitBestShape(const Points& outward, const std::vector<bool>& valid, AngleRule rule) {
  if (std::none_of(valid.begin(), valid.end(), [](bool v) { return v; })) return {};
  Shape best = fitShape(outward, valid, ShapeType::Cone, rule);
  for (const ShapeType type : {ShapeType::DoubleCone, ShapeType::Ring}) {
    const Shape shape = fitShape(outward, valid, type, rule);
    if (shape.error_percent < best.error_percent - 1e-9) best = shape;
  }
  return best;
}

}  // namespace capability_map
