/// The SRDF's half of RobotModelBuilder: groups, named states, disabled pairs.
#include <algorithm>
#include <cmath>

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

template <typename Item>
bool contains(const std::vector<Item>& items, const Item& item) {
  return std::find(items.begin(), items.end(), item) != items.end();
}

}  // namespace

void RobotModelBuilder::addSrdf(const Srdf& srdf) {
  if (srdf.robot != model_.name_)
    throw ModelError(
        text("the SRDF is for robot '", srdf.robot, "', the URDF for robot '", model_.name_, "'"));
  addPassiveJoints(srdf.passive_joints);
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
  group.moved_links = model_.movedLinks(group.joint_indices);
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
    if (entry.variable < 0 || entry.mimic || contains(model_.passive_joints_, entry.joint_name)) continue;
    if (contains(group.joint_indices, entry.variable)) continue;
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
    if (entry.variable >= 0 && found == indices.end()) {
      const std::string& variable = model_.joint_names_[entry.variable];
      const bool passive = contains(model_.passive_joints_, variable);
      throw ModelError(text("SRDF: the chain of group '", group.name, "' holds joint '", entry.joint_name,
                            passive ? "', which follows passive joint '" : "', which mimics '", variable,
                            passive ? "': nothing drives it" : "' outside the chain"));
    }
    steps.push_back({link, entry.variable < 0 ? -1 : static_cast<int>(found - indices.begin())});
  }
  return steps;
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

/// Passive joints that are mimics have a leader to follow: they are no variables of their own anyway.
void RobotModelBuilder::addPassiveJoints(const std::vector<std::string>& joints) {
  for (const std::string& joint : joints) {
    const RobotModel::Link& link = model_.links_[linkOfJoint(joint, "passive_joint")];
    if (link.variable >= 0 && !link.mimic) model_.passive_joints_.push_back(joint);
  }
}

void RobotModelBuilder::addState(const SrdfState& state) {
  const std::string where = text("group_state '", state.name, "' of group '", state.group, "'");
  const auto found = model_.groups_.find(state.group);
  if (found == model_.groups_.end())
    throw ModelError(text("SRDF: ", where,
                          " is for a group that does not exist; valid: ", joined(keysOf(model_.groups_))));
  const Group& group = found->second;
  const Eigen::VectorXd q = stateValues(state, group, where);
  for (const auto& [joint, value] : state.values)
    if (!contains(group.joint_names, joint)) checkFollower(state, group, joint, value, where);
  if (!model_.states_[state.group].emplace(state.name, q).second)
    throw ModelError(text("SRDF: ", where, " is defined twice"));
}

Eigen::VectorXd RobotModelBuilder::stateValues(const SrdfState& state, const Group& group,
                                               const std::string& where) const {
  Eigen::VectorXd q(group.joint_indices.size());
  for (std::size_t i = 0; i < group.joint_names.size(); ++i) {
    const auto value = state.values.find(group.joint_names[i]);
    if (value == state.values.end())
      throw ModelError(text("SRDF: ", where, " gives no value for joint '", group.joint_names[i], "'"));
    const JointLimits& limits = model_.limits_[group.joint_indices[i]];
    if (limits.bounded && (value->second < limits.lower - 1e-6 || value->second > limits.upper + 1e-6))
      throw ModelError(text("SRDF: ", where, " puts joint '", value->first, "' at ", value->second,
                            ", outside its limits [", limits.lower, ", ", limits.upper, "]",
                            narrowedBy(group.joint_indices[i])));
    q[static_cast<Eigen::Index>(i)] = value->second;
  }
  return q;
}

/// Values of joints that the group does not set: a mimic's must be what its leader gives, a fixed joint's 0;
/// a passive joint's says nothing.
void RobotModelBuilder::checkFollower(const SrdfState& state, const Group& group, const std::string& joint,
                                      double value, const std::string& where) const {
  const auto stray = [&] {
    return ModelError(
        text("SRDF: ", where, " names joint '", joint, "'; valid: ", joined(group.joint_names)));
  };
  const auto found = std::find_if(model_.links_.begin(), model_.links_.end(),
                                  [&](const RobotModel::Link& l) { return l.joint_name == joint; });
  if (found == model_.links_.end()) throw stray();
  if (contains(model_.passive_joints_, joint)) return;
  double expected = 0.0;
  if (found->variable >= 0) {
    const auto leader = state.values.find(model_.joint_names_[found->variable]);
    if (!found->mimic || leader == state.values.end()) throw stray();
    expected = found->multiplier * leader->second + found->offset;
  }
  constexpr double kRounding = 2e-3;  // [rad, m] poses are written with three or four digits
  if (std::abs(value - expected) > kRounding * std::max(1.0, std::abs(found->multiplier)))
    throw ModelError(text("SRDF: ", where, " puts joint '", joint, "' at ", value, ", but it ",
                          found->mimic ? text("mimics '", model_.joint_names_[found->variable],
                                              "', which puts it at ", expected)
                                       : std::string("is fixed"),
                          "; leave it out"));
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
