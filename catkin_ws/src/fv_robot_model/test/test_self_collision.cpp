#include <fcl/narrowphase/collision.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "box_overlap.h"
#include "example_robot.h"
#include "fv_robot_model/fcl_geometry.h"
#include "fv_robot_model/self_collision.h"

namespace fv_robot_model {
namespace {

using testing::exampleRobot;
using testing::exampleUrdf;
using testing::randomConfiguration;

bool holds(const std::vector<LinkPair>& pairs, const LinkPair& pair) {
  return std::find(pairs.begin(), pairs.end(), pair) != pairs.end();
}

TEST(SelfCollision, checksOnlyPairsThatCanChange) {
  const auto pairs = SelfCollision(exampleRobot()).checkedPairs();
  const std::vector<LinkPair> expected{
      {"base", "arm"},           {"base", "hand"},     {"base", "other_arm"},
      {"trunk", "arm"},          {"trunk", "hand"},    {"carriage", "hand"},
      {"carriage", "other_arm"}, {"arm", "other_arm"}, {"hand", "other_arm"}};
  EXPECT_EQ(pairs,
            expected);  // not: disabled, joined by one joint, hand fixed to arm, fingers without shapes
}

TEST(SelfCollision, joinedLinksAreCheckedWhenAsked) {
  SelfCollisionConfig config;
  config.skip_adjacent = false;
  const auto pairs = SelfCollision(exampleRobot(), config).checkedPairs();
  EXPECT_TRUE(holds(pairs, {"base", "trunk"}));
  EXPECT_FALSE(holds(pairs, {"trunk", "carriage"}));  // the SRDF disables it
  EXPECT_FALSE(holds(pairs, {"arm", "hand"}));        // fixed to each other
}

TEST(SelfCollision, aGroupChecksOnlyWhatItsJointsMove) {
  const RobotModel model = exampleRobot();
  const auto pairs = SelfCollision(model, model.group("arm")).checkedPairs();
  EXPECT_FALSE(holds(pairs, {"base", "other_arm"}));
  EXPECT_TRUE(holds(pairs, {"base", "arm"}));
  EXPECT_TRUE(holds(pairs, {"hand", "other_arm"}));
}

TEST(SelfCollision, firstContactIsTheFirstOfAllContacts) {
  const RobotModel model = exampleRobot();
  const SelfCollision checker(model);
  std::mt19937 random(1);
  int touching = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const LinkPoses poses = model.forward(randomConfiguration(model, random));
    const auto all = checker.contacts(poses);
    const auto first = checker.firstContact(poses);
    EXPECT_EQ(first.has_value(), !all.empty());
    EXPECT_EQ(checker.inContact(poses), !all.empty());
    if (first) {
      EXPECT_EQ(*first, all.front());
      ++touching;
    }
  }
  EXPECT_GT(touching, 100);
  EXPECT_LT(touching, 2900);
}

/// Every pair of shapes by FCL alone, no bounds in between.
TEST(SelfCollision, boundsLoseNoContact) {
  const RobotModel model = exampleRobot();
  const SelfCollision checker(model);
  std::mt19937 random(2);
  for (int trial = 0; trial < 1000; ++trial) {
    const LinkPoses poses = model.forward(randomConfiguration(model, random));
    std::vector<LinkPair> expected;
    for (const LinkPair& pair : checker.checkedPairs()) {
      const int a = model.linkIndex(pair.first);
      const int b = model.linkIndex(pair.second);
      fcl::CollisionResultd result;
      fcl::collide(fclGeometry(model.shapes(a)[0]).get(), poses[a] * model.shapes(a)[0].T_link_shape,
                   fclGeometry(model.shapes(b)[0]).get(), poses[b] * model.shapes(b)[0].T_link_shape,
                   fcl::CollisionRequestd(), result);
      if (result.isCollision()) expected.push_back(pair);
    }
    EXPECT_EQ(checker.contacts(poses), expected);
  }
}

TEST(SelfCollision, boxTestNeverDeniesAnOverlap) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> size(0.02, 0.4);
  int overlaps = 0;
  int denied = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const Eigen::Vector3d a(size(random), size(random), size(random));
    const Eigen::Vector3d b(size(random), size(random), size(random));
    const Eigen::Isometry3d T_a_b = testing::randomPose(0.4, random);
    fcl::CollisionResultd result;
    const fcl::Boxd box_a(a);
    const fcl::Boxd box_b(b);
    fcl::collide(&box_a, Eigen::Isometry3d::Identity(), &box_b, T_a_b, fcl::CollisionRequestd(), result);
    const bool may = boxesMayTouch(T_a_b, 0.5 * a, 0.5 * b);
    if (result.isCollision()) {
      EXPECT_TRUE(may);
      ++overlaps;
    }
    denied += may ? 0 : 1;
  }
  EXPECT_GT(overlaps, 1000);
  EXPECT_EQ(overlaps + denied, 20000);  // for boxes the test is exact
}

TEST(SelfCollision, paddingIsAddedToBothLinks) {
  const RobotModel model = RobotModel::fromXml(R"(<robot name="r">
    <link name="a"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
    <link name="between"/>
    <link name="b"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
    <joint name="i" type="fixed"><parent link="a"/><child link="between"/></joint>
    <joint name="j" type="prismatic"><parent link="between"/><child link="b"/>
      <limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>)",
                                               "");
  const auto touches = [&](double padding_m, double distance_m) {
    return SelfCollision(model, SelfCollisionConfig{padding_m, true})
        .inContact(model.forward(Eigen::VectorXd::Constant(1, distance_m)));
  };
  EXPECT_TRUE(touches(0.0, 0.199));
  EXPECT_FALSE(touches(0.0, 0.201));
  EXPECT_TRUE(touches(0.05, 0.299));
  EXPECT_FALSE(touches(0.05, 0.301));
}

TEST(SelfCollision, refusesBadInput) {
  const RobotModel model = exampleRobot();
  EXPECT_THROW(SelfCollision(model, SelfCollisionConfig{-0.1, true}), std::invalid_argument);
  EXPECT_THROW(SelfCollision(model).inContact(LinkPoses(3)), std::invalid_argument);
  LinkPoses poses = model.forward(Eigen::VectorXd::Zero(5));
  poses[2].translation().y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(SelfCollision(model).inContact(poses), std::invalid_argument);
}

}  // namespace
}  // namespace fv_robot_model
