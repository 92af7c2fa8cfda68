#pragma once
#include <array>
#include <random>

#include "fv_exploration/occupancy_map.h"

/// A sequence of scans to all sides; sometimes much of what was occupied becomes free.
class Walk {
 public:
  explicit Walk(int seed) : rng_(seed) {}
  void step(fv::OccupancyMap& map) {
    fv::Points points(std::array<int, 3>{2, 40, 300}[rng_() % 3], 3);
    for (Eigen::Index i = 0; i < points.size(); ++i) points.data()[i] = uniform(1.5);
    Eigen::Matrix4d T_map_sensor = Eigen::Matrix4d::Identity();
    for (int axis = 0; axis < 3; ++axis) T_map_sensor(axis, 3) = at_[axis] += uniform(0.5);
    map.insertScan(points, T_map_sensor, {}, fv::Points(0, 3));
    if (rng_() % 3) return;
    const fv::Points occupied = map.voxels(fv::kOccupied).cast<double>();
    map.markFree(occupied.topRows(occupied.rows() / 2));
  }
  bool coin() { return rng_() % 2; }

 private:
  double uniform(double most) { return std::uniform_real_distribution<double>(-most, most)(rng_); }
  std::mt19937 rng_;
  Eigen::Vector3d at_ = Eigen::Vector3d::Zero();
};
