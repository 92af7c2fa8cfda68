#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "fv_exploration/view_gain.h"

namespace fv {

/// How likely a ray of the sensor is to come back, learned from the rays that did and that did not.
///
/// A ray without return shows nothing, so a view into the open has no gain, however much unknown space lies
/// there. Counting model of Haehnel, Triebel, Burgard and Thrun, "Map Building with Mobile Robots in Dynamic
/// Environments", ICRA 2003: a cell sends a ray back with the share of those that met it and were sent back.
/// A cell that no ray has met yet does so with the share that such cells had so far; that prior weighs as
/// much as one ray. Cells lie within the bounds and around them as far as the sensor sees: what a ray meets
/// beyond the bounds decides what it shows within them.
class ReturnChance {
 public:
  /// @param bounds_min, bounds_max of the explored volume [m]. @param cell_m edge of a cell.
  /// @param camera of the rays: its ranges bound them, its pixels are the rays of a scan.
  /// @throws InputError.
  ReturnChance(const Eigen::Vector3d& bounds_min, const Eigen::Vector3d& bounds_max, double cell_m,
               const PinholeCamera& camera);

  /// Learn from a scan. A pixel with a point in it came back from the nearest one, others did not.
  /// @param points_sensor (N, 3) optical frame [m]; rows that are not finite or out of range are none.
  /// @param hidden one per ray of the camera: not 0 where the robot itself was in the way, which teaches
  /// nothing; empty: nowhere.
  /// @throws InputError.
  void note(const Eigen::Matrix4d& T_map_sensor, const Points& points_sensor,
            const std::vector<uint8_t>& hidden);

  /// What to expect of each ray of each view: the chance to come back from within the sensor's range, and the
  /// length at which a known surface, a cell that sends back more than it lets pass, ends what the ray can
  /// show.
  /// @param stride only every stride-th ray of every stride-th row is followed, and speaks for those beside
  /// it.
  /// @throws InputError naming the view.
  RayOutlook outlook(const std::vector<Eigen::Matrix4d>& T_map_cameras, int stride, int threads) const;

  int rayCount() const { return static_cast<int>(rays_.size()); }
  /// Share of the cells met for the first time that sent the ray back.
  double prior() const;

 private:
  static constexpr int kMost = 63;  ///< a count that would pass it is halved, with its counterpart

  struct Counts {
    uint8_t hits = 0, passes = 0;
  };
  class Walk;

  void learn(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double range_m, bool returned);
  void count(int64_t cell, bool hit);
  float reflects(int64_t cell) const;
  void expect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, float& chance,
              float& reach_m) const;
  /// Of the rays of a stride the number of the one nearest to each ray.
  std::vector<int> nearestOf(int stride) const;
  void tabulate();

  PinholeCamera camera_;
  std::vector<Eigen::Vector3d> rays_;
  double cell_m_;
  Eigen::Vector3d corner_;  ///< of the grid [m]
  Voxel dims_;
  std::vector<Counts> cells_;
  int64_t first_hits_ = 0, first_passes_ = 0;
  std::array<float, (kMost + 1) * (kMost + 1)> reflects_{};  ///< chance of a cell by its counts
};

}  // namespace fv
