/// From a goal message to a plan: the robot's state, the map, the core.
#pragma once

#include <fv_msgs/PlanMotionAction.h>

#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "current_planner.h"
#include "map_keeper.h"
#include "node_params.h"
#include "path_publisher.h"
#include "robot_state.h"
#include "turns.h"

namespace ompl_planner {

/// Plans one goal at a time: a new one replaces the one that is being planned. Thread-safe.
class Planning {
 public:
  Planning(const CurrentPlanner& planner, const RobotState& state, MapKeeper& maps,
           const PathPublisher& paths, const NodeConfig& config);

  /// A motion that was found is shown to viewers. Everything that goes wrong is a status of the result;
  /// nothing is thrown.
  PlanResult plan(const fv_msgs::PlanMotionGoal& goal, const std::function<bool()>& cancelled,
                  const StageCallback& on_stage);

  /// Prepares the next plan of the last request's kind on a new map.
  void warm(const PlacedMap& map);

 private:
  bool fillRequest(const MotionPlanner& planner, const fv_msgs::PlanMotionGoal& goal,
                   const std::function<bool()>& cancelled, PlanRequest& request, PlanResult& failure,
                   std::string& map_frame);
  void show(const MotionPlanner& planner, const PlanRequest& request, const std::string& map_frame,
            const PlanResult& result) const;
  bool takeMap(const fv_msgs::PlanMotionGoal& goal, const std::function<bool()>& cancelled,
               PlanRequest& request, PlanResult& failure, std::string& frame);

  const CurrentPlanner& planner_;
  const RobotState& state_;
  MapKeeper& maps_;
  const PathPublisher& paths_;
  NodeConfig config_;
  Turns turns_;
  std::mutex last_mutex_;
  std::optional<PlanRequest> last_;  ///< The last request that came as far as planning.
};

}  // namespace ompl_planner
