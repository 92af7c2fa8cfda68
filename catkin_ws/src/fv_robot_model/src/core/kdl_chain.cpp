#include <kdl/chain.hpp>

#include "fv_robot_model/robot_model.h"
#include "internal.h"

namespace fv_robot_model {
namespace {

KDL::Frame toKdl(const Eigen::Isometry3d& T) {
  const Eigen::Matrix3d R = T.linear();
  const Eigen::Vector3d p = T.translation();
  return {KDL::Rotation(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)),
          KDL::Vector(p.x(), p.y(), p.z())};
}

/// KDL wants the joint's axis in the parent's frame, the URDF gives it in the joint's own.
KDL::Joint toKdlJoint(const RobotModel::Link& link) {
  using Motion = RobotModel::Link::Motion;
  if (link.motion == Motion::Fixed) return KDL::Joint(link.joint_name, KDL::Joint::Fixed);
  const Eigen::Vector3d axis = link.T_parent_joint.linear() * link.axis;
  const Eigen::Vector3d origin = link.T_parent_joint.translation();
  const auto type = link.motion == Motion::Rotation ? KDL::Joint::RotAxis : KDL::Joint::TransAxis;
  return KDL::Joint(link.joint_name, KDL::Vector(origin.x(), origin.y(), origin.z()),
                    KDL::Vector(axis.x(), axis.y(), axis.z()), type, link.multiplier);
}

/// T_parent_link while the joint's variable is 0: a mimic stands at its offset then.
KDL::Frame atZero(const RobotModel::Link& link) {
  Eigen::Isometry3d T = link.T_parent_joint;
  if (link.offset != 0.0 && link.motion == RobotModel::Link::Motion::Rotation)
    T = T * Eigen::AngleAxisd(link.offset, link.axis);
  if (link.offset != 0.0 && link.motion == RobotModel::Link::Motion::Translation)
    T = T * Eigen::Translation3d(link.offset * link.axis);
  return toKdl(T);
}

}  // namespace

KDL::Chain RobotModel::chain(const Group& group) const {
  KDL::Chain chain;
  for (const ChainStep& step : chainSteps(group)) {
    const Link& link = links_[step.link];
    chain.addSegment(KDL::Segment(link_names_[step.link], toKdlJoint(link), atZero(link)));
  }
  return chain;
}

KDL::Chain RobotModel::chain(const std::string& name) const { return chain(group(name)); }

}  // namespace fv_robot_model
