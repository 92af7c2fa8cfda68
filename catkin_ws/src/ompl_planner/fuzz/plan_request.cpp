/// What comes in from others as the planner takes it: goals, held objects, trajectories of any content. Only
/// std::invalid_argument is allowed. (Bytes of the wire are roscpp's to read.)
#include <fuzzer/FuzzedDataProvider.h>

#include <cstring>
#include <stdexcept>

#include "conversions.h"

namespace {

using Input = FuzzedDataProvider;

/// Half of the numbers are of a scene's size, the others any bits.
double number(Input& in) {
  if (in.ConsumeBool()) return in.ConsumeIntegral<int8_t>() / 32.0;
  const auto bits = in.ConsumeIntegral<uint64_t>();
  double value;
  std::memcpy(&value, &bits, sizeof(value));
  return value;
}

std::string name(Input& in) { return in.ConsumeBool() ? "a" : in.ConsumeRandomLengthString(12); }

template <class Make>
auto listOf(Input& in, const Make& make) {
  std::vector<decltype(make(in))> list(in.ConsumeIntegralInRange<std::size_t>(0, 4));
  for (auto& item : list) item = make(in);
  return list;
}

geometry_msgs::Pose pose(Input& in) {
  geometry_msgs::Pose msg;
  msg.orientation.w = 1.0;
  for (double* value : {&msg.position.x, &msg.position.y, &msg.position.z}) *value = number(in);
  if (in.ConsumeBool()) {
    auto& q = msg.orientation;
    for (double* value : {&q.x, &q.y, &q.z, &q.w}) *value = number(in);
  }
  return msg;
}

fv_msgs::PlanMotionGoal goal(Input& in) {
  fv_msgs::PlanMotionGoal msg;
  msg.goal_type = in.ConsumeIntegralInRange<uint8_t>(0, 3);
  if (in.ConsumeBool()) msg.goal_joints.name = listOf(in, name);
  if (in.ConsumeBool()) msg.goal_joints.position = listOf(in, number);
  if (in.ConsumeBool()) msg.goal_name = name(in);
  if (in.ConsumeBool()) msg.goal_poses.poses = listOf(in, pose);
  if (in.ConsumeBool()) msg.goal_scores = listOf(in, number);
  if (in.ConsumeBool()) msg.goal_seeds = listOf(in, number);
  for (double* value : {&msg.roll_axis.x, &msg.roll_axis.y, &msg.roll_axis.z}) *value = number(in);
  msg.unknown_space = in.ConsumeIntegralInRange<uint8_t>(0, 4);
  return msg;
}

fv_msgs::AttachedObject object(Input& in) {
  fv_msgs::AttachedObject msg;
  msg.name = name(in);
  msg.kind = in.ConsumeIntegralInRange<uint8_t>(0, 3);
  msg.pose = pose(in);
  for (double* value : {&msg.dimensions.x, &msg.dimensions.y, &msg.dimensions.z}) *value = number(in);
  return msg;
}

trajectory_msgs::JointTrajectory trajectory(Input& in) {
  trajectory_msgs::JointTrajectory msg;
  msg.joint_names = listOf(in, name);
  msg.points = listOf(in, [](Input& from) {
    trajectory_msgs::JointTrajectoryPoint point;
    point.time_from_start =
        ros::Duration(from.ConsumeIntegral<int32_t>(), from.ConsumeIntegralInRange(0, 999999999));
    point.positions = listOf(from, number);
    if (from.ConsumeBool()) point.velocities = listOf(from, number);
    if (from.ConsumeBool()) point.accelerations = listOf(from, number);
    return point;
  });
  return msg;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  Input in(data, size);
  try {
    switch (in.ConsumeIntegralInRange(0, 2)) {
      case 0:
        ompl_planner::requestFromMsg(goal(in));
        break;
      case 1:
        ompl_planner::heldObjectsFromMsg(listOf(in, object));
        break;
      default:
        ompl_planner::trajectoryFromMsg(trajectory(in));
    }
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
