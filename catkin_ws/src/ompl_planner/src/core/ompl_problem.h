/// A SearchProblem as OMPL's objects. Internal: OMPL's headers are slow to compile.
#pragma once

#include <ompl/base/Planner.h>
#include <ompl/base/SpaceInformation.h>
#include <ompl/util/Console.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "path_search.h"

namespace ompl_planner {

/// OMPL complains when its generators' seed is set twice in one process, although it then does use the new
/// seed: which is what one seed per request needs. Its other messages repeat what the status says. Restored
/// on destruction.
class QuietOmpl {
 public:
  QuietOmpl() : previous_(ompl::msg::getLogLevel()) { ompl::msg::setLogLevel(ompl::msg::LOG_NONE); }
  ~QuietOmpl() { ompl::msg::setLogLevel(previous_); }
  QuietOmpl(const QuietOmpl&) = delete;
  QuietOmpl& operator=(const QuietOmpl&) = delete;

 private:
  ompl::msg::LogLevel previous_;
};

/// The next generators that OMPL makes start from this seed.
void seedOmpl(std::uint32_t seed);

/// A space whose checks ask `*problem`: its owner may put another problem of the same dimension there.
ompl::base::SpaceInformationPtr makeSpace(const std::shared_ptr<SearchProblem>& problem);

/// Sets the space's bounds, and gives the definition of start and goals.
ompl::base::ProblemDefinitionPtr makeDefinition(const ompl::base::SpaceInformationPtr& info,
                                                const SearchProblem& problem);

/// A new planner of the space. @throws std::invalid_argument for an unknown name (lists the valid ones).
ompl::base::PlannerPtr makePlanner(const std::string& name, const ompl::base::SpaceInformationPtr& info,
                                   const SearchProblem& problem);

/// The found path; empty unless it reaches a goal.
std::optional<JointPath> exactPath(const ompl::base::ProblemDefinition& definition);

}  // namespace ompl_planner
