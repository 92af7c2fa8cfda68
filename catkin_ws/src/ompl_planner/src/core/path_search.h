/// OMPL behind a few functions: only src/core/path_search.cpp and roadmap_memory.cpp include it.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "ompl_planner/blended_path.h"

namespace ompl_planner {

/// What a search needs to know of the space.
struct SearchProblem {
  JointVector lower;  ///< [rad]
  JointVector upper;  ///< [rad]
  JointVector start;
  JointPath goals;  ///< Aimed at in this order.
  std::function<bool(const JointVector&)> valid;
  std::function<bool(const JointVector&, const JointVector&)> edge_valid;
  double range_rad{0.6};
  std::size_t quality_rounds{3000};  ///< For planners that go on improving a path.
  std::size_t search_rounds{0};      ///< For the others: they give up after so many; 0: when `stop` fires.
};

/// The same search among the states that a path shorter than `length` [rad] can pass: an ellipsoid about the
/// start and each goal (Gammell et al., Informed RRT*, IROS 2014, equation 1).
SearchProblem shorterThan(const SearchProblem& problem, double length);

/// Names that findPath accepts.
const std::vector<std::string>& plannerNames();
/// @throws std::invalid_argument, listing the valid ones, unless `name` is one of them.
void checkPlannerName(const std::string& name);
/// Does the planner build a roadmap that serves more than one query? RoadmapMemory keeps those.
bool keepsRoadmap(const std::string& planner);

/// Does another seed give another path, at little cost?
bool isWorthRepeating(const std::string& planner);

/// A collision-free polyline from the start to one of the goals; empty when `stop` fired first or there is
/// none.
///
/// One fresh planner per call; but for PRM, which looks for solutions in a second thread, equal problems and
/// seeds give equal paths. OMPL draws the seeds of all its generators from one global sequence that this
/// function restarts, so calls must not overlap.
/// @throws std::invalid_argument for an unknown planner (lists the valid ones).
std::optional<JointPath> findPath(const SearchProblem& problem, const std::string& planner,
                                  std::uint32_t seed, const std::function<bool()>& stop);

}  // namespace ompl_planner
