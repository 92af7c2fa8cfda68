/// The SRDF's half of RobotModelBuilder: groups, named states, disabled pairs.
#include <algorithm>

#include "internal.h"
#include "robot_model_builder.h"

namespace fv_robot_model {
namespace {

const SrdfGroup& findGroup(const Srdf& srdf, const std::string& name, const std::string& user) {
  std::vector<std::string> names;
  for (const SrdfGroup& group : srdf.groups) {
    if (group.name == name) return group;
    names.push_back(group.name);
  }
  throw ModelError(text("SRDF: group '", user, "' contains group '", name,
                        "', which does not exist; valid: ", joined(names)));
}

}  // namespace

void RobotModelBuilder::addSrdf(const Srdf& srdf) {
  if (srdf.robot != model_.name_)
    throw ModelError(
        text("the SRDF is for robot '", srdf.robot, "', the URDF for robot '", model_.name_, "'"));
  for (const SrdfGroup& group : srdf.groups) addGroup(srdf, group);
  for (const SrdfState& state : srdf.states) addState(state);
  addDisabledPairs(srdf.disabled_pairs);
}

void RobotModelBuilder::addGroup(const Srdf& srdf, const SrdfGroup& srdf_group) {
  if (model_.groups_.count(srdf_group.name) != 0)
    throw ModelError(text("SRDF: group '", srdf_group.name, "' is defined twice"));
  Group group;
  group.name = srdf_group.name;
  std::vector<int> links;
  std::set<std::string> path;
  collectLinks(srdf, srdf_group, path, group, links);
  const bool is_chain = srdf_group.chains.size() == 1 && srdf_group.joints.empty() &&
                        srdf_group.links.empty() && srdf_group.groups.empty();
  if (!is_chain) {
    group.base_link = group.tip_link = "";
    std::sort(links.begin(), links.end());
  }
  setJoints(links, group);
  if (group.joint_indices.empty())
    throw ModelError(text("SRDF: group '", group.name, "' has no joint that moves"));
  group.moved_links = movedLinks(group);
  if (is_chain) model_.chain_steps_[group.name] = chainSteps(links, group);
  model_.groups_[group.name] = std::move(group);
}

void RobotModelBuilder::collectLinks(const Srdf& srdf, const SrdfGroup& srdf_group,
                                     std::set<std::string>& path, Group& out, std::vector<int>& links) const {
  if (!path.insert(srdf_group.name).second)
    throw ModelError(text("SRDF: group '", srdf_group.name, "' contains itself"));
  const std::string where = text("group '", srdf_group.name, "'");
  for (const LinkPair& ends : srdf_group.chains) addChain(ends, out, links);
  for (const std::string& joint : srdf_group.joints) links.push_back(linkOfJoint(joint, where));
  for (const std::string& link : srdf_group.links) links.push_back(knownLink(link, where));
  for (const std::string& name : srdf_group.groups)
    collectLinks(srdf, findGroup(srdf, name, srdf_group.name), path, out, links);
  path.erase(srdf_group.name);
}

void RobotModelBuilder::addChain(const LinkPair& ends, Group& group, std::vector<int>& links) const {
  const std::string where = text("the chain of group '", group.name, "'");
  const int base = knownLink(ends.first, where);
  std::vector<int> chain;
  for (int link = knownLink(ends.second, where); link != base; link = model_.links_[link].parent) {
    if (link < 0)
      throw ModelError(text("SRDF: ", where, " is none: '", ends.first, "' is not above '", ends.second,
                            "' in the tree of links (a chain may not branch)"));
    chain.push_back(link);
  }
  links.insert(links.end(), chain.rbegin(), chain.rend());
  group.base_link = ends.first;
  group.tip_link = ends.second;
}

void RobotModelBuilder::setJoints(const std::vector<int>& links, Group& group) const {
  for (const int link : links) {
    const RobotModel::Link& entry = model_.links_[link];
    if (entry.variable < 0 || entry.mimic) continue;
    const auto& known = group.joint_indices;
    if (std::find(known.begin(), known.end(), entry.variable) != known.end()) continue;
    group.joint_indices.push_back(entry.variable);
    group.joint_names.push_back(entry.joint_name);
  }
}

std::vector<RobotModel::ChainStep> RobotModelBuilder::chainSteps(const std::vector<int>& links,
                                                                 const Group& group) const {
  std::vector<RobotModel::ChainStep> steps;
  const auto& indices = group.joint_indices;
  for (const int link : links) {
    const RobotModel::Link& entry = model_.links_[link];
    const auto found = std::find(indices.begin(), indices.end(), entry.variable);
    if (entry.variable >= 0 && found == indices.end())
      throw ModelError(text("SRDF: the chain of group '", group.name, "' holds joint '", entry.joint_name,
                            "', which mimics '", model_.joint_names_[entry.variable], "' outside the chain"));
    steps.push_back({link, entry.variable < 0 ? -1 : static_cast<int>(found - indices.begin())});
  }
  return steps;
}

/// A link moves when its own joint does or its parent moves; parents come first in the numbering.
std::vector<int> RobotModelBuilder::movedLinks(const Group& group) const {
  std::vector<int> moved;
  std::vector<bool> moves(model_.links_.size(), false);
  for (std::size_t i = 1; i < model_.links_.size(); ++i) {
    const RobotModel::Link& link = model_.links_[i];
    const auto& indices = group.joint_indices;
    moves[i] =
        moves[link.parent] || std::find(indices.begin(), indices.end(), link.variable) != indices.end();
    if (moves[i]) moved.push_back(static_cast<int>(i));
  }
  return moved;
}

int RobotModelBuilder::linkOfJoint(const std::string& joint, const std::string& where) const {
  std::vector<std::string> names;
  for (std::size_t i = 1; i < model_.links_.size(); ++i) {
    if (model_.links_[i].joint_name == joint) return static_cast<int>(i);
    names.push_back(model_.links_[i].joint_name);
  }
  throw ModelError(text("SRDF: ", where, " names joint '", joint,
                        "', which the URDF does not have; valid: ", joined(names)));
}

int RobotModelBuilder::knownLink(const std::string& link, const std::string& where) const {
  const auto& names = model_.link_names_;
  const auto found = std::find(names.begin(), names.end(), link);
  if (found == names.end())
    throw ModelError(text("SRDF: ", where, " names link '", link,
                          "', which the URDF does not have; valid: ", joined(names)));
  return static_cast<int>(found - names.begin());
}

void RobotModelBuilder::addState(const SrdfState& state) {
  const std::string where = text("group_state '", state.name, "' of group '", state.group, "'");
  const auto found = model_.groups_.find(state.group);
  if (found == model_.groups_.end())
    throw ModelError(text("SRDF: ", where,
                          " is for a group that does not exist; valid: ", joined(keysOf(model_.groups_))));
  const Group& group = found->second;
  Eigen::VectorXd q(group.joint_indices.size());
  for (std::size_t i = 0; i < group.joint_names.size(); ++i) {
    const auto value = state.values.find(group.joint_names[i]);
    if (value == state.values.end())
      throw ModelError(text("SRDF: ", where, " gives no value for joint '", group.joint_names[i], "'"));
    const JointLimits& limits = model_.limits_[group.joint_indices[i]];
    if (limits.bounded && (value->second < limits.lower - 1e-6 || value->second > limits.upper + 1e-6))
      throw ModelError(text("SRDF: ", where, " puts joint '", value->first, "' at ", value->second,
                            ", outside its limits [", limits.lower, ", ", limits.upper, "]"));
    q[static_cast<Eigen::Index>(i)] = value->second;
  }
  for (const auto& [joint, value] : state.values)
    if (std::find(group.joint_names.begin(), group.joint_names.end(), joint) == group.joint_names.end())
      throw ModelError(
          text("SRDF: ", where, " names joint '", joint, "'; valid: ", joined(group.joint_names)));
  if (!model_.states_[state.group].emplace(state.name, q).second)
    throw ModelError(text("SRDF: ", where, " is defined twice"));
}

void RobotModelBuilder::addDisabledPairs(const std::vector<LinkPair>& pairs) {
  std::set<LinkPair> sorted;
  for (const LinkPair& pair : pairs) {
    knownLink(pair.first, "disable_collisions");
    knownLink(pair.second, "disable_collisions");
    sorted.insert(std::minmax(pair.first, pair.second));
  }
  model_.disabled_pairs_.assign(sorted.begin(), sorted.end());
}

}  // namespace fv_robot_model
