#include "fv_robot_model/robot_model.h"

#include <algorithm>
#include <cmath>

#include "internal.h"
#include "robot_model_builder.h"
#include "urdf_text.h"

namespace fv_robot_model {
namespace {

int indexIn(const std::vector<std::string>& names, const std::string& name, const std::string& kind) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) throw UnknownNameError(kind, name, names);
  return static_cast<int>(found - names.begin());
}

/// T_joint_link for a value of the joint.
Eigen::Isometry3d motion(const RobotModel::Link& link, double value) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (link.motion == RobotModel::Link::Motion::Rotation)
    T.linear() = Eigen::AngleAxisd(value, link.axis).matrix();
  if (link.motion == RobotModel::Link::Motion::Translation) T.translation() = value * link.axis;
  return T;
}

Eigen::Isometry3d parentToLink(const RobotModel::Link& link, double q) {
  if (link.motion == RobotModel::Link::Motion::Fixed) return link.T_parent_joint;
  return link.T_parent_joint * motion(link, link.multiplier * q + link.offset);
}

void checkValues(const Eigen::Ref<const Eigen::VectorXd>& q, const std::vector<std::string>& names) {
  if (q.size() != static_cast<Eigen::Index>(names.size()))
    throw std::invalid_argument(
        text("expected ", names.size(), " joint values, got ", q.size(), "; joints: ", joined(names)));
  if (q.allFinite()) return;
  for (Eigen::Index i = 0; i < q.size(); ++i)
    if (!std::isfinite(q[i]))
      throw std::invalid_argument(text("the value of joint '", names[i], "' is ", q[i]));
}

}  // namespace

RobotModel RobotModel::fromXml(const std::string& urdf_xml, const std::string& srdf_xml,
                               const MeshResolver& resolver, bool with_shapes) {
  RobotModelBuilder builder(resolver, with_shapes);
  builder.addTree(*parseUrdfText(urdf_xml));
  if (!srdf_xml.empty()) builder.addSrdf(parseSrdf(srdf_xml));
  return builder.take();
}

RobotModel RobotModel::withAttached(const std::string& name, const std::string& parent,
                                    const std::vector<Shape>& shapes,
                                    const std::vector<std::string>& touch_links) const {
  if (name.empty() || std::find(link_names_.begin(), link_names_.end(), name) != link_names_.end())
    throw std::invalid_argument(text("'", name, "' cannot be attached: the name is empty or that of a link"));
  RobotModel result = *this;
  Link link;
  link.parent = linkIndex(parent);
  result.links_.push_back(link);
  result.link_names_.push_back(name);
  result.shapes_.push_back(shapes);
  result.visuals_.emplace_back();
  for (auto& [key, group] : result.groups_)
    if (std::binary_search(group.moved_links.begin(), group.moved_links.end(), link.parent))
      group.moved_links.push_back(static_cast<int>(links_.size()));
  for (const std::string& other : touch_links) {
    linkIndex(other);
    result.disabled_pairs_.push_back(std::minmax(name, other));
  }
  std::sort(result.disabled_pairs_.begin(), result.disabled_pairs_.end());
  return result;
}

std::vector<std::string> RobotModel::bareLinks() const {
  std::vector<std::string> bare;
  for (std::size_t i = 0; i < links_.size(); ++i)
    if (shapes_[i].empty() && !visuals_[i].empty()) bare.push_back(link_names_[i]);
  return bare;
}

/// A link moves when its own joint does or its parent moves; parents come first in the numbering.
std::vector<int> RobotModel::movedLinks(const std::vector<int>& joint_indices) const {
  std::vector<int> moved;
  std::vector<bool> moves(links_.size(), false);
  for (std::size_t i = 1; i < links_.size(); ++i) {
    const auto& joints = joint_indices;
    moves[i] = moves[links_[i].parent] ||
               std::find(joints.begin(), joints.end(), links_[i].variable) != joints.end();
    if (moves[i]) moved.push_back(static_cast<int>(i));
  }
  return moved;
}

int RobotModel::jointIndex(const std::string& joint) const { return indexIn(joint_names_, joint, "joint"); }

int RobotModel::linkIndex(const std::string& link) const { return indexIn(link_names_, link, "link"); }

std::vector<std::string> RobotModel::groupNames() const { return keysOf(groups_); }

const Group& RobotModel::group(const std::string& name) const {
  const auto found = groups_.find(name);
  if (found == groups_.end()) throw UnknownNameError("group", name, groupNames());
  return found->second;
}

std::map<std::string, Eigen::VectorXd> RobotModel::namedStates(const std::string& group_name) const {
  const auto found = states_.find(group(group_name).name);
  return found == states_.end() ? std::map<std::string, Eigen::VectorXd>{} : found->second;
}

