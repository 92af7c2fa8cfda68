#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <kdl/chain.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <limits>

#include "example_robot.h"

namespace fv_robot_model {
namespace {

using testing::exampleRobot;
using testing::exampleSrdf;
using testing::exampleUrdf;
using testing::randomConfiguration;
using Names = std::vector<std::string>;

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("the example has no '" + from + "'");
  return text.replace(at, from.size(), to);
}

/// The message of the error that the call must throw.
template <typename Error>
std::string messageOf(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  ADD_FAILURE() << "no error of the expected type";
  return {};
}

void expectModelError(const std::string& urdf, const std::string& srdf, const Names& parts) {
  const std::string message = messageOf<ModelError>([&] { RobotModel::fromXml(urdf, srdf); });
  for (const std::string& part : parts) EXPECT_NE(message.find(part), std::string::npos) << message;
}

Eigen::VectorXd groupValues(const Group& group, const Eigen::VectorXd& q_all) {
  Eigen::VectorXd q(group.joint_indices.size());
  for (Eigen::Index i = 0; i < q.size(); ++i) q[i] = q_all[group.joint_indices[i]];
  return q;
}

TEST(RobotModel, numbersJointsAndLinksDepthFirstByJointName) {
  const RobotModel model = exampleRobot();
  EXPECT_EQ(model.jointNames(), (Names{"turn", "lift", "elbow", "grip", "shoulder"}));
  EXPECT_EQ(model.linkNames(),
            (Names{"base", "trunk", "carriage", "arm", "hand", "finger_left", "finger_right", "other_arm"}));
  EXPECT_EQ(model.rootLink(), "base");
  for (int i = 1; i < 8; ++i) EXPECT_LT(model.parent(i), i);
}

TEST(RobotModel, readsLimits) {
  const RobotModel model = exampleRobot();
  EXPECT_FALSE(model.limits()[0].bounded);
  EXPECT_DOUBLE_EQ(model.limits()[0].velocity, 1.5);
  EXPECT_TRUE(model.limits()[1].bounded);
  EXPECT_DOUBLE_EQ(model.limits()[1].upper, 0.3);
  EXPECT_DOUBLE_EQ(model.limits()[2].lower, -2.0);
}

TEST(RobotModel, readsGroupsStatesAndDisabledPairs) {
  const RobotModel model = exampleRobot();
  EXPECT_EQ(model.groupNames(), (Names{"all", "arm", "body"}));
  EXPECT_EQ(model.group("arm").joint_names, (Names{"lift", "elbow"}));
  EXPECT_EQ(model.group("arm").moved_links, (std::vector<int>{2, 3, 4, 5, 6}));
  EXPECT_TRUE(model.group("arm").isChain());
  EXPECT_EQ(model.group("all").joint_names, (Names{"turn", "lift", "elbow", "grip", "shoulder"}));
  EXPECT_FALSE(model.group("all").isChain());
  EXPECT_TRUE(model.namedStates("arm").at("home").isApprox(Eigen::Vector2d(0.1, -0.5)));
  EXPECT_TRUE(model.namedStates("body").empty());
  EXPECT_EQ(model.disabledPairs(), (std::vector<LinkPair>{{"base", "carriage"}, {"carriage", "trunk"}}));
}

TEST(RobotModel, aJointOfTheTrunkMovesTheOtherArmToo) {
  const RobotModel model = exampleRobot();
  EXPECT_EQ(model.group("body").moved_links, (std::vector<int>{1, 2, 3, 4, 5, 6, 7}));
}

TEST(RobotModel, mimicsFollowTheirLeader) {
  const RobotModel model = exampleRobot();
  Eigen::VectorXd q = Eigen::VectorXd::Zero(5);
  q[3] = 0.4;
  const LinkPoses poses = model.forward(q);
  const Eigen::Isometry3d T =
      poses[model.linkIndex("hand")].inverse() * poses[model.linkIndex("finger_right")];
  EXPECT_TRUE(T.linear().isApprox(
      Eigen::AngleAxisd(-1.5 * 0.4 + 0.1, Eigen::Vector3d::UnitZ()).toRotationMatrix(), 1e-12));
}

TEST(RobotModel, tipPoseAgreesWithForwardAndKdl) {
  const RobotModel model = exampleRobot();
  const Group& group = model.group("body");
  const KDL::Chain chain = model.chain("body");
  KDL::ChainFkSolverPos_recursive solver(chain);
  std::mt19937 random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::VectorXd q_all = randomConfiguration(model, random);
    const Eigen::VectorXd q = groupValues(group, q_all);
    const LinkPoses poses = model.forward(q_all);
    const Eigen::Isometry3d T =
        poses[model.linkIndex("base")].inverse() * poses[model.linkIndex("finger_left")];
    EXPECT_TRUE(model.tipPose(group, q).isApprox(T, 1e-12));
    KDL::JntArray kdl_q(chain.getNrOfJoints());
    kdl_q.data = q;
    KDL::Frame frame;
    ASSERT_GE(solver.JntToCart(kdl_q, frame), 0);
    for (int row = 0; row < 3; ++row) {
      EXPECT_NEAR(frame.p[row], T.translation()[row], 1e-12);
      for (int column = 0; column < 3; ++column)
        EXPECT_NEAR(frame.M(row, column), T.linear()(row, column), 1e-12);
    }
  }
}

