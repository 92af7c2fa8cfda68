#include <memory>
#include <stdexcept>
#include <string_view>

#include "bindings.h"
#include "convert.h"
#include "octree_collision.h"
#include "ompl_planner/motion_planner.h"
#include "path_search.h"
#include "prepared_world.h"
#include "scenes.h"
#include "state_checker.h"

namespace py = pybind11;

namespace ompl_planner {
namespace {

using Config = std::map<std::string, ConfigValue>;
using Rates = std::map<std::string, std::pair<double, double>>;

std::shared_ptr<MotionPlanner> makePlanner(const std::string& urdf, const std::string& srdf,
                                           const Rates& rates, const Config& config,
                                           const std::map<std::string, std::string>& package_folders) {
  auto model = std::make_shared<fv_robot_model::RobotModel>(
      fv_robot_model::RobotModel::fromXml(urdf, srdf, fv_robot_model::packageResolver(package_folders)));
  std::map<std::string, JointRates> joint_rates;
  for (const auto& [name, rate] : rates) joint_rates[name] = {rate.first, rate.second};
  PlannerConfig planner_config;
  planner_config.set(config);
  return std::make_shared<MotionPlanner>(model, joint_rates, planner_config);
}

Eigen::Isometry3d isometryFrom(const Eigen::Matrix4d& matrix) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.matrix() = matrix;
  return T;
}

MapSnapshot snapshot(const py::bytes& payload, double resolution_m, std::uint64_t sequence,
                     const MotionPlanner& planner, const Eigen::Matrix4d& T_map_root) {
  const std::string_view data = payload;
  const py::gil_scoped_release release;
  const auto region = planner.reach(isometryFrom(T_map_root));
  return {sequence, std::make_shared<VoxelGrid>(
                        VoxelGrid::fromBinaryPayload(data.data(), data.size(), resolution_m, region))};
}

py::dict resultToDict(const PlanResult& result) {
  using namespace py::literals;
  return py::dict("status"_a = result.status, "message"_a = result.message,
                  "joint_names"_a = result.joint_names, "trajectory"_a = trajectoryToDict(result.trajectory),
                  "waypoints"_a = rowsFromPath(result.waypoints), "goal_index"_a = result.goal_index,
                  "map_sequence"_a = result.map_sequence, "path_length"_a = result.path_length,
                  "clearance_m"_a = result.clearance_m, "poses_tried"_a = result.poses_tried,
                  "poses_reachable"_a = result.poses_reachable, "goal_states"_a = result.goal_states,
                  "stages"_a = result.stages, "roadmap_states"_a = result.roadmap_states);
}

/// Answers of one checker for many states of a group.
std::vector<bool> checkStates(const MotionPlanner& planner, const PlanRequest& request,
                              const RowMatrix& states, const std::string& checker, bool with_self) {
  const auto& model = planner.model();
  const auto& group = model.group(request.group);
  const auto poses = model.forward(request.start_all);
  const double padding = planner.config().padding_m;
  WorldMemory memory(planner.config().field_cap_m, padding, checker == "fcl_octree");
  const auto world = memory.get(request.map.grid, request.unknown_space, request.bubble_radius_m, model,
                                group, poses, request.T_map_root);
  const auto judge =
      std::make_shared<WorldCollision>(memory.bodies(model, group, padding), request.T_map_root, world.grid,
                                       world.outside_is_free, world.blocks);
  std::shared_ptr<const WorldCheck> check;
  if (checker == "distance_field") {
    check = std::make_shared<FastCollision>(world.covers, world.field, judge, request.T_map_root);
  } else if (checker == "fcl_octree") {
    check = std::make_shared<OctreeCollision>(model, group, request.T_map_root, world.octree, judge, padding);
  } else if (checker != "judge") {
    throw std::invalid_argument("unknown checker '" + checker +
                                "'; valid: distance_field, fcl_octree, judge");
  }
  const auto self = with_self ? std::make_shared<fv_robot_model::SelfCollision>(model, group) : nullptr;
  const StateChecker state_checker(model, group, request.start_all, judge, self,
                                   planner.config().joint_step_rad, check);
  std::vector<bool> valid(static_cast<std::size_t>(states.rows()));
  for (Eigen::Index i = 0; i < states.rows(); ++i) {
    valid[static_cast<std::size_t>(i)] = state_checker.valid(states.row(i).transpose());
  }
  return valid;
}

void bindRequest(py::module_& m) {
  py::enum_<GoalType>(m, "GoalType")
      .value("JOINTS", GoalType::Joints)
      .value("NAMED", GoalType::Named)
      .value("POSES", GoalType::Poses);
  py::enum_<PlanStatus>(m, "PlanStatus", "How planning ended, as fv_msgs/PlanMotion names it.")
      .value("SUCCESS", PlanStatus::Success)
      .value("INVALID_REQUEST", PlanStatus::InvalidRequest)
      .value("START_IN_COLLISION", PlanStatus::StartInCollision)
      .value("START_IN_UNKNOWN", PlanStatus::StartInUnknown)
      .value("NO_IK_SOLUTION", PlanStatus::NoIkSolution)
      .value("GOALS_IN_COLLISION", PlanStatus::GoalsInCollision)
      .value("NO_PATH", PlanStatus::NoPath)
      .value("NO_MAP", PlanStatus::NoMap)
      .value("MAP_TOO_OLD", PlanStatus::MapTooOld)
      .value("NO_JOINT_STATES", PlanStatus::NoJointStates)
      .value("CANCELLED", PlanStatus::Cancelled)
      .value("INTERNAL_ERROR", PlanStatus::InternalError);
  py::enum_<UnknownSpace>(m, "UnknownSpace")
      .value("OBSTACLE", UnknownSpace::Obstacle)
      .value("FREE", UnknownSpace::Free)
      .value("FREE_NEAR_START", UnknownSpace::FreeNearStart);
  py::class_<MapSnapshot>(m, "MapSnapshot", "A dense copy of a map about one robot.")
      .def_readonly("sequence", &MapSnapshot::sequence);
  py::class_<PlanRequest>(m, "PlanRequest", "Fields as fv_msgs/PlanMotion; poses are T_map_tip.")
      .def(py::init<>())
      .def_readwrite("group", &PlanRequest::group)
      .def_readwrite("start_all", &PlanRequest::start_all)
      .def_readwrite("map", &PlanRequest::map)
      .def_readwrite("goal_type", &PlanRequest::goal_type)
      .def_readwrite("goal_joints", &PlanRequest::goal_joints)
      .def_readwrite("goal_name", &PlanRequest::goal_name)
      .def_readwrite("exact_turns", &PlanRequest::exact_turns)
      .def_readwrite("tip_link", &PlanRequest::tip_link)
      .def_readwrite("goal_scores", &PlanRequest::goal_scores)
      .def_readwrite("position_tolerance_m", &PlanRequest::position_tolerance_m)
      .def_readwrite("angle_tolerance_rad", &PlanRequest::angle_tolerance_rad)
      .def_readwrite("free_roll", &PlanRequest::free_roll)
      .def_readwrite("roll_axis", &PlanRequest::roll_axis)
      .def_readwrite("goal_seeds", &PlanRequest::goal_seeds)
      .def_readwrite("planner", &PlanRequest::planner)
      .def_readwrite("time_budget_s", &PlanRequest::time_budget_s)
      .def_readwrite("seed", &PlanRequest::seed)
      .def_readwrite("unknown_space", &PlanRequest::unknown_space)
      .def_readwrite("bubble_radius_m", &PlanRequest::bubble_radius_m)
      .def("set_T_map_root", [](PlanRequest& r, const Eigen::Matrix4d& T) { r.T_map_root = isometryFrom(T); })
      .def(
          "set_goal_poses",
          [](PlanRequest& r, const std::vector<Eigen::Matrix4d>& poses) {
            r.goal_poses.clear();
            for (const auto& pose : poses) r.goal_poses.push_back(isometryFrom(pose));
          },
          "T_map_tip of each pose, (4, 4).");
}

}  // namespace

