/// Mimic joints within the chain: kinematics, limits, named states, inverse kinematics.
#include <gtest/gtest.h>

#include <cmath>
#include <kdl/chain.hpp>

#include "example_robot.h"
#include "fv_robot_model/ik/group_solver.h"

namespace fv_robot_model {
namespace {

using testing::randomConfiguration;

/// turn, lift (slides), shoulder, elbow and spin move; `level` keeps the hand level by following `tilt`,
/// which follows the elbow, and stands in the file (and in the tree) before it; `shadow` follows the
/// shoulder; `rail` slides by the shoulder's angle.
std::string linkageUrdf(const std::string& level_limits = "lower='-9' upper='9'") {
  const auto joint = [](const std::string& name, const std::string& type, const std::string& parent,
                        const std::string& axis, const std::string& more) {
    return "<link name='" + name +
           "_link'><collision><geometry><box size='0.05 0.04 0.2'/></geometry></collision>" +
           "</link><joint name='" + name + "' type='" + type + "'><parent link='" + parent +
           "'/><child link='" + name +
           "_link'/><origin xyz='0.03 -0.02 0.25' rpy='0.1 0.2 -0.3'/><axis xyz='" + axis + "'/>" + more +
           "</joint>";
  };
  const std::string free = "<limit lower='-2' upper='2' effort='10' velocity='1'/>";
  return "<robot name='linkage'><link name='base'/>" +
         joint("level", "revolute", "elbow_link", "0 1 0.2",
               "<limit " + level_limits +
                   " effort='10' velocity='3'/><mimic joint='tilt' multiplier='-1' offset='0.2'/>") +
         joint("turn", "continuous", "base", "0 0 1", "") +
         joint("shoulder", "revolute", "turn_link", "0 1 0", free) +
         joint("rail", "prismatic", "shoulder_link", "1 0 0",
               "<limit lower='-1' upper='1' effort='10' velocity='1'/><mimic joint='shoulder' "
               "multiplier='0.1'/>") +
         joint("elbow", "revolute", "rail_link", "0 1 0", free) +
         joint("spin", "revolute", "level_link", "0 0 1", free) +
         joint("tilt", "revolute", "spin_link", "1 0 0",
               "<limit lower='-9' upper='9' effort='10' velocity='9'/><mimic joint='elbow' multiplier='2' "
               "offset='-0.1'/>") +
         joint("shadow", "revolute", "spin_link", "1 0 0",
               "<limit lower='-9' upper='9' effort='10' velocity='9'/><mimic joint='shoulder'/>") +
         "</robot>";
}

std::string linkageSrdf(const std::string& values = "") {
  return "<robot name='linkage'><group name='arm'><chain base_link='base' tip_link='tilt_link'/></group>"
         "<group_state name='home' group='arm'><joint name='turn' value='0'/><joint name='shoulder' "
         "value='0.5'/>"
         "<joint name='elbow' value='1'/><joint name='spin' value='0'/>" +
         values + "</group_state></robot>";
}

RobotModel linkage() { return RobotModel::fromXml(linkageUrdf(), linkageSrdf()); }

std::string errorOf(const std::string& urdf, const std::string& srdf) {
  try {
    RobotModel::fromXml(urdf, srdf);
  } catch (const ModelError& error) {
    return error.what();
  }
  return "";
}

/// T_parent_link by hand, for a value of its joint.
Eigen::Isometry3d placed(const RobotModel& model, const std::string& link_name, double value) {
  const RobotModel::Link& link = model.link(model.linkIndex(link_name));
  Eigen::Isometry3d T = link.T_parent_joint;
  if (link.motion == RobotModel::Link::Motion::Rotation) T = T * Eigen::AngleAxisd(value, link.axis);
  if (link.motion == RobotModel::Link::Motion::Translation) T = T * Eigen::Translation3d(value * link.axis);
  return T;
}

TEST(Mimics, areNoVariablesAndFollowThroughEachOther) {
  const RobotModel model = linkage();
  const Group& arm = model.group("arm");
  EXPECT_EQ(arm.joint_names, (std::vector<std::string>{"turn", "shoulder", "elbow", "spin"}));
  EXPECT_EQ(model.jointNames(), arm.joint_names);
  std::mt19937 random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::VectorXd q = randomConfiguration(model, random);
    const double tilt = 2.0 * q[2] - 0.1;
    const Eigen::Isometry3d T = placed(model, "turn_link", q[0]) * placed(model, "shoulder_link", q[1]) *
                                placed(model, "rail_link", 0.1 * q[1]) * placed(model, "elbow_link", q[2]) *
                                placed(model, "level_link", 0.2 - tilt) * placed(model, "spin_link", q[3]) *
                                placed(model, "tilt_link", tilt);
    EXPECT_TRUE(model.tipPose("arm", q).isApprox(T, 1e-12));
    EXPECT_TRUE(model.forward(q)[model.linkIndex("tilt_link")].isApprox(T, 1e-12));
  }
}

TEST(Mimics, jacobiansAgreeWithFiniteDifferences) {
  const RobotModel model = linkage();
  const ik::SerialChain chain = ik::chainOfGroup(model, "arm");
  EXPECT_TRUE(chain.isCoupled());
  EXPECT_EQ(chain.dof(), 4);
  std::mt19937 random(2);
  const double h = 1e-6;
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::VectorXd q = randomConfiguration(model, random);
    EXPECT_TRUE(chain.forward(q.data()).isApprox(model.tipPose("arm", q), 1e-12));
    const auto J = model.jacobian("arm", q);
    EXPECT_TRUE(chain.jacobian(q.data()).isApprox(J, 1e-10));
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      const Eigen::VectorXd step = h * Eigen::VectorXd::Unit(q.size(), i);
      const Eigen::Isometry3d ahead = model.tipPose("arm", q + step);
      const Eigen::Isometry3d behind = model.tipPose("arm", q - step);
      const Eigen::AngleAxisd turn(Eigen::Matrix3d(ahead.linear() * behind.linear().transpose()));
      EXPECT_LT((J.col(i).head<3>() - (ahead.translation() - behind.translation()) / (2 * h)).norm(), 1e-7);
      EXPECT_LT((J.col(i).tail<3>() - turn.axis() * turn.angle() / (2 * h)).norm(), 1e-6);
    }
  }
}

