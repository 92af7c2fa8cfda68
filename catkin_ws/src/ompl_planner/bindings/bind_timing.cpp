#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <utility>

#include "bindings.h"
#include "convert.h"
#include "ompl_planner/time_parameterization.h"

namespace py = pybind11;

namespace ompl_planner {

void bindTiming(py::module_& m) {
  m.def(
      "time_optimal_trajectory",
      [](const RowMatrix& waypoints, const std::vector<double>& radii, const Eigen::VectorXd& velocity,
         const Eigen::VectorXd& acceleration, double sample_period_s, double smoothing_time_s,
         double limit_share) {
        TimingOptions options;
        options.sample_period_s = sample_period_s;
        options.smoothing_time_s = smoothing_time_s;
        options.limit_share = limit_share;
        TimedTrajectory trajectory;
        {
          const py::gil_scoped_release release;
          trajectory = timeOptimalTrajectory(BlendedPath(pathFromRows(waypoints), radii),
                                             {velocity, acceleration}, options);
        }
        return trajectoryToDict(trajectory);
      },
      py::kw_only(), py::arg("waypoints"), py::arg("radii"), py::arg("velocity"), py::arg("acceleration"),
      py::arg("sample_period_s") = 0.01, py::arg("smoothing_time_s") = 0.02, py::arg("limit_share") = 0.975,
      R"(The fastest motion along a polyline with rounded corners.

waypoints (N, J) [rad]; radii (N,) [rad]; velocity, acceleration (J,) [rad/s], [rad/s^2]. Returns a dict of times (T,) [s],
positions, velocities, accelerations (T, J). Raises ValueError for input out of range.)");

  m.def(
      "sample_blended_path",
      [](const RowMatrix& waypoints, const std::vector<double>& radii, const Eigen::VectorXd& parameters) {
        const BlendedPath path(pathFromRows(waypoints), radii);
        JointPath q;
        for (const double s : parameters) q.push_back(path.at(s * path.length()).q);
        return rowsFromPath(q);
      },
      py::kw_only(), py::arg("waypoints"), py::arg("radii"), py::arg("parameters"),
      "Positions (P, J) [rad] of the rounded path at shares (P,) in [0, 1] of its length.");

  m.def(
      "interpolate",
      [](const py::dict& trajectory, const Eigen::VectorXd& times) {
        const TimedTrajectory timed = trajectoryFromDict(trajectory);
        JointPath q;
        JointPath dq;
        JointPath ddq;
        for (const double t : times) {
          const PathPoint point = interpolate(timed, t);
          q.push_back(point.q);
          dq.push_back(point.dq);
          ddq.push_back(point.ddq);
        }
        return py::make_tuple(rowsFromPath(q), rowsFromPath(dq), rowsFromPath(ddq));
      },
      py::kw_only(), py::arg("trajectory"), py::arg("times"),
      "Position, velocity, acceleration (T, J) of a trajectory's quintic splines at times (T,) [s].");
}

}  // namespace ompl_planner
