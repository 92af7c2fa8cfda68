/// A small robot with every supported kind of joint, for the tests.
#pragma once

#include <Eigen/Core>
#include <random>
#include <string>

#include "fv_robot_model/robot_model.h"

namespace fv_robot_model::testing {

/// base -turn-> trunk -lift-> carriage -elbow-> arm -(fixed)-> hand, two mimic fingers, a second arm on the
/// trunk.
inline std::string exampleUrdf() {
  return R"(<robot name="example">
  <link name="base"><collision><geometry><box size="0.4 0.4 0.1"/></geometry></collision></link>
  <link name="trunk"><collision><origin xyz="0 0 0.25"/><geometry><cylinder radius="0.06" length="0.5"/></geometry>
  </collision></link>
  <link name="carriage"><collision><geometry><box size="0.1 0.2 0.1"/></geometry></collision></link>
  <link name="arm"><collision><origin xyz="0.2 0 0" rpy="0 1.5707963267948966 0"/>
    <geometry><cylinder radius="0.04" length="0.4"/></geometry></collision></link>
  <link name="hand"><collision><geometry><sphere radius="0.06"/></geometry></collision></link>
  <link name="finger_left"/>
  <link name="finger_right"/>
  <link name="other_arm"><collision><origin xyz="0 0.2 0"/><geometry><box size="0.05 0.4 0.05"/></geometry>
  </collision></link>
  <joint name="turn" type="continuous"><parent link="base"/><child link="trunk"/><origin xyz="0 0 0.05"/>
    <axis xyz="0 0 1"/><limit effort="10" velocity="1.5"/></joint>
  <joint name="lift" type="prismatic"><parent link="trunk"/><child link="carriage"/><origin xyz="0.15 0 0.2"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="0.3" effort="10" velocity="0.2"/></joint>
  <joint name="elbow" type="revolute"><parent link="carriage"/><child link="arm"/>
    <origin xyz="0.05 0 0.02" rpy="0.1 -0.2 0.3"/><axis xyz="0 1 1"/>
    <limit lower="-2" upper="2" effort="10" velocity="2"/></joint>
  <joint name="wrist" type="fixed"><parent link="arm"/><child link="hand"/><origin xyz="0.45 0 0" rpy="0 0.5 0"/></joint>
  <joint name="grip" type="revolute"><parent link="hand"/><child link="finger_left"/><origin xyz="0.05 0.02 0"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <joint name="grip_mirror" type="revolute"><parent link="hand"/><child link="finger_right"/>
    <origin xyz="0.05 -0.02 0"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/>
    <mimic joint="grip" multiplier="-1.5" offset="0.1"/></joint>
  <joint name="shoulder" type="revolute"><parent link="trunk"/><child link="other_arm"/>
    <origin xyz="0 0.08 0.4"/><axis xyz="1 0 0"/><limit lower="-1.5" upper="1.5" effort="1" velocity="1"/></joint>
</robot>)";
}

inline std::string exampleSrdf() {
  return R"(<?xml version="1.0"?>
<robot name="example">
  <group name="arm"><chain base_link="trunk" tip_link="hand"/></group>
  <group name="body"><chain base_link="base" tip_link="finger_left"/></group>
  <group name="all"><group name="body"/><joint name="shoulder"/></group>
  <group_state name="home" group="arm"><joint name="lift" value="0.1"/><joint name="elbow" value="-0.5"/></group_state>
  <disable_collisions link1="trunk" link2="carriage" reason="Adjacent"/>
  <disable_collisions link1="carriage" link2="base" reason="Never"/>
</robot>)";
}

inline RobotModel exampleRobot() { return RobotModel::fromXml(exampleUrdf(), exampleSrdf()); }

/// Uniform within the limits.
inline Eigen::VectorXd randomConfiguration(const RobotModel& model, std::mt19937& random) {
  Eigen::VectorXd q(model.limits().size());
  for (Eigen::Index i = 0; i < q.size(); ++i)
    q[i] = std::uniform_real_distribution<double>(model.limits()[i].lower, model.limits()[i].upper)(random);
  return q;
}

/// (count, 3) uniform in a cube around the origin.
inline Points randomPoints(Eigen::Index count, double half_edge, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-half_edge, half_edge);
  return Points::NullaryExpr(count, 3, [&] { return uniform(random); });
}

/// Uniform rotation, position in a cube.
inline Eigen::Isometry3d randomPose(double half_edge, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const Eigen::Quaterniond rotation(normal(random), normal(random), normal(random), normal(random));
  return Eigen::Translation3d(randomPoints(1, half_edge, random).transpose()) * rotation.normalized();
}

}  // namespace fv_robot_model::testing
