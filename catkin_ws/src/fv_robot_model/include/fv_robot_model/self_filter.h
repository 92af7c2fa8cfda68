/// Which points of a depth camera lie on the robot itself?
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "fv_robot_model/robot_model.h"

namespace fv_robot_model {

enum class PointClass : std::uint8_t {
  Scene = 0,
  Robot = 1,    ///< Within a padded link.
  Shadow = 2,   ///< Its ray passed through a padded link just before: a mixed pixel behind an edge.
  Invalid = 3,  ///< Not finite: no return.
};

/// Exception for one link; what is empty is as for the others.
struct LinkFilterConfig {
  std::optional<double> padding_m;
  std::optional<double> scale;
  bool ignore{false};  ///< True: this link removes nothing.
};

struct SelfFilterConfig {
  double padding_m{0.03};  ///< Points up to this far outside a link are the robot's [m].
  double scale{1.0};       ///< Factor on each shape about its own centre, before padding.
  double shadow_m{
      0.03};  ///< How far behind a padded link points are dropped along the ray [m]; 0: no shadow.
  std::map<std::string, LinkFilterConfig> links;  ///< Exceptions by link name.
};

/// Labels points by the robot's collision shapes. Immutable: queries are const and may run in many threads.
class SelfFilter {
 public:
  /// @throws std::invalid_argument for negative or infinite values, UnknownNameError for a link that does not
  /// exist.
  explicit SelfFilter(const RobotModel& model, const SelfFilterConfig& config = {});

  /// @param points_sensor (N, 3) sensor frame [m]; NaN allowed. @param T_root_sensor Sensor frame to root
  /// frame.
  /// @return N labels. N = 0 is valid.
  /// @throws std::invalid_argument when poses do not fit the model or are not finite.
  std::vector<PointClass> classify(const Eigen::Ref<const Points>& points_sensor,
                                   const Eigen::Isometry3d& T_root_sensor, const LinkPoses& poses) const;

  /// Same without rays: 1 where a point (N, 3), root frame, lies within a padded link; else (also NaN) 0.
  std::vector<std::uint8_t> isRobot(const Eigen::Ref<const Points>& points_root,
                                    const LinkPoses& poses) const;

  /// The body of one shape as the filter sees it.
  struct Body {
    int link{0};
    Shape shape;  ///< Scaled already.
    double padding_m{0.0};
    Sphere bound;  ///< Link frame, padding included.
  };
  const std::vector<Body>& bodies() const { return bodies_; }

 private:
  void addLink(const RobotModel& model, int index, const SelfFilterConfig& config);

  std::size_t link_count_{0};
  double shadow_m_{0.0};
  std::vector<Body> bodies_;
};

}  // namespace fv_robot_model
