/// Three revolute axes through one point: which angles make a given rotation?
#pragma once

#include <Eigen/Core>
#include <array>

#include "joint_range.h"
#include "subproblems.h"

namespace fv_robot_model::ik {

class SphericalJoint {
 public:
  struct Solution {
    std::array<double, 3> q;
    double error_rad;  ///< How far R1 R2 R3 may miss R, from the cosines and sines themselves.
  };
  /// Up to two solutions, or one per sampled first angle where two of the axes fall together.
  struct Solutions {
    std::array<Solution, 16> item;
    int count{0};
  };

  SphericalJoint() = default;
  SphericalJoint(const std::array<ChainJoint, 3>& joints, double limit_tolerance);

  /// All q within limits with R = R1(q1) R2(q2) R3(q3). R may miss a rotation by rounding only.
  void solve(const Eigen::Matrix3d& R, Solutions& out) const;

 private:
  void solveMiddle(const Eigen::Matrix3d& R, const CosSin& middle, Solutions& out) const;
  void sampleFirst(const Eigen::Matrix3d& R, const CosSin& middle, Solutions& out) const;
  void append(double q1, double q2, double q3, double error_rad, Solutions& out) const;

  std::array<Eigen::Vector3d, 3> h_;
  std::array<JointRange, 3> ranges_;
  double constant_{0.0}, cosine_{0.0}, sine_{0.0};  // h1 . R2 h3 = constant + cosine c2 + sine s2
};

}  // namespace fv_robot_model::ik
