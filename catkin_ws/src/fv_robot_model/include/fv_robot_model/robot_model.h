/// URDF and SRDF as kinematics and collision shapes: the one place where they are read for the C++ cores.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "fv_robot_model/shape.h"
#include "fv_robot_model/types.h"

namespace KDL {
class Chain;  // include <kdl/chain.hpp> to use RobotModel::chain
}

namespace fv_robot_model {

/// Range of one joint: [rad] for revolute and continuous, [m] for prismatic joints.
struct JointLimits {
  double lower{0.0};     ///< A continuous joint has -pi here: sample there, but never refuse beyond.
  double upper{0.0};     ///< A continuous joint has +pi here.
  double velocity{0.0};  ///< [rad/s] or [m/s]; 0 when the URDF gives none.
  double effort{0.0};    ///< [N m] or [N]; 0 when the URDF gives none.
  bool bounded{true};    ///< False for continuous joints: lower and upper do not bind.
};

/// A group of the SRDF.
struct Group {
  std::string name;
  std::string base_link;                 ///< Empty unless the group is one chain.
  std::string tip_link;                  ///< Empty unless the group is one chain.
  std::vector<std::string> joint_names;  ///< Empty for a group that nothing moves (a rigid tool).
  std::vector<int> joint_indices;        ///< Into RobotModel::jointNames(), ascending.
  std::vector<int> moved_links;  ///< Indices of all links that any of its joints moves, ascending: with the
                                 ///< waist in the group, the other arm too. Mimics of its joints count.
  bool isChain() const { return !tip_link.empty(); }
};

/// What a link looks like, as the URDF has it: one primitive or one mesh.
struct Visual {
  enum class Kind { Box, Cylinder, Sphere, Mesh };
  Kind kind{Kind::Box};
  /// Box: full edge lengths [m]. Cylinder: radius, length, 0 [m]. Sphere: radius, 0, 0 [m]. Mesh: its scale.
  Eigen::Vector3d dimensions{Eigen::Vector3d::Zero()};
  std::string mesh;  ///< Name of the mesh as written; empty for primitives. It is not looked at.
  Eigen::Isometry3d T_link_visual{Eigen::Isometry3d::Identity()};
};

/// Takes a mesh's `package://`, relative or other name as written in the URDF to an absolute file name.
/// `file://` and absolute names do not come here. Throws or returns an empty string when it does not know.
using MeshResolver = std::function<std::string(const std::string& uri)>;

/// Resolver for `package://<name>/rest` by a map from package name to its folder.
MeshResolver packageResolver(std::map<std::string, std::string> folders);

/// A tree of links joined by revolute, continuous, prismatic, fixed joints and mimics of these.
///
/// Links and joints are numbered depth first from the root, children in the order of their joints' names, so
/// a parent's index is always below its children's. Immutable after construction: share one among threads.
class RobotModel {
 public:
  /// @param urdf_xml Text of the URDF (not a file name), xacro already expanded.
  /// @param srdf_xml Text of the SRDF; empty for none: then there are no groups and no disabled pairs.
  /// @param with_shapes False: links get no collision shapes, and no mesh is looked for.
  /// @throws ModelError naming what is broken: XML, a link or joint that the SRDF names and the URDF does not
  ///   have, a chain that is not one, a mesh file that is missing, a floating or planar joint.
  static RobotModel fromXml(const std::string& urdf_xml, const std::string& srdf_xml,
                            const MeshResolver& resolver = {}, bool with_shapes = true);

  /// The same robot holding something: a new last link, fixed to `parent` with its own frame on the parent's.
  /// @param shapes Its collision shapes, T_link_shape within the frame of the parent.
  /// @param touch_links Links that may touch it besides the parent; contacts with them join disabledPairs().
  /// @throws std::invalid_argument when the name is taken, UnknownNameError for links that do not exist.
  RobotModel withAttached(const std::string& name, const std::string& parent,
                          const std::vector<Shape>& shapes,
                          const std::vector<std::string>& touch_links = {}) const;

  const std::string& name() const { return name_; }

  /// Movable joints that are no mimics; q_all has their values in this order.
  const std::vector<std::string>& jointNames() const { return joint_names_; }
  /// What each of jointNames() may do: its own limits, narrowed so that its mimics stay within theirs.
  const std::vector<JointLimits>& limits() const { return limits_; }
  /// Those of jointNames() that the SRDF calls passive: nothing drives them, so no group holds them.
  const std::vector<std::string>& passiveJoints() const { return passive_joints_; }
  const std::vector<std::string>& linkNames() const { return link_names_; }
  const std::string& rootLink() const { return link_names_.front(); }
  /// @throws UnknownNameError listing the valid names.
  int jointIndex(const std::string& joint) const;
  int linkIndex(const std::string& link) const;

  /// Collision shapes of a link; empty for a link without. @throws std::out_of_range.
  const std::vector<Shape>& shapes(int link_index) const { return shapes_.at(link_index); }
  /// What a link looks like; empty for a link that is not drawn. @throws std::out_of_range.
  const std::vector<Visual>& visuals(int link_index) const { return visuals_.at(link_index); }
  /// Links that are drawn but have no collision shape: planning and self-filter do not know of them.
  std::vector<std::string> bareLinks() const;
  /// Indices of all links that any of these joints (indices into jointNames()) moves, ascending.
  std::vector<int> movedLinks(const std::vector<int>& joint_indices) const;
  /// Index of the parent link; -1 for the root. @throws std::out_of_range.
  int parent(int link_index) const { return links_.at(link_index).parent; }