TEST(Mimics, inverseKinematicsFindsThePoseOfAnyConfiguration) {
  const RobotModel model = linkage();
  const auto solver = ik::makeIkSolver(model, "arm");
  EXPECT_FALSE(solver->exact());
  std::mt19937 random(3);
  int found = 0;
  for (int trial = 0; trial < 20; ++trial) {
    Eigen::VectorXd q = 0.9 * randomConfiguration(model, random);
    const Eigen::Isometry3d T = model.tipPose("arm", q);
    ik::IkSolutions solutions(4);
    solver->solvePose(T, nullptr, solutions);
    found += solutions.empty() ? 0 : 1;
    for (int row = 0; row < solutions.size(); ++row) {
      const Eigen::Map<const Eigen::VectorXd> answer(solutions.row(row), 4);
      EXPECT_TRUE(model.tipPose("arm", answer).isApprox(T, 1e-5));
      EXPECT_TRUE(model.withinLimits(model.group("arm"), answer, 1e-9));
    }
  }
  EXPECT_GE(found, 19);
}

TEST(Mimics, reachBoundHoldsForEveryConfiguration) {
  const RobotModel model = linkage();
  const ik::ReachBound bound = ik::reachBound(ik::chainOfGroup(model, "arm"));
  std::mt19937 random(4);
  for (int trial = 0; trial < 2000; ++trial) {
    const Eigen::Vector3d tip = model.tipPose("arm", randomConfiguration(model, random)).translation();
    EXPECT_LE((tip - bound.center).norm(), bound.radius_m + 1e-9);
  }
}

