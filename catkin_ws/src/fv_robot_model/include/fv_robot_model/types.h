/// Types and errors shared by everything that knows the robot's geometry.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace fv_robot_model {

/// (N, 3) points [m], row-major: a view of a numpy float64 array.
using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// T_root_link of every link, indexed as RobotModel::linkNames().
using LinkPoses = std::vector<Eigen::Isometry3d>;

/// Names of two links.
using LinkPair = std::pair<std::string, std::string>;

/// The description itself is broken: XML, a chain, a mesh file, a kind of joint that is not supported.
class ModelError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A name that the model does not have; the message lists the valid ones.
class UnknownNameError : public std::invalid_argument {
 public:
  UnknownNameError(const std::string& kind, const std::string& name, const std::vector<std::string>& valid);
};

}  // namespace fv_robot_model
