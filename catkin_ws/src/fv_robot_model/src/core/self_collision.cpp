#include "fv_robot_model/self_collision.h"

#include <fcl/narrowphase/collision.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "box_overlap.h"
#include "fv_robot_model/fcl_geometry.h"
#include "internal.h"

namespace fv_robot_model {
namespace {

struct Body {
  std::shared_ptr<const fcl::CollisionGeometryd> geometry;
  Eigen::Isometry3d T_link_shape;
  Eigen::Isometry3d T_link_box;  ///< Frame in the middle of the shape's bounding box.
  Eigen::Vector3d half_box;
};

struct LinkBody {
  std::vector<Body> bodies;
  Sphere bound;  ///< Link frame.
};

Body makeBody(const Shape& shape) {
  const Eigen::AlignedBox3d box = boundingBox(shape);
  return {fclGeometry(shape), shape.T_link_shape, shape.T_link_shape * Eigen::Translation3d(box.center()),
          0.5 * box.sizes()};
}

/// A ball around the balls of all shapes of a link.
Sphere ballAround(const Spheres& balls) {
  Sphere all;
  for (const Sphere& ball : balls) all.center += ball.center / static_cast<double>(balls.size());
  for (const Sphere& ball : balls)
    all.radius = std::max(all.radius, (ball.center - all.center).norm() + ball.radius);
  return all;
}

LinkBody makeLinkBody(const std::vector<Shape>& shapes, double padding_m) {
  LinkBody link;
  Spheres balls;
  for (const Shape& shape : shapes) {
    const Shape grown = padded(shape, padding_m);
    link.bodies.push_back(makeBody(grown));
    balls.push_back(boundingSphere(grown));
  }
  link.bound = ballAround(balls);
  return link;
}

bool bodiesTouch(const Body& a, const Eigen::Isometry3d& T_root_a, const Body& b,
                 const Eigen::Isometry3d& T_root_b) {
  const Eigen::Isometry3d T_abox_bbox = (T_root_a * a.T_link_box).inverse() * (T_root_b * b.T_link_box);
  if (!boxesMayTouch(T_abox_bbox, a.half_box, b.half_box)) return false;
  fcl::CollisionResultd result;
  fcl::collide(a.geometry.get(), T_root_a * a.T_link_shape, b.geometry.get(), T_root_b * b.T_link_shape,
               fcl::CollisionRequestd(1, false), result);
  return result.isCollision();
}

bool linksTouch(const LinkBody& a, const Eigen::Isometry3d& T_root_a, const LinkBody& b,
                const Eigen::Isometry3d& T_root_b) {
  for (const Body& body_a : a.bodies)
    for (const Body& body_b : b.bodies)
      if (bodiesTouch(body_a, T_root_a, body_b, T_root_b)) return true;
  return false;
}

/// The variables between the root and each link: two links with the same ones never move against each other.
std::vector<std::set<int>> variablesAbove(const RobotModel& model) {
  std::vector<std::set<int>> above(model.linkNames().size());
  for (std::size_t i = 1; i < above.size(); ++i) {
    const RobotModel::Link& link = model.link(static_cast<int>(i));
    above[i] = above[link.parent];
    // A mimic moves differently from its leader, so it counts as a variable of its own.
    if (link.variable >= 0) above[i].insert(link.mimic ? -static_cast<int>(i) : link.variable);
  }
  return above;
}

/// Which of the group's joints (and their mimics) move each link.
std::vector<std::set<int>> onlyOf(const Group& group, const RobotModel& model,
                                  std::vector<std::set<int>> above) {
  for (std::set<int>& variables : above) {
    std::set<int> kept;
    for (const int v : variables) {
      const int variable = v < 0 ? model.link(-v).variable : v;
      const auto& indices = group.joint_indices;
      if (std::find(indices.begin(), indices.end(), variable) != indices.end()) kept.insert(v);
    }
    variables = kept;
  }
  return above;
}

}  // namespace

struct SelfCollision::Data {
  std::vector<std::string> names;
  std::vector<LinkBody> links;
  std::vector<std::pair<int, int>> pairs;

  Data(const RobotModel& model, const std::vector<std::set<int>>& movers, const SelfCollisionConfig& config)
      : names(model.linkNames()) {
    const int count = static_cast<int>(names.size());
    for (int i = 0; i < count; ++i) links.push_back(makeLinkBody(model.shapes(i), config.padding_m));
    const std::set<LinkPair> disabled(model.disabledPairs().begin(), model.disabledPairs().end());
    for (int a = 0; a < count; ++a)
      for (int b = a + 1; b < count; ++b) {
        const bool solid = !links[a].bodies.empty() && !links[b].bodies.empty();
        const bool joined = config.skip_adjacent && model.parent(b) == a;
        if (solid && !joined && movers[a] != movers[b] &&
            disabled.count(std::minmax(names[a], names[b])) == 0)
          pairs.emplace_back(a, b);
      }
  }

  /// Calls use(a, b) for the pairs in contact, in order, until it returns false.
  template <typename Use>
  void visitContacts(const LinkPoses& poses, Use use) const {
    checkPoses(poses, links.size());
    std::vector<Eigen::Vector3d> centers(links.size());
    for (std::size_t i = 0; i < links.size(); ++i) centers[i] = poses[i] * links[i].bound.center;
    for (const auto& [a, b] : pairs) {
      const double reach = links[a].bound.radius + links[b].bound.radius;
      if ((centers[a] - centers[b]).squaredNorm() > reach * reach) continue;
      if (linksTouch(links[a], poses[a], links[b], poses[b]) && !use(a, b)) return;
    }
  }

  LinkPair pairNames(int a, int b) const { return {names[a], names[b]}; }
};

SelfCollision::SelfCollision(const RobotModel& model, const SelfCollisionConfig& config)
    : data_(std::make_shared<const Data>(model, variablesAbove(model), config)) {}

SelfCollision::SelfCollision(const RobotModel& model, const Group& group, const SelfCollisionConfig& config)
    : data_(std::make_shared<const Data>(model, onlyOf(group, model, variablesAbove(model)), config)) {}

std::optional<LinkPair> SelfCollision::firstContact(const LinkPoses& poses) const {
  std::optional<LinkPair> first;
  data_->visitContacts(poses, [&](int a, int b) {
    first = data_->pairNames(a, b);
    return false;
  });
  return first;
}

bool SelfCollision::inContact(const LinkPoses& poses) const {
  bool contact = false;
  data_->visitContacts(poses, [&](int, int) {
    contact = true;
    return false;
  });
  return contact;
}

std::vector<LinkPair> SelfCollision::contacts(const LinkPoses& poses) const {
  std::vector<LinkPair> all;
  data_->visitContacts(poses, [&](int a, int b) {
    all.push_back(data_->pairNames(a, b));
    return true;
  });
  return all;
}

std::vector<LinkPair> SelfCollision::checkedPairs() const {
  std::vector<LinkPair> names;
  for (const auto& [a, b] : data_->pairs) names.push_back(data_->pairNames(a, b));
  return names;
}

}  // namespace fv_robot_model