TEST(Mimics, narrowTheLimitsOfTheirLeader) {
  // level = -(2 elbow - 0.1) + 0.2 = -2 elbow + 0.3 within [-1.7, 2.3]: elbow within [-1, 1].
  const RobotModel model = RobotModel::fromXml(linkageUrdf("lower='-1.7' upper='2.3'"), linkageSrdf());
  const JointLimits& elbow = model.limits()[2];
  EXPECT_NEAR(elbow.lower, -1.0, 1e-12);
  EXPECT_NEAR(elbow.upper, 1.0, 1e-12);
  EXPECT_NEAR(elbow.velocity, 1.0, 1e-12);  // level's 3 rad/s would allow 1.5
  const RobotModel::Link& link = model.link(model.linkIndex("elbow_link"));
  EXPECT_NEAR(link.limits.upper, 2.0, 1e-12);
  EXPECT_FALSE(model.withinLimits(model.group("arm"), Eigen::Vector4d(0.0, 0.0, 1.01, 0.0)));
  EXPECT_NE(errorOf(linkageUrdf("lower='5' upper='6'"), "").find("no value of 'elbow' keeps both"),
            std::string::npos);
  EXPECT_NE(errorOf(linkageUrdf("lower='-1' upper='1'"), linkageSrdf()).find("mimics level, tilt"),
            std::string::npos)
      << errorOf(linkageUrdf("lower='-1' upper='1'"), linkageSrdf());
}

TEST(Mimics, givenInANamedStateMustBeWhatTheirLeaderSays) {
  EXPECT_EQ(errorOf(linkageUrdf(), linkageSrdf("<joint name='tilt' value='1.9'/>")), "");
  EXPECT_EQ(errorOf(linkageUrdf(), linkageSrdf("<joint name='level' value='-1.7001'/>")), "");
  const std::string wrong = errorOf(linkageUrdf(), linkageSrdf("<joint name='tilt' value='0'/>"));
  EXPECT_NE(wrong.find("'tilt' at 0, but it mimics 'elbow', which puts it at 1.9"), std::string::npos)
      << wrong;
}

TEST(Mimics, inACircleAreRefused) {
  std::string urdf = linkageUrdf();
  const std::string from = "<mimic joint='elbow'";
  urdf.replace(urdf.find(from), from.size(), "<mimic joint='level'");
  EXPECT_NE(errorOf(urdf, "").find("circle"), std::string::npos);
}

TEST(SrdfGroups, asTheAssistantWritesThem) {
  const std::string srdf = R"(<robot name='linkage'>
    <group name='arm'><chain base_link='base' tip_link='spin_link'/></group>
    <group name='hand'><link name='base'/><link name='spin_link'/><link name='tilt_link'/><joint name='shadow'/></group>
    <group name='tool'><joint name='shadow'/></group>
    <group name='both'><group name='arm'/><group name='hand'/></group>
    <group_state name='open' group='hand'><joint name='spin' value='0.1'/></group_state>
    <group_state name='rest' group='tool'/>
    <end_effector name='eef' parent_link='spin_link' group='hand' parent_group='arm'/>
    <virtual_joint name='v' type='fixed' parent_frame='world' child_link='base'/>
    <disable_default_collisions link='base'/>
    <passive_joint name='shadow'/>
    </robot>)";
  const RobotModel model = RobotModel::fromXml(linkageUrdf(), srdf);
  EXPECT_EQ(model.group("hand").joint_names, (std::vector<std::string>{"spin"}));
  EXPECT_TRUE(model.group("tool").joint_names.empty());
  EXPECT_EQ(model.group("both").joint_names, model.group("arm").joint_names);
  EXPECT_TRUE(model.passiveJoints().empty());  // it is a mimic, so its leader moves it
  EXPECT_EQ(model.namedStates("tool").at("rest").size(), 0);
}

TEST(SrdfGroups, holdNoPassiveJoints) {
  const std::string passive = "<passive_joint name='spin'/></robot>";
  const std::string hand =
      "<robot name='linkage'><group name='hand'><joint name='spin'/><joint name='elbow'/></group>"
      "<group_state name='s' group='hand'><joint name='elbow' value='0'/><joint name='spin' "
      "value='0.3'/></group_state>";
  const RobotModel model = RobotModel::fromXml(linkageUrdf(), hand + passive);
  EXPECT_EQ(model.group("hand").joint_names, (std::vector<std::string>{"elbow"}));
  EXPECT_EQ(model.passiveJoints(), (std::vector<std::string>{"spin"}));
  const std::string chain = linkageSrdf().substr(0, linkageSrdf().find("<group_state"));
  EXPECT_NE(errorOf(linkageUrdf(), chain + passive).find("passive joint 'spin': nothing drives it"),
            std::string::npos);
}

}  // namespace
}  // namespace fv_robot_model
