#include "ompl_planner/path_search.h"

#include <ompl/base/SpaceInformation.h>
#include <ompl/base/goals/GoalStates.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <map>
#include <stdexcept>

namespace ompl_planner {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;
using Space = ob::RealVectorStateSpace;

JointVector toVector(const ob::State* state, unsigned int dimension) {
  return Eigen::Map<const JointVector>(state->as<Space::StateType>()->values, dimension);
}

void toState(const JointVector& q, ob::State* state) {
  Eigen::Map<JointVector>(state->as<Space::StateType>()->values, q.size()) = q;
}

class Validity : public ob::StateValidityChecker {
 public:
  Validity(const ob::SpaceInformationPtr& info, const SearchProblem& problem)
      : ob::StateValidityChecker(info), problem_(problem) {}
  bool isValid(const ob::State* state) const override {
    return problem_.valid(toVector(state, si_->getStateDimension()));
  }

 private:
  const SearchProblem& problem_;
};

class EdgeValidity : public ob::MotionValidator {
 public:
  EdgeValidity(const ob::SpaceInformationPtr& info, const SearchProblem& problem)
      : ob::MotionValidator(info), problem_(problem) {}
  bool checkMotion(const ob::State* from, const ob::State* to) const override {
    const unsigned int dimension = si_->getStateDimension();
    const JointVector end = toVector(to, dimension);
    return problem_.valid(end) && problem_.edge_valid(toVector(from, dimension), end);
  }
  bool checkMotion(const ob::State* from, const ob::State* to,
                   std::pair<ob::State*, double>& last_valid) const override {
    if (checkMotion(from, to)) return true;
    last_valid.second = 0.0;
    if (last_valid.first != nullptr) si_->copyState(last_valid.first, from);
    return false;
  }

 private:
  const SearchProblem& problem_;
};

/// OMPL complains when its generators' seed is set twice in one process, although it then does use the new seed: which is
/// what one seed per request needs. Its other messages repeat what the status says. Restored on destruction.
class QuietOmpl {
 public:
  QuietOmpl() : previous_(ompl::msg::getLogLevel()) { ompl::msg::setLogLevel(ompl::msg::LOG_NONE); }
  ~QuietOmpl() { ompl::msg::setLogLevel(previous_); }
  QuietOmpl(const QuietOmpl&) = delete;
  QuietOmpl& operator=(const QuietOmpl&) = delete;

 private:
  ompl::msg::LogLevel previous_;
};

ob::SpaceInformationPtr makeSpace(const SearchProblem& problem) {
  const auto dimension = static_cast<unsigned int>(problem.lower.size());
  auto space = std::make_shared<Space>(dimension);
  ob::RealVectorBounds bounds(dimension);
  for (unsigned int i = 0; i < dimension; ++i) {
    bounds.setLow(i, problem.lower[i]);
    bounds.setHigh(i, problem.upper[i]);
  }
  space->setBounds(bounds);
  auto info = std::make_shared<ob::SpaceInformation>(space);
  info->setStateValidityChecker(std::make_shared<Validity>(info, problem));
  info->setMotionValidator(std::make_shared<EdgeValidity>(info, problem));
  info->setup();
  return info;
}

ob::ProblemDefinitionPtr makeDefinition(const ob::SpaceInformationPtr& info, const SearchProblem& problem) {
  auto definition = std::make_shared<ob::ProblemDefinition>(info);
  ob::ScopedState<Space> state(info);
  toState(problem.start, state.get());
  definition->addStartState(state);
  auto goals = std::make_shared<ob::GoalStates>(info);
  for (const JointVector& q : problem.goals) {
    toState(q, state.get());
    goals->addState(state);
  }
  definition->setGoal(goals);
  return definition;
}

using Factory = ob::PlannerPtr (*)(const ob::SpaceInformationPtr&, const SearchProblem&);

ob::PlannerPtr makeRrtConnect(const ob::SpaceInformationPtr& info, const SearchProblem& problem) {
  auto planner = std::make_shared<og::RRTConnect>(info);
  planner->setRange(problem.range_rad);
  return planner;
}

const std::map<std::string, Factory>& factories() {
  static const std::map<std::string, Factory> table{{"RRTConnect", &makeRrtConnect}};
  return table;
}

}  // namespace

const std::vector<std::string>& plannerNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const auto& [name, factory] : factories()) list.push_back(name);
    return list;
  }();
  return names;
}

std::optional<JointPath> findPath(const SearchProblem& problem, const std::string& planner, std::uint32_t seed,
                                  const std::function<bool()>& stop) {
  const auto factory = factories().find(planner);
  if (factory == factories().end()) {
    std::string valid;
    for (const auto& name : plannerNames()) valid += (valid.empty() ? "" : ", ") + name;
    throw std::invalid_argument("unknown planner '" + planner + "'; valid: " + valid);
  }
  const QuietOmpl quiet;
  ompl::RNG::setSeed(seed + 1U == 0U ? 1U : seed + 1U);  // OMPL takes 0 for "any"
  const auto info = makeSpace(problem);
  const auto definition = makeDefinition(info, problem);
  const auto search = factory->second(info, problem);
  search->setProblemDefinition(definition);
  search->setup();
  search->solve(ob::PlannerTerminationCondition(stop));
  if (!definition->hasExactSolution()) return std::nullopt;
  const auto* solution = definition->getSolutionPath()->as<og::PathGeometric>();
  JointPath path;
  for (std::size_t i = 0; i < solution->getStateCount(); ++i) {
    path.push_back(toVector(solution->getState(static_cast<unsigned int>(i)), info->getStateDimension()));
  }
  return path;
}

}  // namespace ompl_planner
