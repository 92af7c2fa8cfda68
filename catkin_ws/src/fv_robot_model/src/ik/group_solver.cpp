#include "fv_robot_model/ik/group_solver.h"

#include <kdl/chain.hpp>

namespace fv_robot_model::ik {

namespace {

Eigen::Vector3d eigenVector(const KDL::Vector& v) { return {v.x(), v.y(), v.z()}; }

Eigen::Isometry3d eigenPose(const KDL::Frame& frame) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) T.linear()(row, column) = frame.M(row, column);
  }
  T.translation() = eigenVector(frame.p);
  return T;
}

bool isPrismatic(const KDL::Joint& joint) {
  switch (joint.getType()) {
    case KDL::Joint::TransAxis:
    case KDL::Joint::TransX:
    case KDL::Joint::TransY:
    case KDL::Joint::TransZ:
      return true;
    default:
      return false;
  }
}

}  // namespace

SerialChain chainOfGroup(const RobotModel& model, const std::string& group_name) {
  const Group& group = model.group(group_name);
  const KDL::Chain kdl = model.chain(group);
  std::vector<ChainJoint> joints;
  KDL::Frame T_base_segment = KDL::Frame::Identity();
  for (unsigned i = 0; i < kdl.getNrOfSegments(); ++i) {
    const KDL::Segment& segment = kdl.getSegment(i);
    const KDL::Joint& kdl_joint = segment.getJoint();
    if (kdl_joint.getType() != KDL::Joint::None) {
      const JointLimits& limits = model.limits()[static_cast<size_t>(group.joint_indices.at(joints.size()))];
      ChainJoint joint;
      joint.name = kdl_joint.getName();
      joint.axis = eigenVector(T_base_segment.M * kdl_joint.JointAxis()).normalized();
      joint.point = eigenVector(T_base_segment * kdl_joint.JointOrigin());
      joint.lower = limits.lower;
      joint.upper = limits.upper;
      joint.prismatic = isPrismatic(kdl_joint);
      joints.push_back(joint);
    }
    T_base_segment = T_base_segment * segment.pose(0.0);
  }
  return SerialChain(std::move(joints), eigenPose(T_base_segment), group.base_link, group.tip_link);
}

std::unique_ptr<IkSolver> makeIkSolver(const RobotModel& model, const std::string& group,
                                       const IkOptions& options) {
  return makeIkSolver(chainOfGroup(model, group), options);
}

}  // namespace fv_robot_model::ik