// long: a table of bindings
void bindPlanner(py::module_& m) {
  bindRequest(m);
  m.def("planner_names", &plannerNames, "Planners that a request may name.");
  m.def(
      "config_defaults", [] { return PlannerConfig().values(); },
      "Parameters of the planner and their defaults.");
  py::class_<MotionPlanner, std::shared_ptr<MotionPlanner>>(m, "MotionPlanner")
      .def(py::init(&makePlanner), py::kw_only(), py::arg("urdf"), py::arg("srdf"),
           py::arg("rates") = Rates{}, py::arg("config") = Config{},
           py::arg("package_folders") = std::map<std::string, std::string>{},
           "From the texts of URDF and SRDF; rates: joint -> (velocity [rad/s], acceleration [rad/s^2]). "
           "Raises "
           "ValueError for a bad configuration, RuntimeError for a broken model.")
      .def(
          "holding_box",
          [](const MotionPlanner& p, const std::string& name, const std::string& link,
             const Eigen::Vector3d& edges_m, const Eigen::Matrix4d& T_link_box,
             const std::vector<std::string>& touch_links) {
            const auto shape = fv_robot_model::Shape::box(edges_m, isometryFrom(T_link_box));
            return std::const_pointer_cast<MotionPlanner>(p.holding({{name, link, touch_links, shape}}));
          },
          py::kw_only(), py::arg("name"), py::arg("link"), py::arg("edges_m"), py::arg("T_link_box"),
          py::arg("touch_links") = std::vector<std::string>{},
          "The planner of the same robot holding a box (edges (3,) [m]) as well. Raises ValueError for names "
          "that are taken or unknown.")
      .def_property_readonly("joint_names", [](const MotionPlanner& p) { return p.model().jointNames(); })
      .def("group_joints",
           [](const MotionPlanner& p, const std::string& g) { return p.model().group(g).joint_names; })
      .def(
          "limits",
          [](const MotionPlanner& p) {
            RowMatrix rows(static_cast<Eigen::Index>(p.model().limits().size()), 2);
            for (Eigen::Index i = 0; i < rows.rows(); ++i) {
              const auto& l = p.model().limits()[static_cast<std::size_t>(i)];
              rows.row(i) << l.lower, l.upper;
            }
            return rows;
          },
          "(J, 2) lower and upper limit of each joint [rad].")
      .def(
          "tip_pose",
          [](const MotionPlanner& p, const std::string& g, const Eigen::VectorXd& q) {
            return Eigen::Matrix4d(p.model().tipPose(g, q).matrix());
          },
          "T_base_tip (4, 4) of a group for its joint values.")
      .def(
          "snapshot",
          [](const MotionPlanner& p, const py::bytes& payload, double resolution_m, std::uint64_t sequence,
             const Eigen::Matrix4d& T) { return snapshot(payload, resolution_m, sequence, p, T); },
          py::kw_only(), py::arg("payload"), py::arg("resolution_m"), py::arg("sequence"),
          py::arg("T_map_root"), "The part of a binary octomap payload that the robot can reach.")
      .def("warm", &MotionPlanner::warm, py::call_guard<py::gil_scoped_release>(),
           "Build the distance field of the request's map.")
      .def(
          "solve",
          [](const MotionPlanner& p, const PlanRequest& request, bool cancelled) {
            PlanResult result;
            {
              const py::gil_scoped_release release;
              result = p.solve(request, [cancelled] { return cancelled; });
            }
            return resultToDict(result);
          },
          py::arg("request"), py::kw_only(), py::arg("cancelled") = false,
          "Plan; a dict with the fields of PlanMotion's result. Never raises: see status and message.")
      .def(
          "judge",
          [](const MotionPlanner& p, const PlanRequest& request, const py::dict& trajectory) {
            const TimedTrajectory timed = trajectoryFromDict(trajectory);
            const py::gil_scoped_release release;
            return p.judge(request, timed);
          },
          "What a trajectory meets on its way; empty when nothing.")
      .def(
          "check_states",
          [](const MotionPlanner& p, const PlanRequest& request, const RowMatrix& states,
             const std::string& checker, bool with_self) {
            const py::gil_scoped_release release;
            return checkStates(p, request, states, checker, with_self);
          },
          py::arg("request"), py::arg("states"), py::kw_only(), py::arg("checker"),
          py::arg("with_self") = true,
          "Whether each of (N, J) states of the request's group is allowed; checker: distance_field, judge, "
          "fcl_octree.");
}

}  // namespace ompl_planner