LinkPoses RobotModel::forward(const Eigen::Ref<const Eigen::VectorXd>& q_all) const {
  LinkPoses poses;
  forward(q_all, poses);
  return poses;
}

void RobotModel::forward(const Eigen::Ref<const Eigen::VectorXd>& q_all, LinkPoses& poses) const {
  checkValues(q_all, joint_names_);
  poses.resize(links_.size());
  poses[0].setIdentity();
  for (std::size_t i = 1; i < links_.size(); ++i) {
    const Link& link = links_[i];
    poses[i] = poses[link.parent] * parentToLink(link, link.variable < 0 ? 0.0 : q_all[link.variable]);
  }
}

void RobotModel::forward(const Eigen::Ref<const Eigen::VectorXd>& q_all, const Group& group,
                         LinkPoses& poses) const {
  checkValues(q_all, joint_names_);
  if (poses.size() != links_.size())
    throw std::invalid_argument(text("expected the poses of ", links_.size(), " links, got ", poses.size()));
  for (const int i : group.moved_links) {
    const Link& link = links_[i];
    poses[i] = poses[link.parent] * parentToLink(link, link.variable < 0 ? 0.0 : q_all[link.variable]);
  }
}

const std::vector<RobotModel::ChainStep>& RobotModel::chainSteps(const Group& group) const {
  const auto found = chain_steps_.find(group.name);
  if (found == chain_steps_.end())
    throw ModelError(
        text("group '", group.name, "' is not one chain; chains: ", joined(keysOf(chain_steps_))));
  return found->second;
}

Eigen::Isometry3d RobotModel::tipPose(const Group& group,
                                      const Eigen::Ref<const Eigen::VectorXd>& q_group) const {
  checkValues(q_group, group.joint_names);
  Eigen::Isometry3d T_base_link = Eigen::Isometry3d::Identity();
  for (const auto& [link, place] : chainSteps(group))
    T_base_link = T_base_link * parentToLink(links_[link], place < 0 ? 0.0 : q_group[place]);
  return T_base_link;
}

Eigen::Matrix<double, 6, Eigen::Dynamic> RobotModel::jacobian(
    const Group& group, const Eigen::Ref<const Eigen::VectorXd>& q_group) const {
  const Eigen::Vector3d p_tip = tipPose(group, q_group).translation();
  Eigen::Matrix<double, 6, Eigen::Dynamic> J =
      Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, q_group.size());
  Eigen::Isometry3d T_base_link = Eigen::Isometry3d::Identity();
  for (const auto& [index, place] : chainSteps(group)) {
    const Link& link = links_[index];
    const Eigen::Vector3d axis = T_base_link.linear() * (link.T_parent_joint.linear() * link.axis);
    T_base_link = T_base_link * parentToLink(link, place < 0 ? 0.0 : q_group[place]);
    if (link.motion == Link::Motion::Rotation) {
      J.col(place).head<3>() += link.multiplier * axis.cross(p_tip - T_base_link.translation());
      J.col(place).tail<3>() += link.multiplier * axis;
    } else if (link.motion == Link::Motion::Translation) {
      J.col(place).head<3>() += link.multiplier * axis;
    }
  }
  return J;
}

Eigen::Isometry3d RobotModel::tipPose(const std::string& name,
                                      const Eigen::Ref<const Eigen::VectorXd>& q_group) const {
  return tipPose(group(name), q_group);
}

Eigen::Matrix<double, 6, Eigen::Dynamic> RobotModel::jacobian(
    const std::string& name, const Eigen::Ref<const Eigen::VectorXd>& q_group) const {
  return jacobian(group(name), q_group);
}

void RobotModel::setGroup(const Group& group, const Eigen::Ref<const Eigen::VectorXd>& q_group,
                          Eigen::VectorXd& q_all) const {
  checkValues(q_group, group.joint_names);
  if (q_all.size() != static_cast<Eigen::Index>(joint_names_.size()))
    throw std::invalid_argument(text("expected ", joint_names_.size(), " joint values, got ", q_all.size()));
  for (std::size_t i = 0; i < group.joint_indices.size(); ++i)
    q_all[group.joint_indices[i]] = q_group[static_cast<Eigen::Index>(i)];
}

bool RobotModel::withinLimits(const Group& group, const Eigen::Ref<const Eigen::VectorXd>& q_group,
                              double tolerance) const {
  checkValues(q_group, group.joint_names);
  for (std::size_t i = 0; i < group.joint_indices.size(); ++i) {
    const JointLimits& limits = limits_[group.joint_indices[i]];
    const double q = q_group[static_cast<Eigen::Index>(i)];
    if (limits.bounded && (q < limits.lower - tolerance || q > limits.upper + tolerance)) return false;
  }
  return true;
}

}  // namespace fv_robot_model