TEST(RobotModel, jacobianAgreesWithFiniteDifferences) {
  const RobotModel model = exampleRobot();
  const Group& group = model.group("body");
  std::mt19937 random(2);
  const double h = 1e-6;
  for (int trial = 0; trial < 100; ++trial) {
    const Eigen::VectorXd q = groupValues(group, randomConfiguration(model, random));
    const auto J = model.jacobian(group, q);
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      const Eigen::VectorXd step = h * Eigen::VectorXd::Unit(q.size(), i);
      const Eigen::Isometry3d ahead = model.tipPose(group, q + step);
      const Eigen::Isometry3d behind = model.tipPose(group, q - step);
      const Eigen::AngleAxisd turn(Eigen::Matrix3d(ahead.linear() * behind.linear().transpose()));
      const Eigen::Vector3d linear = (ahead.translation() - behind.translation()) / (2 * h);
      EXPECT_TRUE(J.col(i).head<3>().isApprox(linear, 1e-7) || linear.norm() < 1e-9);
      EXPECT_LT((J.col(i).tail<3>() - turn.axis() * turn.angle() / (2 * h)).norm(), 1e-6);
    }
  }
}

TEST(RobotModel, forwardOfAGroupRenewsOnlyWhatItMoves) {
  const RobotModel model = exampleRobot();
  const Group& group = model.group("arm");
  std::mt19937 random(3);
  Eigen::VectorXd q = randomConfiguration(model, random);
  LinkPoses poses = model.forward(q);
  model.setGroup(group, Eigen::Vector2d(0.2, 1.0), q);
  model.forward(q, group, poses);
  const LinkPoses expected = model.forward(q);
  for (std::size_t i = 0; i < poses.size(); ++i) EXPECT_TRUE(poses[i].isApprox(expected[i], 1e-14));
}

TEST(RobotModel, limitsBindExceptOfContinuousJoints) {
  const RobotModel model = exampleRobot();
  const Group& body = model.group("body");
  EXPECT_TRUE(model.withinLimits(body, Eigen::Vector4d(9.0, 0.1, 0.0, 0.0)));
  EXPECT_FALSE(model.withinLimits(body, Eigen::Vector4d(0.0, 0.31, 0.0, 0.0)));
  EXPECT_TRUE(model.withinLimits(body, Eigen::Vector4d(0.0, 0.31, 0.0, 0.0), 0.02));
}

TEST(RobotModel, refusesValuesThatDoNotFit) {
  const RobotModel model = exampleRobot();
  EXPECT_THROW(model.forward(Eigen::VectorXd::Zero(4)), std::invalid_argument);
  Eigen::VectorXd q = Eigen::VectorXd::Zero(5);
  q[2] = std::numeric_limits<double>::quiet_NaN();
  const std::string message = messageOf<std::invalid_argument>([&] { model.forward(q); });
  EXPECT_NE(message.find("'elbow'"), std::string::npos) << message;
  EXPECT_THROW(model.tipPose("arm", Eigen::VectorXd::Zero(3)), std::invalid_argument);
  EXPECT_THROW(model.tipPose("all", Eigen::VectorXd::Zero(5)), ModelError);
}

