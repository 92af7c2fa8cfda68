/// A planning request and its answer, without ROS. The numbers of the enums are those of fv_msgs/PlanMotion.
#pragma once

#include <Eigen/Geometry>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "ompl_planner/time_parameterization.h"
#include "ompl_planner/voxel_grid.h"

namespace ompl_planner {

/// The one condition that ends a computation: time is up (steady clock, never ROS time) or somebody
/// cancelled.
class StopCondition {
 public:
  /// @param cancelled May be empty; asked often, so it must be quick.
  StopCondition(double budget_s, std::function<bool()> cancelled)
      : deadline_(std::chrono::steady_clock::now() +
                  std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                      std::chrono::duration<double>(budget_s))),
        cancelled_(std::move(cancelled)) {}
  bool cancelled() const { return cancelled_ && cancelled_(); }
  bool operator()() const { return cancelled() || std::chrono::steady_clock::now() >= deadline_; }

 private:
  std::chrono::steady_clock::time_point deadline_;
  std::function<bool()> cancelled_;
};

enum class PlanStatus : std::uint8_t {
  Success = 1,
  InvalidRequest = 2,
  StartInCollision = 3,
  StartInUnknown = 4,
  NoIkSolution = 5,
  GoalsInCollision = 6,
  NoPath = 7,
  NoMap = 8,
  MapTooOld = 9,
  NoJointStates = 10,
  Cancelled = 11,
  InternalError = 12
};

enum class GoalType : std::uint8_t { Joints = 0, Named = 1, Poses = 2 };

/// The map as the planner keeps it.
struct MapSnapshot {
  std::uint64_t sequence{0};
  std::shared_ptr<const VoxelGrid> grid;
};

struct PlanRequest {
  std::string group;
  Eigen::VectorXd start_all;  ///< Every joint of the model, as RobotModel::jointNames().
  Eigen::Isometry3d T_map_root{Eigen::Isometry3d::Identity()};
  MapSnapshot map;

  GoalType goal_type{GoalType::Joints};
  std::vector<std::pair<std::string, double>> goal_joints;  ///< Joints of the group that are not named stay.
  std::string goal_name;                                    ///< SRDF group_state.
  bool exact_turns{false};  ///< Continuous joints: the goal's very value, not the nearest equal angle.
  std::string tip_link;     ///< Empty: the group's tip.
  std::vector<Eigen::Isometry3d> goal_poses;  ///< T_map_tip.
  std::vector<double> goal_scores;            ///< Empty, or one per pose; higher is better.
  double position_tolerance_m{0.0};           ///< 0: configured default.
  double angle_tolerance_rad{0.0};            ///< 0: configured default.
  bool free_roll{false};
  Eigen::Vector3d roll_axis{Eigen::Vector3d::UnitZ()};  ///< Of a free roll, tip frame; not zero.
  std::vector<JointVector> goal_seeds;  ///< Empty, or joint values near solutions, one per pose.

  std::string planner;        ///< Empty: configured default.
  double time_budget_s{0.0};  ///< 0: configured default.
  std::uint32_t seed{0};
  UnknownSpace unknown_space{UnknownSpace::Obstacle};
  double bubble_radius_m{0.0};
};

struct PlanResult {
  PlanStatus status{PlanStatus::InternalError};
  std::string message;
  std::vector<std::string> joint_names;
  TimedTrajectory trajectory;
  JointPath waypoints;  ///< The path before its corners were rounded.
  int goal_index{-1};
  std::uint64_t map_sequence{0};
  double path_length{0.0};  ///< [rad]
  double clearance_m{-1.0};
  std::uint32_t poses_tried{0};
  std::uint32_t poses_reachable{0};
  std::uint32_t goal_states{0};
  std::size_t roadmap_states{0};                       ///< Of the kept roadmap that was used; 0: none.
  std::vector<std::pair<std::string, double>> stages;  ///< Name and seconds.
};

}  // namespace ompl_planner
