/// Makes a RobotModel out of a URDF tree and an SRDF.
#pragma once

#include <urdf_model/model.h>

#include <set>
#include <string>
#include <vector>

#include "fv_robot_model/robot_model.h"
#include "srdf.h"

namespace fv_robot_model {

/// Used once: addTree, then addSrdf, then take.
class RobotModelBuilder {
 public:
  RobotModelBuilder(const MeshResolver& resolver, bool with_shapes)
      : resolver_(resolver), with_shapes_(with_shapes) {}

  void addTree(const urdf::ModelInterface& tree);
  void addSrdf(const Srdf& srdf);
  RobotModel take() { return std::move(model_); }

 private:
  // from the URDF
  void addLink(const urdf::ModelInterface& tree, const urdf::Link& link, int parent);
  void addJoint(const urdf::Joint& joint, RobotModel::Link& link);
  void addVariable(const urdf::Joint& joint, RobotModel::Link& link);
  void resolveMimics(const urdf::ModelInterface& tree);
  void followLeader(const urdf::ModelInterface& tree, RobotModel::Link& link);
  void narrowLeader(const RobotModel::Link& link);
  std::vector<Shape> makeShapes(const urdf::Link& link) const;
  Shape makeShape(const urdf::Collision& collision) const;

  // from the SRDF
  void addGroup(const Srdf& srdf, const SrdfGroup& group);
  void addChain(const LinkPair& ends, Group& group, std::vector<int>& links) const;
  void collectLinks(const Srdf& srdf, const SrdfGroup& group, std::set<std::string>& path, Group& out,
                    std::vector<int>& links) const;
  void setJoints(const std::vector<int>& links, Group& group) const;
  std::vector<RobotModel::ChainStep> chainSteps(const std::vector<int>& links, const Group& group) const;
  int linkOfJoint(const std::string& joint, const std::string& where) const;
  int knownLink(const std::string& link, const std::string& where) const;
  void addPassiveJoints(const std::vector<std::string>& joints);
  void addState(const SrdfState& state);
  std::string narrowedBy(int variable) const;
  Eigen::VectorXd stateValues(const SrdfState& state, const Group& group, const std::string& where) const;
  void checkFollower(const SrdfState& state, const Group& group, const std::string& joint, double value,
                     const std::string& where) const;
  void addDisabledPairs(const std::vector<LinkPair>& pairs);

  const MeshResolver& resolver_;
  const bool with_shapes_;
  RobotModel model_;
};

}  // namespace fv_robot_model
