/// The actions /ompl_planner/plan, /ompl_planner/execute and /ompl_planner/plan_and_execute.
#pragma once

#include <actionlib/server/simple_action_server.h>
#include <fv_msgs/ExecuteMotionAction.h>
#include <fv_msgs/PlanAndExecuteAction.h>
#include <fv_msgs/PlanMotionAction.h>

#include <atomic>
#include <functional>
#include <string>

#include "execution.h"
#include "planning.h"

namespace ompl_planner {

/// An action whose goals are handled one after the other; a new goal cancels the one before it.
template <typename Action>
class ActionServer {
 public:
  using Server = actionlib::SimpleActionServer<Action>;
  using GoalPtr = typename Server::GoalConstPtr;

  /// @param handle Gives the goal's end to the server; asks `cancelled()` meanwhile.
  ActionServer(ros::NodeHandle& nh, const std::string& name,
               std::function<void(ActionServer&, const GoalPtr&)> handle)
      : server_(
            nh, name,
            [this, handle](const GoalPtr& goal) {
              cancel_ = server_.isPreemptRequested();
              handle(*this, goal);
            },
            /*auto_start=*/false) {
    server_.registerPreemptCallback([this] { cancel_ = true; });
    server_.start();
  }
  ~ActionServer() {
    cancel_ = true;
    server_.shutdown();
  }
  ActionServer(const ActionServer&) = delete;
  ActionServer& operator=(const ActionServer&) = delete;

  Server& server() { return server_; }
  bool cancelled() const { return cancel_; }

 private:
  std::atomic<bool> cancel_{false};
  Server server_;
};

/// All three, on the same planning and execution.
class ActionServers {
 public:
  ActionServers(ros::NodeHandle& nh, Planning& planning, Execution& execution);

 private:
  using PlanServer = ActionServer<fv_msgs::PlanMotionAction>;
  using ExecuteServer = ActionServer<fv_msgs::ExecuteMotionAction>;
  using PlanAndExecuteServer = ActionServer<fv_msgs::PlanAndExecuteAction>;

  void plan(PlanServer& action, const fv_msgs::PlanMotionGoal& goal);
  void execute(ExecuteServer& action, const fv_msgs::ExecuteMotionGoal& goal);
  void planAndExecute(PlanAndExecuteServer& action, const fv_msgs::PlanAndExecuteGoal& goal);

  Planning& planning_;
  Execution& execution_;
  PlanServer plan_;
  ExecuteServer execute_;
  PlanAndExecuteServer plan_and_execute_;
};

}  // namespace ompl_planner
