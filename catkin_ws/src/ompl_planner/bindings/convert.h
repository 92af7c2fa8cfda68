/// Rows and dicts of Python to core types and back.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "ompl_planner/time_parameterization.h"

namespace ompl_planner {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

inline JointPath pathFromRows(const RowMatrix& rows) {
  JointPath path;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) path.push_back(rows.row(i).transpose());
  return path;
}

inline RowMatrix rowsFromPath(const JointPath& path) {
  RowMatrix rows(static_cast<Eigen::Index>(path.size()), path.empty() ? 0 : path.front().size());
  for (std::size_t i = 0; i < path.size(); ++i) rows.row(static_cast<Eigen::Index>(i)) = path[i].transpose();
  return rows;
}

inline pybind11::dict trajectoryToDict(const TimedTrajectory& trajectory) {
  using namespace pybind11::literals;
  return pybind11::dict("times"_a = trajectory.times, "positions"_a = rowsFromPath(trajectory.positions),
                        "velocities"_a = rowsFromPath(trajectory.velocities),
                        "accelerations"_a = rowsFromPath(trajectory.accelerations));
}

inline TimedTrajectory trajectoryFromDict(const pybind11::dict& dict) {
  TimedTrajectory trajectory;
  trajectory.times = dict["times"].cast<std::vector<double>>();
  trajectory.positions = pathFromRows(dict["positions"].cast<RowMatrix>());
  trajectory.velocities = pathFromRows(dict["velocities"].cast<RowMatrix>());
  trajectory.accelerations = pathFromRows(dict["accelerations"].cast<RowMatrix>());
  return trajectory;
}

}  // namespace ompl_planner
