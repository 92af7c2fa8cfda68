#include "fv_robot_model/ik/group_solver.h"

#include <algorithm>
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
  std::vector<CoupledAxis> axes;
  std::vector<ChainJoint> joints(group.joint_indices.size());
  KDL::Frame T_base_segment = KDL::Frame::Identity();
  for (unsigned i = 0; i < kdl.getNrOfSegments(); ++i) {
    const KDL::Segment& segment = kdl.getSegment(i);
    const KDL::Joint& kdl_joint = segment.getJoint();
    if (kdl_joint.getType() != KDL::Joint::None) {
      const RobotModel::Link& link = model.link(model.linkIndex(segment.getName()));
      const auto place = std::find(group.joint_indices.begin(), group.joint_indices.end(), link.variable);
      CoupledAxis coupled;
      coupled.joint = static_cast<int>(place - group.joint_indices.begin());
      coupled.multiplier = link.multiplier;
      ChainJoint& joint = coupled.axis;
      joint.name = kdl_joint.getName();
      joint.axis = eigenVector(T_base_segment.M * kdl_joint.JointAxis()).normalized();
      joint.point = eigenVector(T_base_segment * kdl_joint.JointOrigin());
      const JointLimits& limits = model.limits()[static_cast<size_t>(link.variable)];
      joint.lower = limits.lower;
      joint.upper = limits.upper;
      joint.prismatic = isPrismatic(kdl_joint);
      if (!link.mimic) joints[static_cast<size_t>(coupled.joint)] = joint;
      axes.push_back(std::move(coupled));
    }
    T_base_segment = T_base_segment * segment.pose(0.0);
  }
  if (axes.size() == joints.size()) axes.clear();  // no mimics among them
  return SerialChain(std::move(joints), std::move(axes), eigenPose(T_base_segment), group.base_link,
                     group.tip_link);
}

std::unique_ptr<IkSolver> makeIkSolver(const RobotModel& model, const std::string& group,
                                       const IkOptions& options) {
  return makeIkSolver(chainOfGroup(model, group), options);
}

}  // namespace fv_robot_model::ik
