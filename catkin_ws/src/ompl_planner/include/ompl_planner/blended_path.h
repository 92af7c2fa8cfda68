#pragma once

#include <Eigen/Core>
#include <vector>

namespace ompl_planner {

using JointVector = Eigen::VectorXd;         ///< One value per joint of the group [rad].
using JointPath = std::vector<JointVector>;  ///< Waypoints, straight lines between them [rad].

/// Joint-space Euclidean length of a polyline [rad].
double pathLength(const JointPath& path);

/// Largest absolute joint difference of two states [rad].
double maxJointStep(const JointVector& a, const JointVector& b);

/// Position and its first two derivatives by the path parameter.
struct PathPoint {
  JointVector q;    ///< [rad]
  JointVector dq;   ///< [rad / unit of s]
  JointVector ddq;  ///< [rad / unit of s^2]
};

/// A polyline whose corners are rounded by quintic Bezier curves: straight lines and corners join with equal
/// first and second derivative. A corner of radius 0 stays sharp: the motion must stop there. The curve of a
/// corner lies in the triangle of the corner and its two ends, so it leaves the polyline by less than its
/// radius.
class BlendedPath {
 public:
  /// @param waypoints At least two; consecutive ones must differ.
  /// @param radii     One per waypoint [rad]: how far before and after it the corner begins and ends. Clipped
  /// to half
  ///                  of the neighbouring segments; the first and the last are ignored.
  /// @throws std::invalid_argument on fewer than two waypoints, equal neighbours, unequal lengths, or NaN.
  BlendedPath(const JointPath& waypoints, const std::vector<double>& radii);

  double length() const { return starts_.back(); }

  /// The path at s in [0, length()]; clamped to it.
  PathPoint at(double s) const;

  /// Parameters where the motion must rest: both ends and every sharp corner, ascending.
  const std::vector<double>& rests() const { return rests_; }

  /// Parameters that cut the path so that each line and corner is resolved: steps of at most `step`, and at
  /// least 16 for each corner, 4 for each line; with both ends, ascending.
  std::vector<double> grid(double step) const;

  /// Parameters at which each waypoint's corner is centred; one per waypoint.
  const std::vector<double>& waypointParameters() const { return waypoint_parameters_; }

 private:
  struct Piece {  ///< A line has two control points, a corner six.
    std::vector<JointVector> control;
    double length;
  };
  void addLine(const JointVector& from, const JointVector& to);
  void addCorner(const JointVector& corner, const JointVector& in, const JointVector& out, double radius);

  std::vector<Piece> pieces_;
  std::vector<double> starts_{0.0};  ///< Begin of each piece, and the end of the last.
  std::vector<double> rests_;
  std::vector<double> waypoint_parameters_;
};

}  // namespace ompl_planner