  std::vector<std::string> groupNames() const;
  /// @throws UnknownNameError listing the valid names.
  const Group& group(const std::string& name) const;
  /// Named poses of a group, each with the values of group.joint_indices in that order.
  std::map<std::string, Eigen::VectorXd> namedStates(const std::string& group) const;
  /// Pairs of links whose contact the SRDF declares harmless; each pair sorted by name.
  const std::vector<LinkPair>& disabledPairs() const { return disabled_pairs_; }

  /// T_root_link of every link.
  /// @param q_all One value for each of jointNames(); limits are not asked.
  /// @throws std::invalid_argument for a wrong size or a value that is not finite, with the joint's name.
  LinkPoses forward(const Eigen::Ref<const Eigen::VectorXd>& q_all) const;
  /// As above into a buffer that keeps its memory: no allocation when it already has one entry per link.
  void forward(const Eigen::Ref<const Eigen::VectorXd>& q_all, LinkPoses& poses) const;
  /// Renews only the links that `group` moves; the others in `poses` must already stand for q_all. No
  /// allocation.
  void forward(const Eigen::Ref<const Eigen::VectorXd>& q_all, const Group& group, LinkPoses& poses) const;

  /// T_base_tip of a group that is a chain, for the values q_group of its joints.
  /// @throws ModelError when the group is no chain; std::invalid_argument as forward().
  Eigen::Isometry3d tipPose(const Group& group, const Eigen::Ref<const Eigen::VectorXd>& q_group) const;
  /// Geometric Jacobian (6, n) of the tip: rows 0-2 linear velocity [m] of the tip's origin, rows 3-5 angular
  /// velocity, both in the frame of the group's base link, per unit of joint velocity. Errors as tipPose.
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(const Group& group,
                                                    const Eigen::Ref<const Eigen::VectorXd>& q_group) const;
  /// The group as KDL chain, a segment a link, fixed joints kept as KDL's fixed segments. KDL's joints are
  /// q_group in order; a mimic joint is one more, which takes its leader's value (KDL's scale and the
  /// segment's frame at zero do the rest).
  /// @throws ModelError when the group is no chain.
  KDL::Chain chain(const Group& group) const;

  Eigen::Isometry3d tipPose(const std::string& group, const Eigen::Ref<const Eigen::VectorXd>& q_group) const;
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(const std::string& group,
                                                    const Eigen::Ref<const Eigen::VectorXd>& q_group) const;
  KDL::Chain chain(const std::string& group) const;

  /// Sets a group's values within q_all. @throws std::invalid_argument for wrong sizes.
  void setGroup(const Group& group, const Eigen::Ref<const Eigen::VectorXd>& q_group,
                Eigen::VectorXd& q_all) const;
  /// True when every bounded joint of the group is within its limits, widened by tolerance [rad or m].
  bool withinLimits(const Group& group, const Eigen::Ref<const Eigen::VectorXd>& q_group,
                    double tolerance = 0.0) const;

  /// How a link hangs on its parent: T_parent_link = T_parent_joint * motion(multiplier * q_all[variable] +
  /// offset).
  struct Link {
    enum class Motion { Fixed, Rotation, Translation };
    int parent{-1};
    Motion motion{Motion::Fixed};
    int variable{-1};  ///< Into jointNames(); that of the leader for a mimic joint; -1 when fixed.
    bool mimic{false};
    double multiplier{1.0};
    double offset{0.0};
    Eigen::Vector3d axis{Eigen::Vector3d::UnitX()};  ///< Unit vector, joint frame.
    Eigen::Isometry3d T_parent_joint{Eigen::Isometry3d::Identity()};
    std::string joint_name;  ///< Empty for the root.
    JointLimits limits;      ///< Of the joint itself, as the URDF has them, also where it is a mimic.
  };
  /// @throws std::out_of_range.
  const Link& link(int link_index) const { return links_.at(link_index); }

 private:
  friend class RobotModelBuilder;
  /// A link of a chain group and the place of its joint's value in q_group (-1: fixed).
  struct ChainStep {
    int link;
    int place;
  };
  RobotModel() = default;
  const std::vector<ChainStep>& chainSteps(const Group& group) const;

  std::string name_;
  std::vector<std::string> joint_names_;
  std::vector<JointLimits> limits_;
  std::vector<std::string> link_names_;
  std::vector<Link> links_;
  std::vector<std::string> passive_joints_;
  std::vector<std::vector<Shape>> shapes_;
  std::vector<std::vector<Visual>> visuals_;
  std::map<std::string, Group> groups_;
  std::map<std::string, std::vector<ChainStep>>
      chain_steps_;  ///< Of each chain: links after the base, in order.
  std::map<std::string, std::map<std::string, Eigen::VectorXd>> states_;
  std::vector<LinkPair> disabled_pairs_;
};

}  // namespace fv_robot_model
