/// Parameters of the planner, with their defaults. config/planner.yaml ships the same values with units.
#pragma once

#include <map>
#include <string>
#include <variant>
#include <vector>

#include "ompl_planner/time_parameterization.h"

namespace ompl_planner {

/// A parameter's value as YAML has it.
using ConfigValue = std::variant<bool, double, std::string>;

struct PlannerConfig {
  std::string planner{"RRTConnect"};  ///< Planner when a request names none.
  std::string world_check{
      "distance_field"};          ///< Of the search: distance_field, or fcl_octree (slow, a reference).
  double time_budget_s{5.0};      ///< Computing time of a request that names none [s].
  double padding_m{0.01};         ///< Links keep this distance from the map's obstacles [m].
  double search_margin_m{0.004};  ///< More than padding_m while searching: the judge samples elsewhere [m].
  double self_padding_m{0.0015};  ///< Links grow by this much against each other [m].
  double self_search_margin_m{0.0005};  ///< More than self_padding_m while searching [m].
  double start_tolerance_m{0.02};  ///< Start links may reach this deep (padding included) into voxels [m].
  double joint_step_rad{0.0087};   ///< Largest joint step between checked states [rad], 0.5 degrees.
  double search_step_rad{
      0.035};               ///< The same within the search; its result is checked at joint_step_rad [rad].
  double field_cap_m{0.3};  ///< Distances to obstacles above this are not told apart [m].
  double limit_tolerance_rad{0.02};    ///< A start this far beyond a joint limit is accepted [rad].
  double position_tolerance_m{0.005};  ///< Of goal poses, when a request names none [m].
  double angle_tolerance_rad{0.02};    ///< Of goal poses, when a request names none [rad].
  double quality_rounds{3000};    ///< Rounds of planners that go on improving their path (RRTstar, BITstar).
  double range_rad{0.6};          ///< Longest extension of the search trees [rad].
  double ik_rounds{16};           ///< Rolls, then poses within the tolerances, tried for each goal pose.
  double ik_step_rad{0.2};        ///< Step of redundant joints in inverse kinematics [rad].
  double ik_starts{4};            ///< Starts of inverse kinematics for arms without a closed form.
  double max_goal_states{8};      ///< Collision-free goal states that the search aims at.
  double detour_ratio{1.15};      ///< Paths this much longer than the straight line are searched for anew.
  double detour_searches{6};      ///< So often at most.
  double detour_rounds{3000};     ///< Rounds after which such a search gives up.
  double shortcut_rounds{60};     ///< Random shortcuts tried on a found path.
  double blend_radius_rad{0.3};   ///< Largest rounding of the path's corners [rad].
  double sample_period_s{0.01};   ///< Spacing of the trajectory's points [s].
  double smoothing_time_s{0.02};  ///< Width of acceleration ramps [s].
  double limit_share{0.975};      ///< Share of velocity and acceleration limits that is used.
  double default_max_velocity{1.0};      ///< For joints without a velocity limit anywhere [rad/s].
  double default_max_acceleration{2.0};  ///< For joints without an acceleration limit [rad/s^2].

  /// Overwrites members by name. @throws std::invalid_argument for an unknown name (lists the valid ones), a
  /// wrong type, or a value out of range.
  void set(const std::map<std::string, ConfigValue>& values);
  /// All members by name.
  std::map<std::string, ConfigValue> values() const;
  /// @throws std::invalid_argument naming the first member that is out of range.
  void validate() const;

  TimingOptions timing() const;
};

}  // namespace ompl_planner