TEST(RobotModel, unknownNamesListTheValidOnes) {
  const RobotModel model = exampleRobot();
  for (const auto& [call, part] : std::vector<std::pair<std::function<void()>, std::string>>{
           {[&] { model.group("leg"); }, "unknown group 'leg'; valid: all, arm, body"},
           {[&] { model.linkIndex("leg"); }, "unknown link 'leg'; valid: base, trunk"},
           {[&] { model.jointIndex("leg"); }, "unknown joint 'leg'; valid: turn, lift"}}) {
    const std::string message = messageOf<UnknownNameError>(call);
    EXPECT_NE(message.find(part), std::string::npos) << message;
  }
}

TEST(RobotModel, carriesWhatIsAttached) {
  const RobotModel model = exampleRobot();
  const Shape ball = Shape::sphere(0.05, Eigen::Isometry3d(Eigen::Translation3d(0.1, 0.0, 0.0)));
  const RobotModel laden = model.withAttached("cup", "hand", {ball}, {"other_arm"});
  const Eigen::VectorXd q = Eigen::VectorXd::Constant(5, 0.1);
  EXPECT_EQ(laden.linkNames().back(), "cup");
  EXPECT_TRUE(laden.forward(q).back().isApprox(laden.forward(q)[laden.linkIndex("hand")]));
  EXPECT_EQ(laden.group("arm").moved_links.back(), laden.linkIndex("cup"));
  EXPECT_EQ(laden.disabledPairs().size(), model.disabledPairs().size() + 1);
  EXPECT_EQ(model.linkNames().size() + 1, laden.linkNames().size());
  EXPECT_THROW(model.withAttached("arm", "hand", {ball}), std::invalid_argument);
  EXPECT_THROW(model.withAttached("cup", "leg", {ball}), UnknownNameError);
  EXPECT_THROW(model.withAttached("cup", "hand", {ball}, {"leg"}), UnknownNameError);
}

TEST(RobotModelInput, refusesBrokenXml) {
  expectModelError("", "", {"the URDF is not XML"});
  expectModelError("<robot name='r'><link", "", {"the URDF is not XML"});
  expectModelError("<robot name='r'></robot>", "", {"needs one root link"});
  expectModelError("<!DOCTYPE robot [<!ENTITY a 'b'>]><robot name='r'/>", "", {"document type"});
  expectModelError(exampleUrdf(), "<!DOCTYPE robot><robot name='example'/>", {"SRDF", "document type"});
  std::string deep = "<robot name='r'>";
  for (int i = 0; i < 100000; ++i) deep += "<a>";
  expectModelError(deep, "", {"the URDF is not XML"});
  expectModelError(exampleUrdf(), "<robot name='example'><group", {"the SRDF is not XML"});
  expectModelError(exampleUrdf(), "<other/>", {"no <robot>"});
}

TEST(RobotModelInput, refusesTwoRootsAndLoops) {
  expectModelError("<robot name='r'><link name='a'/><link name='b'/></robot>", "", {"has 2: a, b"});
  expectModelError(R"(<robot name='r'><link name='a'/><link name='b'/>
    <joint name='j' type='fixed'><parent link='a'/><child link='b'/></joint>
    <joint name='k' type='fixed'><parent link='b'/><child link='a'/></joint></robot>)",
                   "", {"needs one root link", "has 0"});
  expectModelError(R"(<robot name='r'><link name='a'/><link name='b'/><link name='c'/>
    <joint name='j' type='fixed'><parent link='c'/><child link='b'/></joint>
    <joint name='k' type='fixed'><parent link='b'/><child link='c'/></joint></robot>)",
                   "", {"in a circle: b, c"});
}

TEST(RobotModelInput, refusesNamesThatAreTakenAndEndsThatAreNone) {
  const auto robot = [](const std::string& joints) {
    return "<robot name='r'><link name='a'/><link name='b'/><link name='c'/>"
           "<joint name='j' type='fixed'><parent link='a'/><child link='b'/></joint>" +
           joints + "</robot>";
  };
  expectModelError(robot("<link name='a'/>"), "", {"two links are named 'a'", "line"});
  expectModelError(robot("<joint name='j' type='fixed'><parent link='b'/><child link='c'/></joint>"), "",
                   {"two joints are named 'j'"});
  expectModelError(robot("<joint name='k' type='fixed'><parent link='c'/><child link='b'/></joint>"), "",
                   {"link 'b' hangs on two joints, 'j' and 'k'"});
  expectModelError(robot("<joint name='k' type='fixed'><parent link='c'/><child link='c'/></joint>"), "",
                   {"'k' joins link 'c' to itself"});
  expectModelError(robot("<joint name='k' type='fixed'><parent link='b'/><child link='d'/></joint>"), "",
                   {"'k' has unknown link 'd' as its child; valid: a, b, c"});
  expectModelError(robot("<joint name='k' type='ball'><parent link='b'/><child link='c'/></joint>"), "",
                   {"unknown type 'ball'", "revolute"});
  expectModelError(robot("<joint name='k' type='revolute'><parent link='b'/><child link='c'/></joint>"), "",
                   {"'k' is revolute but has no <limit>"});
  expectModelError(robot("<link name='d'><collision/></link>"), "",
                   {"collision of link 'd' has no geometry"});
}

