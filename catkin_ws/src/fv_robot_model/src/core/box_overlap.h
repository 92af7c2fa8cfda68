/// Oriented boxes: a cheap first look before FCL.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace fv_robot_model {

/// False only when the boxes are apart, by the separating-axis test over the 15 axes of two boxes
/// (Gottschalk, Lin, Manocha: OBBTree, SIGGRAPH 1996).
/// @param T_a_b Box b's frame to box a's; both boxes are centred on their frames. @param half_a, half_b Half
/// edges.
inline bool boxesMayTouch(const Eigen::Isometry3d& T_a_b, const Eigen::Vector3d& half_a,
                          const Eigen::Vector3d& half_b) {
  const Eigen::Matrix3d R = T_a_b.linear();
  const Eigen::Vector3d t = T_a_b.translation();
  // The slack keeps parallel edges, whose cross product vanishes, from counting as a separating axis.
  const Eigen::Matrix3d A = R.cwiseAbs().array() + 1e-9;
  if (((t.cwiseAbs() - half_a - A * half_b).array() > 0.0).any()) return false;
  if ((((R.transpose() * t).cwiseAbs() - half_b - A.transpose() * half_a).array() > 0.0).any()) return false;
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3;
    const int i2 = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3;
      const int j2 = (j + 2) % 3;
      const double reach =
          half_a[i1] * A(i2, j) + half_a[i2] * A(i1, j) + half_b[j1] * A(i, j2) + half_b[j2] * A(i, j1);
      if (std::abs(t[i2] * R(i1, j) - t[i1] * R(i2, j)) > reach) return false;
    }
  }
  return true;
}

}  // namespace fv_robot_model
