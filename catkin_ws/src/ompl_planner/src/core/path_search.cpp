#include "path_search.h"

#include <ompl/base/SpaceInformation.h>
#include <ompl/base/goals/GoalStates.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/planners/informedtrees/BITstar.h>
#include <ompl/geometric/planners/prm/LazyPRM.h>
#include <ompl/geometric/planners/prm/PRM.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/geometric/planners/rrt/RRTstar.h>
#include <ompl/util/RandomNumbers.h>

#include <algorithm>
#include <map>
#include <stdexcept>

#include "ompl_problem.h"

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
  Validity(const ob::SpaceInformationPtr& info, std::shared_ptr<const SearchProblem> problem)
      : ob::StateValidityChecker(info), problem_(std::move(problem)) {}
  bool isValid(const ob::State* state) const override {
    return problem_->valid(toVector(state, si_->getStateDimension()));
  }

 private:
  std::shared_ptr<const SearchProblem> problem_;
};

class EdgeValidity : public ob::MotionValidator {
 public:
  EdgeValidity(const ob::SpaceInformationPtr& info, std::shared_ptr<const SearchProblem> problem)
      : ob::MotionValidator(info), problem_(std::move(problem)) {}
  bool checkMotion(const ob::State* from, const ob::State* to) const override {
    const unsigned int dimension = si_->getStateDimension();
    const JointVector end = toVector(to, dimension);
    return problem_->valid(end) && problem_->edge_valid(toVector(from, dimension), end);
  }
  bool checkMotion(const ob::State* from, const ob::State* to,
                   std::pair<ob::State*, double>& last_valid) const override {
    if (checkMotion(from, to)) return true;
    last_valid.second = 0.0;
    if (last_valid.first != nullptr) si_->copyState(last_valid.first, from);
    return false;
  }

 private:
  std::shared_ptr<const SearchProblem> problem_;
};

void setBounds(const ob::SpaceInformation& info, const SearchProblem& problem) {
  const unsigned int dimension = info.getStateDimension();
  ob::RealVectorBounds bounds(dimension);
  for (unsigned int i = 0; i < dimension; ++i) {
    bounds.setLow(i, problem.lower[i]);
    bounds.setHigh(i, problem.upper[i]);
  }
  info.getStateSpace()->as<Space>()->setBounds(bounds);
}

struct Kind {
  ob::PlannerPtr (*make)(const ob::SpaceInformationPtr&, const SearchProblem&);
  bool improves;  ///< Goes on after the first path.
  bool roadmap;   ///< Serves more than one query.
};

template <typename Planner>
ob::PlannerPtr make(const ob::SpaceInformationPtr& info, const SearchProblem&) {
  return std::make_shared<Planner>(info);
}

template <typename Planner>
ob::PlannerPtr makeWithRange(const ob::SpaceInformationPtr& info, const SearchProblem& problem) {
  auto planner = std::make_shared<Planner>(info);
  planner->setRange(problem.range_rad);
  return planner;
}

const std::map<std::string, Kind>& kinds() {
  static const std::map<std::string, Kind> table{
      {"BITstar", {&make<og::BITstar>, true, false}},
      {"LazyPRM", {&make<og::LazyPRM>, false, true}},
      {"PRM", {&make<og::PRM>, false, true}},
      {"RRTConnect", {&makeWithRange<og::RRTConnect>, false, false}},
      {"RRTstar", {&makeWithRange<og::RRTstar>, true, false}}};
  return table;
}

/// Ends when stop fires or after so many rounds (0: no matter how many): counted, so that equal requests give
/// equal paths.
ob::PlannerTerminationCondition termination(const std::function<bool()>& stop, std::size_t rounds) {
  if (rounds == 0) return ob::PlannerTerminationCondition(stop);
  auto left = std::make_shared<std::size_t>(rounds);
  return ob::PlannerTerminationCondition([stop, left] {
    if (*left > 0) --*left;
    return *left == 0 || stop();
  });
}

}  // namespace

const std::vector<std::string>& plannerNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const auto& [name, kind] : kinds()) list.push_back(name);
    return list;
  }();
  return names;
}

void checkPlannerName(const std::string& name) {
  if (kinds().count(name) != 0) return;
  std::string valid;
  for (const auto& known : plannerNames()) valid += (valid.empty() ? "" : ", ") + known;
  throw std::invalid_argument("unknown planner '" + name + "'; valid: " + valid);
}

bool keepsRoadmap(const std::string& planner) {
  checkPlannerName(planner);
  return kinds().at(planner).roadmap;
}

bool isWorthRepeating(const std::string& planner) {
  checkPlannerName(planner);
  return !kinds().at(planner).roadmap && !kinds().at(planner).improves;
}

void seedOmpl(std::uint32_t seed) {
  ompl::RNG::setSeed(seed + 1U == 0U ? 1U : seed + 1U);  // OMPL takes 0 for "any"
}

ob::SpaceInformationPtr makeSpace(const std::shared_ptr<SearchProblem>& problem) {
  auto info = std::make_shared<ob::SpaceInformation>(
      std::make_shared<Space>(static_cast<unsigned int>(problem->lower.size())));
  setBounds(*info, *problem);
  info->setStateValidityChecker(std::make_shared<Validity>(info, problem));
  info->setMotionValidator(std::make_shared<EdgeValidity>(info, problem));
  info->setup();
  return info;
}

ob::ProblemDefinitionPtr makeDefinition(const ob::SpaceInformationPtr& info, const SearchProblem& problem) {
  setBounds(*info, problem);
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

ob::PlannerPtr makePlanner(const std::string& name, const ob::SpaceInformationPtr& info,
                           const SearchProblem& problem) {
  checkPlannerName(name);
  return kinds().at(name).make(info, problem);
}

std::optional<JointPath> exactPath(const ob::ProblemDefinition& definition) {
  if (!definition.hasExactSolution()) return std::nullopt;
  const auto* solution = definition.getSolutionPath()->as<og::PathGeometric>();
  const unsigned int dimension = definition.getSpaceInformation()->getStateDimension();
  JointPath path;
  for (std::size_t i = 0; i < solution->getStateCount(); ++i) {
    path.push_back(toVector(solution->getState(static_cast<unsigned int>(i)), dimension));
  }
  return path;
}

SearchProblem shorterThan(const SearchProblem& problem, double length) {
  SearchProblem informed = problem;
  informed.valid = [start = problem.start, goals = problem.goals, valid = problem.valid,
                    length](const JointVector& q) {
    const double left = length - (q - start).norm();
    return std::any_of(goals.begin(), goals.end(),
                       [&](const JointVector& goal) { return (q - goal).norm() < left; }) &&
           valid(q);
  };
  return informed;
}

std::optional<JointPath> findPath(const SearchProblem& problem, const std::string& planner,
                                  std::uint32_t seed, const std::function<bool()>& stop) {
  checkPlannerName(planner);
  const QuietOmpl quiet;
  seedOmpl(seed);
  const auto info = makeSpace(std::make_shared<SearchProblem>(problem));
  const auto definition = makeDefinition(info, problem);
  const auto search = makePlanner(planner, info, problem);
  search->setProblemDefinition(definition);
  search->setup();
  search->solve(
      termination(stop, kinds().at(planner).improves ? problem.quality_rounds : problem.search_rounds));
  return exactPath(*definition);
}

}  // namespace ompl_planner