TEST(RobotModel, tellsWhatLinksLookLikeAndWhichAreBare) {
  const RobotModel model = RobotModel::fromXml(R"(<robot name='r'>
    <link name='a'><visual><origin xyz='1 2 3'/><geometry><cylinder radius='0.1' length='2'/></geometry></visual>
      <visual><geometry><mesh filename='package://p/x.dae' scale='1 -2 3'/></geometry></visual></link>
    <link name='frame'/><joint name='j' type='fixed'><parent link='a'/><child link='frame'/></joint></robot>)",
                                               "");
  ASSERT_EQ(model.visuals(0).size(), 2U);
  EXPECT_EQ(model.visuals(0)[0].kind, Visual::Kind::Cylinder);
  EXPECT_TRUE(model.visuals(0)[0].dimensions.isApprox(Eigen::Vector3d(0.1, 2.0, 0.0)));
  EXPECT_TRUE(model.visuals(0)[0].T_link_visual.translation().isApprox(Eigen::Vector3d(1.0, 2.0, 3.0)));
  EXPECT_EQ(model.visuals(0)[1].mesh, "package://p/x.dae");
  EXPECT_TRUE(model.visuals(0)[1].dimensions.isApprox(Eigen::Vector3d(1.0, -2.0, 3.0)));
  EXPECT_EQ(model.bareLinks(), (Names{"a"}));
  EXPECT_TRUE(exampleRobot().bareLinks().empty());
}

TEST(RobotModel, withoutShapesLooksForNoMesh) {
  const std::string urdf =
      replaced(exampleUrdf(), "<sphere radius=\"0.06\"/>", "<mesh filename=\"/no/such.stl\"/>");
  const RobotModel model = RobotModel::fromXml(urdf, exampleSrdf(), {}, false);
  EXPECT_EQ(model.linkNames(), exampleRobot().linkNames());
  EXPECT_TRUE(model.shapes(0).empty());
}

TEST(RobotModelInput, namesJointsThatAreNotSupported) {
  for (const std::string type : {"floating", "planar"})
    expectModelError(replaced(exampleUrdf(), R"("wrist" type="fixed")", R"("wrist" type=")" + type + "\""),
                     "", {"'wrist'", type});
}

TEST(RobotModelInput, namesABrokenJoint) {
  expectModelError(replaced(exampleUrdf(), "<axis xyz=\"0 1 1\"/>", "<axis xyz=\"0 0 0\"/>"), "",
                   {"axis", "'elbow'"});
  expectModelError(replaced(exampleUrdf(), "lower=\"-2\" upper=\"2\"", "lower=\"3\" upper=\"2\""), "",
                   {"lower limit 3 is not below upper limit 2", "'elbow'"});
  expectModelError(replaced(exampleUrdf(), "mimic joint=\"grip\"", "mimic joint=\"grab\""), "", {"'grab'"});
  expectModelError(replaced(exampleUrdf(), "mimic joint=\"grip\"", "mimic joint=\"grip_mirror\""), "",
                   {"circle"});
  expectModelError(replaced(exampleUrdf(), "mimic joint=\"grip\"", "mimic joint=\"wrist\""), "", {"fixed"});
}

TEST(RobotModelInput, refusesNumbersThatAreNone) {
  expectModelError(replaced(exampleUrdf(), "size=\"0.4 0.4 0.1\"", "size=\"0.4 x 0.1\""), "",
                   {"cannot be used"});
  expectModelError(replaced(exampleUrdf(), "radius=\"0.04\"", "radius=\"wide\""), "", {"cannot be used"});
  expectModelError(replaced(exampleUrdf(), "xyz=\"0.2 0 0\"", "xyz=\"0.2 0\""), "", {"cannot be used"});
}

