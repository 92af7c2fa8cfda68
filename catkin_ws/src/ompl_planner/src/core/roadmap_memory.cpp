#include "roadmap_memory.h"

#include <ompl/geometric/planners/prm/LazyPRM.h>
#include <ompl/geometric/planners/prm/PRM.h>

#include <algorithm>

#include "ompl_problem.h"

namespace ompl_planner {
namespace {

namespace og = ompl::geometric;

constexpr std::size_t kKeptRoadmaps = 4;
constexpr std::size_t kMaxMilestones = 50000;  // beyond it a roadmap is slower than a new one
constexpr double kSameJointsRad = 0.01;        // the other joints tremble by less

bool isFree(Voxel voxel, UnknownSpace policy) {
  return voxel == Voxel::Free || (policy == UnknownSpace::Free && voxel == Voxel::Unknown);
}

std::size_t milestonesOf(const ompl::base::Planner& planner) {
  if (const auto* lazy = dynamic_cast<const og::LazyPRM*>(&planner)) return lazy->milestoneCount();
  return dynamic_cast<const og::PRM&>(planner).milestoneCount();
}

/// New obstacles: what was checked must be checked again.
void doubt(ompl::base::Planner& planner) {
  if (auto* lazy = dynamic_cast<og::LazyPRM*>(&planner)) {
    lazy->clearValidity();
  } else {
    planner.clear();
  }
}

bool sameRobot(const RoadmapScope& a, const RoadmapScope& b) {
  return a.others.size() == b.others.size() && (a.others - b.others).cwiseAbs().maxCoeff() < kSameJointsRad &&
         a.T_map_root.isApprox(b.T_map_root, 1e-6);
}

}  // namespace

bool onlyFreed(const VoxelGrid& older, const VoxelGrid& newer, UnknownSpace policy) {
  if (&older == &newer) return true;
  if (!newer.coversSameVoxels(older)) return false;
  for (std::size_t i = 0; i < newer.count(); ++i) {
    if (isFree(older.atOffset(i), policy) && !isFree(newer.atOffset(i), policy)) return false;
  }
  return true;
}

struct RoadmapMemory::Entry {
  std::string planner_name;
  RoadmapScope scope;
  std::shared_ptr<SearchProblem> problem;  ///< That of the running query.
  ompl::base::SpaceInformationPtr info;
  ompl::base::PlannerPtr planner;
};

RoadmapMemory::RoadmapMemory() = default;
RoadmapMemory::~RoadmapMemory() = default;

void RoadmapMemory::forget(const std::string& planner, const std::string& group) {
  entries_.erase(std::remove_if(entries_.begin(), entries_.end(),
                                [&](const auto& entry) {
                                  return entry->planner_name == planner && entry->scope.group == group;
                                }),
                 entries_.end());
}

RoadmapMemory::Entry& RoadmapMemory::entryFor(const RoadmapScope& scope, const SearchProblem& problem,
                                              const std::string& planner, std::uint32_t seed) {
  const auto known = std::find_if(entries_.begin(), entries_.end(), [&](const auto& entry) {
    return entry->planner_name == planner && entry->scope.group == scope.group &&
           entry->scope.policy == scope.policy && sameRobot(entry->scope, scope) &&
           milestonesOf(*entry->planner) < kMaxMilestones;
  });
  if (known != entries_.end()) {
    std::rotate(known, known + 1, entries_.end());
    Entry& entry = *entries_.back();
    if (!onlyFreed(*entry.scope.grid, *scope.grid, scope.policy)) doubt(*entry.planner);
    entry.scope = scope;
    *entry.problem = problem;
    return entry;
  }
  seedOmpl(seed);
  auto entry = std::make_unique<Entry>();
  entry->planner_name = planner;
  entry->scope = scope;
  entry->problem = std::make_shared<SearchProblem>(problem);
  entry->info = makeSpace(entry->problem);
  entry->planner = makePlanner(planner, entry->info, problem);
  entries_.push_back(std::move(entry));
  if (entries_.size() > kKeptRoadmaps) entries_.pop_front();
  return *entries_.back();
}

std::optional<JointPath> RoadmapMemory::findPath(const RoadmapScope& scope, const SearchProblem& problem,
                                                 const std::string& planner, std::uint32_t seed,
                                                 const std::function<bool()>& stop) {
  const QuietOmpl quiet;
  Entry& entry = entryFor(scope, problem, planner, seed);
  const auto definition = makeDefinition(entry.info, problem);
  entry.planner->clearQuery();
  entry.planner->setProblemDefinition(definition);
  if (!entry.planner->isSetup()) entry.planner->setup();
  entry.planner->solve(ompl::base::PlannerTerminationCondition(stop));
  milestones_ = milestonesOf(*entry.planner);
  auto path = exactPath(*definition);
  entry.problem->valid = nullptr;  // they speak of this query's checkers, which end with it
  entry.problem->edge_valid = nullptr;
  return path;
}

}  // namespace ompl_planner
