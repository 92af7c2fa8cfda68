/// One bind function per concept; module.cpp calls them in order of dependence.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "fv_robot_model/robot_model.h"

namespace fv_robot_model {

void bindRobotModel(pybind11::module_& m);
void bindShapes(pybind11::module_& m);
void bindSelfCollision(pybind11::module_& m);
void bindSelfFilter(pybind11::module_& m);
void bindSpace(pybind11::module_& m);
void bindIk(pybind11::module_& m);  // bind_ik.cpp

/// float64 array, C order; anything else is converted on the way in.
using Array = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;

/// (4, 4) homogeneous matrix to a rigid motion.
/// @throws std::invalid_argument unless finite, with a rotation and the last row 0 0 0 1 (tolerance 1e-6).
Eigen::Isometry3d isometryFromArray(const Array& matrix, const std::string& name);

/// (L, 4, 4) as RobotModel::forward gives it. Errors as isometryFromArray.
LinkPoses posesFromArray(const Array& matrices);

/// Writes a rigid motion as 16 row-major numbers.
void writeMatrix(const Eigen::Isometry3d& T, double* out);

}  // namespace fv_robot_model
