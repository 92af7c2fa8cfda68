/// The URDF's half of RobotModelBuilder: links, joints, shapes.
#include <algorithm>
#include <cmath>
#include <tuple>

#include "internal.h"
#include "mesh.h"
#include "robot_model_builder.h"

namespace fv_robot_model {
namespace {

Eigen::Isometry3d toEigen(const urdf::Pose& pose, const std::string& whose) {
  const Eigen::Vector3d position(pose.position.x, pose.position.y, pose.position.z);
  Eigen::Quaterniond rotation(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z);
  if (!position.allFinite() || !rotation.coeffs().allFinite())
    throw ModelError(text("the origin of ", whose, " is not finite"));
  return Eigen::Translation3d(position) * rotation.normalized();
}

Eigen::Vector3d unitAxis(const urdf::Joint& joint) {
  const Eigen::Vector3d axis(joint.axis.x, joint.axis.y, joint.axis.z);
  if (!axis.allFinite() || axis.norm() < 1e-9)
    throw ModelError(text("the axis of joint '", joint.name, "' has no direction"));
  return axis.normalized();
}

JointLimits limitsOf(const urdf::Joint& joint) {
  JointLimits limits;
  limits.bounded = joint.type != urdf::Joint::CONTINUOUS;
  if (!limits.bounded) {
    limits.lower = -M_PI;
    limits.upper = M_PI;
  }
  if (joint.limits == nullptr) return limits;  // urdfdom demands them of revolute and prismatic joints
  limits.velocity = joint.limits->velocity;
  limits.effort = joint.limits->effort;
  if (!limits.bounded) return limits;
  limits.lower = joint.limits->lower;
  limits.upper = joint.limits->upper;
  if (!std::isfinite(limits.lower) || !std::isfinite(limits.upper) || limits.lower > limits.upper)
    throw ModelError(text("joint '", joint.name, "': lower limit ", limits.lower,
                          " is not below upper limit ", limits.upper));
  return limits;
}

std::vector<Visual> visualsOf(const urdf::Link& link) {
  std::vector<Visual> visuals;
  for (const auto& element : link.visual_array) {
    if (element == nullptr || element->geometry == nullptr) continue;
    Visual visual;
    visual.T_link_visual = toEigen(element->origin, text("a visual of link '", link.name, "'"));
    if (const auto* box = dynamic_cast<const urdf::Box*>(element->geometry.get())) {
      visual.kind = Visual::Kind::Box;
      visual.dimensions << box->dim.x, box->dim.y, box->dim.z;
    } else if (const auto* tube = dynamic_cast<const urdf::Cylinder*>(element->geometry.get())) {
      visual.kind = Visual::Kind::Cylinder;
      visual.dimensions << tube->radius, tube->length, 0.0;
    } else if (const auto* ball = dynamic_cast<const urdf::Sphere*>(element->geometry.get())) {
      visual.kind = Visual::Kind::Sphere;
      visual.dimensions << ball->radius, 0.0, 0.0;
    } else if (const auto* mesh = dynamic_cast<const urdf::Mesh*>(element->geometry.get())) {
      visual.kind = Visual::Kind::Mesh;
      visual.dimensions << mesh->scale.x, mesh->scale.y, mesh->scale.z;
      visual.mesh = mesh->filename;
    }
    visuals.push_back(std::move(visual));
  }
  return visuals;
}

RobotModel::Link::Motion motionOf(const urdf::Joint& joint) {
  using Motion = RobotModel::Link::Motion;
  switch (joint.type) {
    case urdf::Joint::REVOLUTE:
    case urdf::Joint::CONTINUOUS:
      return Motion::Rotation;
    case urdf::Joint::PRISMATIC:
      return Motion::Translation;
    case urdf::Joint::FIXED:
      return Motion::Fixed;
    case urdf::Joint::FLOATING:
      throw ModelError(text("joint '", joint.name, "' is floating, which is not supported"));
    case urdf::Joint::PLANAR:
      throw ModelError(text("joint '", joint.name, "' is planar, which is not supported"));
    default:
      throw ModelError(text("joint '", joint.name, "' is of an unknown type"));
  }
}

}  // namespace

void RobotModelBuilder::addTree(const urdf::ModelInterface& tree) {
  model_.name_ = tree.getName();
  addLink(tree, *tree.getRoot(), -1);
  if (model_.links_.size() != tree.links_.size()) {
    std::vector<std::string> loose;
    for (const auto& entry : tree.links_)
      if (std::find(model_.link_names_.begin(), model_.link_names_.end(), entry.first) ==
          model_.link_names_.end())
        loose.push_back(entry.first);
    throw ModelError(text("links that do not hang on the root '", model_.link_names_.front(),
                          "' but on each other, in a circle: ", joined(loose)));
  }
  resolveMimics(tree);
}

void RobotModelBuilder::addLink(const urdf::ModelInterface& tree, const urdf::Link& link, int parent) {
  const int index = static_cast<int>(model_.links_.size());
  RobotModel::Link entry;
  entry.parent = parent;
  if (link.parent_joint != nullptr) addJoint(*link.parent_joint, entry);
  model_.link_names_.push_back(link.name);
  model_.links_.push_back(entry);
  model_.shapes_.push_back(with_shapes_ ? makeShapes(link) : std::vector<Shape>{});
  model_.visuals_.push_back(visualsOf(link));
  std::map<std::string, std::string> children;  // joint to link, sorted
  for (const auto& joint : link.child_joints) children[joint->name] = joint->child_link_name;
  for (const auto& [joint, child] : children) addLink(tree, *tree.getLink(child), index);
}

void RobotModelBuilder::addJoint(const urdf::Joint& joint, RobotModel::Link& link) {
  link.joint_name = joint.name;
  link.motion = motionOf(joint);
  link.T_parent_joint = toEigen(joint.parent_to_joint_origin_transform, text("joint '", joint.name, "'"));
  if (link.motion == RobotModel::Link::Motion::Fixed) return;
  link.axis = unitAxis(joint);
  link.limits = limitsOf(joint);
  if (joint.mimic != nullptr) {
    link.mimic = true;  // its leader may come later: see resolveMimics
  } else {
    addVariable(joint, link);
  }
}

void RobotModelBuilder::addVariable(const urdf::Joint& joint, RobotModel::Link& link) {
  link.variable = static_cast<int>(model_.joint_names_.size());
  model_.joint_names_.push_back(joint.name);
  model_.limits_.push_back(link.limits);
}

void RobotModelBuilder::resolveMimics(const urdf::ModelInterface& tree) {
  for (RobotModel::Link& link : model_.links_)
    if (link.mimic) {
      followLeader(tree, link);
      narrowLeader(link);
    }
}

/// A leader may only go where each of its followers stays within its own limits and velocity.
void RobotModelBuilder::narrowLeader(const RobotModel::Link& link) {
  JointLimits& leader = model_.limits_[link.variable];
  const double rate = std::abs(link.multiplier);
  if (link.limits.velocity > 0.0 && rate > 0.0) {
    const double velocity = link.limits.velocity / rate;
    leader.velocity = leader.velocity > 0.0 ? std::min(leader.velocity, velocity) : velocity;
  }
  if (!link.limits.bounded) return;
  constexpr double kRounding = 1e-9;
  double lower = link.limits.lower - link.offset;
  double upper = link.limits.upper - link.offset;
  const std::string& name = model_.joint_names_[link.variable];
  bool fits = true;
  if (rate > 0.0) {
    std::tie(lower, upper) = std::minmax({lower / link.multiplier, upper / link.multiplier});
    leader.lower = leader.bounded ? std::max(leader.lower, lower) : lower;
    leader.upper = leader.bounded ? std::min(leader.upper, upper) : upper;
    leader.bounded = true;
    fits = leader.lower <= leader.upper + kRounding;
    leader.upper = std::max(leader.lower, leader.upper);
  } else {
    fits = lower <= kRounding && upper >= -kRounding;  // it stands at its offset
  }
  if (!fits)
    throw ModelError(text("joint '", link.joint_name, "' mimics '", name, "' (times ", link.multiplier,
                          ", plus ", link.offset, "): no value of '", name, "' keeps both within limits"));
}

/// Why the limits of a joint are not those of the URDF, if so: for messages.
std::string RobotModelBuilder::narrowedBy(int variable) const {
  std::string by;
  for (const RobotModel::Link& link : model_.links_)
    if (link.mimic && link.variable == variable && link.limits.bounded)
      by += (by.empty() ? " (with those of its mimics " : ", ") + link.joint_name;
  return by.empty() ? by : by + ")";
}

/// A mimic may follow another mimic: value = m1 * (m2 * q + o2) + o1.
void RobotModelBuilder::followLeader(const urdf::ModelInterface& tree, RobotModel::Link& link) {
  auto joint = tree.getJoint(link.joint_name);
  std::size_t steps = 0;
  while (joint->mimic != nullptr) {
    const urdf::JointMimic& mimic = *joint->mimic;
    if (!std::isfinite(mimic.multiplier) || !std::isfinite(mimic.offset))
      throw ModelError(text("the multiplier or offset of mimic joint '", joint->name, "' is not finite"));
    link.offset += link.multiplier * mimic.offset;
    link.multiplier *= mimic.multiplier;
    const auto leader = tree.getJoint(mimic.joint_name);
    if (leader == nullptr)
      throw ModelError(
          text("joint '", joint->name, "' mimics '", mimic.joint_name, "', which does not exist"));
    joint = leader;
    if (++steps > tree.joints_.size())
      throw ModelError(text("joint '", link.joint_name, "' mimics itself in a circle"));
  }
  if (joint->type == urdf::Joint::FIXED)
    throw ModelError(text("joint '", link.joint_name, "' mimics '", joint->name, "', which is fixed"));
  link.variable = model_.jointIndex(joint->name);
}

std::vector<Shape> RobotModelBuilder::makeShapes(const urdf::Link& link) const {
  std::vector<Shape> shapes;
  for (const auto& collision : link.collision_array) {
    try {
      if (collision != nullptr && collision->geometry != nullptr) shapes.push_back(makeShape(*collision));
    } catch (const std::exception& error) {
      throw ModelError(text("collision shape of link '", link.name, "': ", error.what()));
    }
  }
  return shapes;
}

Shape RobotModelBuilder::makeShape(const urdf::Collision& collision) const {
  const Eigen::Isometry3d T_link_shape = toEigen(collision.origin, "the shape");
  switch (collision.geometry->type) {
    case urdf::Geometry::SPHERE:
      return Shape::sphere(static_cast<const urdf::Sphere&>(*collision.geometry).radius, T_link_shape);
    case urdf::Geometry::CYLINDER: {
      const auto& cylinder = static_cast<const urdf::Cylinder&>(*collision.geometry);
      return Shape::cylinder(cylinder.radius, cylinder.length, T_link_shape);
    }
    case urdf::Geometry::BOX: {
      const urdf::Vector3& dim = static_cast<const urdf::Box&>(*collision.geometry).dim;
      return Shape::box({dim.x, dim.y, dim.z}, T_link_shape);
    }
    case urdf::Geometry::MESH: {
      const auto& mesh = static_cast<const urdf::Mesh&>(*collision.geometry);
      const std::string file = resolveMesh(mesh.filename, resolver_);
      return meshHull(file, {mesh.scale.x, mesh.scale.y, mesh.scale.z}, T_link_shape);
    }
  }
  throw ModelError("unknown kind of geometry");
}

}  // namespace fv_robot_model