TEST(RobotModelInput, refusesShapesWithoutSize) {
  expectModelError(replaced(exampleUrdf(), "sphere radius=\"0.06\"", "sphere radius=\"0\""), "", {"'hand'"});
  expectModelError(replaced(exampleUrdf(), "size=\"0.4 0.4 0.1\"", "size=\"0.4 -0.4 0.1\""), "", {"'base'"});
}

TEST(RobotModelInput, namesMissingMeshes) {
  const std::string at = "<sphere radius=\"0.06\"/>";
  expectModelError(replaced(exampleUrdf(), at, "<mesh filename=\"/no/such/mesh.stl\"/>"), "",
                   {"'hand'", "/no/such/mesh.stl", "missing"});
  expectModelError(replaced(exampleUrdf(), at, "<mesh filename=\"package://p/mesh.stl\"/>"), "",
                   {"package://p/mesh.stl", "resolver"});
  const std::string urdf = replaced(exampleUrdf(), at, "<mesh filename=\"package://p/mesh.stl\"/>");
  const std::string message = messageOf<ModelError>([&] {
    RobotModel::fromXml(urdf, "", packageResolver({{"q", "/tmp"}}));
  });
  EXPECT_NE(message.find("unknown package 'p'; valid: q"), std::string::npos) << message;
}

TEST(RobotModelInput, namesWhatTheSrdfHasAndTheUrdfHasNot) {
  const auto broken = [](const std::string& from, const std::string& to, const Names& parts) {
    expectModelError(exampleUrdf(), replaced(exampleSrdf(), from, to), parts);
  };
  broken("tip_link=\"hand\"", "tip_link=\"head\"", {"'arm'", "'head'", "finger_left"});
  broken("joint name=\"shoulder\"", "joint name=\"hip\"", {"'all'", "'hip'", "shoulder"});
  broken("<group name=\"body\"/>", "<group name=\"leg\"/>", {"'leg'", "arm, body"});
  broken("<group name=\"body\"/>", "<group name=\"all\"/>", {"contains itself"});
  broken("link2=\"base\"", "link2=\"bas\"", {"disable_collisions", "'bas'"});
  broken("group=\"arm\"", "group=\"leg\"", {"'home'", "all, arm, body"});
  broken("<robot name=\"example\">", "<robot name=\"other\">", {"'other'", "'example'"});
}

TEST(RobotModelInput, refusesChainsThatAreNone) {
  const std::string srdf = replaced(exampleSrdf(), R"(base_link="trunk" tip_link="hand")",
                                    R"(base_link="other_arm" tip_link="hand")");
  expectModelError(exampleUrdf(), srdf, {"'other_arm' is not above 'hand'", "branch"});
  expectModelError(exampleUrdf(),
                   replaced(exampleSrdf(), "tip_link=\"finger_left\"", "tip_link=\"finger_right\""),
                   {"'grip_mirror'", "outside the chain"});
}

TEST(RobotModelInput, namesBrokenStates) {
  const auto broken = [](const std::string& to, const Names& parts) {
    expectModelError(exampleUrdf(), replaced(exampleSrdf(), R"(<joint name="elbow" value="-0.5"/>)", to),
                     parts);
  };
  broken("", {"'home'", "no value", "'elbow'"});
  broken(R"(<joint name="elbow" value="-2.5"/>)", {"'elbow'", "-2.5", "limits"});
  broken(R"(<joint name="elbow" value="nan"/>)", {"no joint value"});
  for (const std::string told : {"x", "-0,5", "-0.5 0", "-0.5rad", "inf"})
    broken(R"(<joint name="elbow" value=")" + told + R"("/>)", {"'" + told + "' is no joint value"});
  broken(R"(<joint name="elbow"/>)", {"lacks 'value'"});
  broken(R"(<joint name="elbow" value="0"/><joint name="turn" value="0"/>)",
         {"'turn'", "valid: lift, elbow"});
  broken(R"(<joint name="elbow" value="0"/><joint name="wrist" value="0.3"/>)",
         {"'wrist' at 0.3, but it is fixed"});
  broken(R"(<joint name="elbow" value="0"/><joint name="grip_mirror" value="0.3"/>)",
         {"'grip_mirror'", "valid: lift, elbow"});
}

}  // namespace
}  // namespace fv_robot_model
