#include "fv_robot_model/self_filter.h"

#include <algorithm>
#include <cmath>

#include "internal.h"

namespace fv_robot_model {
namespace {

constexpr Eigen::Index kBlock = 64;       ///< Points looked at together: neighbours in a depth image.
constexpr double kShadowStep_m = 0.0005;  ///< How close to a link's surface a ray must come to count as hit.

void requireNotNegative(const char* name, double value) {
  if (!std::isfinite(value) || value < 0.0)
    throw std::invalid_argument(text(name, " must be finite and not negative, got ", value));
}

void requireFactor(const char* name, double value) {
  if (!std::isfinite(value) || value <= 0.0)
    throw std::invalid_argument(text(name, " must be finite and positive, got ", value));
}

/// A filter body where the robot stands now.
struct PlacedBody {
  const SelfFilter::Body* body;
  Eigen::Isometry3d T_shape_root;
  Eigen::Vector3d center;  ///< Of the bounding ball, root frame.
  double radius;           ///< Of the bounding ball, with padding and shadow.
};

std::vector<PlacedBody> place(const std::vector<SelfFilter::Body>& bodies, const LinkPoses& poses,
                              double reach_m) {
  std::vector<PlacedBody> placed;
  placed.reserve(bodies.size());
  for (const SelfFilter::Body& body : bodies)
    placed.push_back({&body, (poses[body.link] * body.shape.T_link_shape).inverse(),
                      poses[body.link] * body.bound.center, body.bound.radius + reach_m});
  return placed;
}

/// Bodies that some point of a block may be close to.
void selectNear(const std::vector<PlacedBody>& bodies, const Eigen::AlignedBox3d& block,
                std::vector<const PlacedBody*>& near) {
  near.clear();
  if (block.isEmpty()) return;
  for (const PlacedBody& body : bodies)
    if (block.squaredExteriorDistance(body.center) <= body.radius * body.radius) near.push_back(&body);
}

bool inside(const PlacedBody& placed, const Eigen::Vector3d& p_root) {
  if ((p_root - placed.center).squaredNorm() > placed.radius * placed.radius) return false;
  return isWithin(placed.body->shape, placed.T_shape_root * p_root, placed.body->padding_m);
}

/// Does the ray meet the padded body within `length_m` before p? Walks from p towards the sensor in steps as
/// long as the body is far, which cannot jump over it (sphere tracing).
bool rayMeets(const PlacedBody& placed, const Eigen::Vector3d& p_root, const Eigen::Vector3d& to_sensor,
              double length_m) {
  if ((p_root - placed.center).squaredNorm() > placed.radius * placed.radius) return false;
  const Eigen::Vector3d p = placed.T_shape_root * p_root;
  const Eigen::Vector3d direction = placed.T_shape_root.linear() * to_sensor;
  for (double s = 0.0; s <= length_m;) {
    const Eigen::Vector3d at = p + s * direction;
    double gap = distanceLowerBound(placed.body->shape, at) - placed.body->padding_m;
    if (gap > length_m - s) return false;
    if (gap <= kShadowStep_m) gap = signedDistance(placed.body->shape, at) - placed.body->padding_m;
    if (gap <= kShadowStep_m) return true;
    s += gap;
  }
  return false;
}

/// Labels one finite point.
PointClass label(const std::vector<const PlacedBody*>& near, const Eigen::Vector3d& p_root,
                 const Eigen::Vector3d& sensor_root, double shadow_m) {
  for (const PlacedBody* body : near)
    if (inside(*body, p_root)) return PointClass::Robot;
  const Eigen::Vector3d ray = sensor_root - p_root;
  const double range = ray.norm();
  if (shadow_m <= 0.0 || range <= 0.0) return PointClass::Scene;
  for (const PlacedBody* body : near)
    if (rayMeets(*body, p_root, ray / range, std::min(shadow_m, range))) return PointClass::Shadow;
  return PointClass::Scene;
}

Eigen::AlignedBox3d boxOfFinite(const Points& points) {
  Eigen::AlignedBox3d box;
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    if (points.row(i).allFinite()) box.extend(points.row(i).transpose());
  return box;
}

std::vector<PointClass> classifyPoints(const std::vector<PlacedBody>& bodies,
                                       const Eigen::Ref<const Points>& points,
                                       const Eigen::Isometry3d& T_root_points, double shadow_m) {
  std::vector<PointClass> labels(points.rows(), PointClass::Invalid);
  std::vector<const PlacedBody*> near;
  const Eigen::Vector3d sensor_root = T_root_points.translation();
  for (Eigen::Index start = 0; start < points.rows(); start += kBlock) {
    const Eigen::Index count = std::min(kBlock, points.rows() - start);
    const Points block = (points.middleRows(start, count) * T_root_points.linear().transpose()).rowwise() +
                         sensor_root.transpose();
    selectNear(bodies, boxOfFinite(block), near);
    for (Eigen::Index i = 0; i < count; ++i)
      if (block.row(i).allFinite())
        labels[start + i] = label(near, block.row(i).transpose(), sensor_root, shadow_m);
  }
  return labels;
}

}  // namespace

SelfFilter::SelfFilter(const RobotModel& model, const SelfFilterConfig& config)
    : link_count_(model.linkNames().size()), shadow_m_(config.shadow_m) {
  requireNotNegative("shadow_m", config.shadow_m);
  requireNotNegative("padding_m", config.padding_m);
  requireFactor("scale", config.scale);
  for (const auto& [name, link] : config.links) {
    model.linkIndex(name);
    requireNotNegative(("padding_m of link " + name).c_str(), link.padding_m.value_or(config.padding_m));
    requireFactor(("scale of link " + name).c_str(), link.scale.value_or(config.scale));
  }
  for (std::size_t i = 0; i < link_count_; ++i) addLink(model, static_cast<int>(i), config);
}

void SelfFilter::addLink(const RobotModel& model, int index, const SelfFilterConfig& config) {
  const auto found = config.links.find(model.linkNames()[index]);
  const LinkFilterConfig link = found == config.links.end() ? LinkFilterConfig{} : found->second;
  if (link.ignore) return;
  for (const Shape& shape : model.shapes(index)) {
    Body body{index,
              scaled(shape, link.scale.value_or(config.scale)),
              link.padding_m.value_or(config.padding_m),
              {}};
    body.bound = boundingSphere(body.shape);
    body.bound.radius += body.padding_m;
    bodies_.push_back(std::move(body));
  }
}

std::vector<PointClass> SelfFilter::classify(const Eigen::Ref<const Points>& points_sensor,
                                             const Eigen::Isometry3d& T_root_sensor,
                                             const LinkPoses& poses) const {
  checkPoses(poses, link_count_);
  if (!T_root_sensor.matrix().allFinite()) throw std::invalid_argument("T_root_sensor is not finite");
  return classifyPoints(place(bodies_, poses, shadow_m_), points_sensor, T_root_sensor, shadow_m_);
}

std::vector<std::uint8_t> SelfFilter::isRobot(const Eigen::Ref<const Points>& points_root,
                                              const LinkPoses& poses) const {
  checkPoses(poses, link_count_);
  const auto labels =
      classifyPoints(place(bodies_, poses, 0.0), points_root, Eigen::Isometry3d::Identity(), 0.0);
  std::vector<std::uint8_t> mask(labels.size());
  std::transform(labels.begin(), labels.end(), mask.begin(),
                 [](PointClass c) { return c == PointClass::Robot; });
  return mask;
}

}  // namespace fv_robot_model
