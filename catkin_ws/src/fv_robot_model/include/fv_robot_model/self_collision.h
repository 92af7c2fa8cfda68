/// Does the robot touch itself?
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fv_robot_model/robot_model.h"

namespace fv_robot_model {

struct SelfCollisionConfig {
  double padding_m{0.0};     ///< Each shape grows by this much, so links closer than twice that touch.
  bool skip_adjacent{true};  ///< Leave out links joined by one joint even when the SRDF does not list them.
};

/// Contact between links by FCL, behind bounding spheres and boxes.
///
/// Never checked: pairs that the SRDF disables, pairs that no joint moves against each other. Stateless after
/// construction: all queries are const and may run in many threads at once. What is needed of the model is
/// copied, so the model may go away; copies of the checker share that.
class SelfCollision {
 public:
  /// Every pair of links. @throws std::invalid_argument unless padding_m is finite and not negative.
  explicit SelfCollision(const RobotModel& model, const SelfCollisionConfig& config = {});
  /// Only the pairs whose relative pose the group's joints can change.
  SelfCollision(const RobotModel& model, const Group& group, const SelfCollisionConfig& config = {});

  /// The first pair in contact, in the order of link indices; empty when the robot is free of itself.
  /// @throws std::invalid_argument when poses do not fit the model's number of links.
  std::optional<LinkPair> firstContact(const LinkPoses& poses) const;
  bool inContact(const LinkPoses& poses) const;
  /// All pairs in contact.
  std::vector<LinkPair> contacts(const LinkPoses& poses) const;
  /// Pairs of links that are checked.
  std::vector<LinkPair> checkedPairs() const;

 private:
  struct Data;
  std::shared_ptr<const Data> data_;  // immutable, so copies may share it
};

}  // namespace fv_robot_model
