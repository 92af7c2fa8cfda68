/// The reach against random states: nothing leaves it, and sliding joints do not blow it up.
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "reach.h"

namespace ompl_planner {
namespace {

std::string joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& axis, double half_range) {
  const std::string range = std::to_string(half_range);
  return "<link name='" + name +
         "'><collision><origin xyz='0.05 0 0'/><geometry><box size='0.2 0.1 0.1'/></geometry>" +
         "</collision></link><joint name='j" + name + "' type='" + type + "'><parent link='" + parent +
         "'/><child link='" + name + "'/><origin xyz='0.1 0 0.2' rpy='0 0 0.5'/><axis xyz='" + axis +
         "'/><limit lower='-" + range + "' upper='" + range + "' effort='1' velocity='1'/></joint>";
}

/// Slides along x, then y, turns, slides again: the last one's direction is not known.
fv_robot_model::RobotModel slidingRobot() {
  const std::string urdf =
      "<robot name='r'><link name='root'/>" + joint("x", "prismatic", "root", "1 0 0", 4.0) +
      joint("y", "prismatic", "x", "0 1 0", 2.0) + joint("yaw", "revolute", "y", "0 0 1", 3.0) +
      joint("reach", "prismatic", "yaw", "1 0 0", 0.5) + "</robot>";
  const std::string srdf =
      "<robot name='r'><group name='arm'><chain base_link='root' tip_link='reach'/></group></robot>";
  return fv_robot_model::RobotModel::fromXml(urdf, srdf);
}

TEST(Reach, HoldsEveryCornerOfEveryStateAndNotMuchMore) {
  const auto model = slidingRobot();
  const auto& group = model.group("arm");
  Eigen::Isometry3d T_map_root = Eigen::Isometry3d::Identity();
  T_map_root.translate(Eigen::Vector3d(1.0, 2.0, 0.3))
      .rotate(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()));
  const auto rest = model.forward(Eigen::VectorXd::Zero(4));
  const auto of_group = groupReach(model, group, rest, T_map_root);
  const auto of_robot = robotReach(model, T_map_root);
  EXPECT_TRUE(of_robot.contains(of_group));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Eigen::AlignedBox3d visited;
  for (int i = 0; i < 20000; ++i) {
    Eigen::VectorXd q(4);
    for (int j = 0; j < 4; ++j)
      q[j] = std::round(1.4 * unit(random)) * model.limits()[static_cast<std::size_t>(j)].upper;
    if (i % 2 == 0) q[2] = 3.0 * unit(random);
    const auto poses = model.forward(q);
    for (const int link : group.moved_links) {
      for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3d p(corner & 1 ? 0.15 : -0.05, corner & 2 ? 0.05 : -0.05,
                                corner & 4 ? 0.05 : -0.05);
        visited.extend(T_map_root * poses[static_cast<std::size_t>(link)] * p);
      }
    }
  }
  EXPECT_TRUE(of_group.contains(visited));
  EXPECT_LT((of_robot.sizes() - visited.sizes()).maxCoeff(), 1.5) << "the strokes are 8 m and 4 m";
}

}  // namespace
}  // namespace ompl_planner
