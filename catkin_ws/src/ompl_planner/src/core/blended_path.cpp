#include "ompl_planner/blended_path.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace ompl_planner {
namespace {

constexpr double kMinSegment = 1e-9;  // [rad] below this two waypoints are one

/// De Casteljau's scheme at t, leaving the control points of the hodographs that the derivatives need.
std::vector<JointVector> casteljau(std::vector<JointVector> points, double t, std::size_t levels) {
  for (std::size_t level = 0; level < levels; ++level) {
    for (std::size_t i = 0; i + 1 < points.size(); ++i) points[i] += t * (points[i + 1] - points[i]);
    points.pop_back();
  }
  return points;
}

PathPoint bezierAt(const std::vector<JointVector>& control, double t, double length) {
  const std::size_t degree = control.size() - 1;
  PathPoint point;
  if (degree == 1) {
    point.dq = (control[1] - control[0]) / length;
    point.q = control[0] + t * (control[1] - control[0]);
    point.ddq = JointVector::Zero(control[0].size());
    return point;
  }
  const auto last3 = casteljau(control, t, degree - 2);
  const double d = static_cast<double>(degree);
  point.ddq = d * (d - 1.0) * (last3[2] - 2.0 * last3[1] + last3[0]) / (length * length);
  const auto last2 = casteljau(last3, t, 1);
  point.dq = d * (last2[1] - last2[0]) / length;
  point.q = last2[0] + t * (last2[1] - last2[0]);
  return point;
}

void checkInput(const JointPath& waypoints, const std::vector<double>& radii) {
  if (waypoints.size() < 2) throw std::invalid_argument("a path needs at least two waypoints");
  if (radii.size() != waypoints.size()) throw std::invalid_argument("one radius per waypoint is needed");
  for (std::size_t i = 0; i < waypoints.size(); ++i) {
    if (!waypoints[i].allFinite() || waypoints[i].size() != waypoints[0].size()) {
      throw std::invalid_argument("waypoint " + std::to_string(i) + " is not finite or of another size");
    }
    if (i > 0 && (waypoints[i] - waypoints[i - 1]).norm() < kMinSegment) {
      throw std::invalid_argument("waypoints " + std::to_string(i - 1) + " and " + std::to_string(i) +
                                  " are equal");
    }
  }
}

}  // namespace

double pathLength(const JointPath& path) {
  double sum = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) sum += (path[i] - path[i - 1]).norm();
  return sum;
}

double maxJointStep(const JointVector& a, const JointVector& b) { return (b - a).cwiseAbs().maxCoeff(); }

BlendedPath::BlendedPath(const JointPath& waypoints, const std::vector<double>& radii) {
  checkInput(waypoints, radii);
  const std::size_t last = waypoints.size() - 1;
  JointVector from = waypoints.front();
  rests_.push_back(0.0);
  waypoint_parameters_.push_back(0.0);
  for (std::size_t i = 1; i <= last; ++i) {
    const JointVector step = waypoints[i] - waypoints[i - 1];
    if (i == last) {
      addLine(from, waypoints[i]);
      break;
    }
    const JointVector next = waypoints[i + 1] - waypoints[i];
    const double radius = std::max(0.0, std::min({radii[i], 0.5 * step.norm(), 0.5 * next.norm()}));
    addLine(from, waypoints[i] - radius * step.normalized());
    if (radius < kMinSegment) rests_.push_back(length());
    waypoint_parameters_.push_back(length() + radius);
    addCorner(waypoints[i], step.normalized(), next.normalized(), radius);
    from = waypoints[i] + radius * next.normalized();
  }
  rests_.push_back(length());
  waypoint_parameters_.push_back(length());
}

void BlendedPath::addLine(const JointVector& from, const JointVector& to) {
  const double length = (to - from).norm();
  if (length < kMinSegment) return;  // two corners that touch
  pieces_.push_back({{from, to}, length});
  starts_.push_back(starts_.back() + length);
}

void BlendedPath::addCorner(const JointVector& corner, const JointVector& in, const JointVector& out,
                            double radius) {
  if (radius < kMinSegment) return;
  // With length 2 r the parameter's speed is 1 at both ends; three equally spaced control points there make
  // the second derivative vanish, as it does on the lines.
  const double length = 2.0 * radius;
  const JointVector begin = corner - radius * in;
  const JointVector end = corner + radius * out;
  const double k = length / 5.0;
  pieces_.push_back(
      {{begin, begin + k * in, begin + 2.0 * k * in, end - 2.0 * k * out, end - k * out, end}, length});
  starts_.push_back(starts_.back() + length);
}

std::vector<double> BlendedPath::grid(double step) const {
  std::vector<double> parameters{0.0};
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const double least = pieces_[i].control.size() > 2 ? 16.0 : 4.0;
    const double count = std::max(least, std::ceil(pieces_[i].length / step));
    for (double k = 1.0; k <= count; k += 1.0)
      parameters.push_back(starts_[i] + pieces_[i].length * k / count);
  }
  return parameters;
}

PathPoint BlendedPath::at(double s) const {
  const double clamped = std::min(std::max(s, 0.0), length());
  const auto next = std::upper_bound(starts_.begin() + 1, starts_.end() - 1, clamped);
  const auto index = static_cast<std::size_t>(next - starts_.begin()) - 1;
  const Piece& piece = pieces_[index];
  return bezierAt(piece.control, (clamped - starts_[index]) / piece.length, piece.length);
}

}  // namespace ompl_planner
