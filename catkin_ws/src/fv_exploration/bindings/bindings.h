#pragma once
#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "fv_exploration/occupancy_map.h"

namespace fv {

namespace py = pybind11;

void bindMap(py::module_& m);
void bindEvaluation(py::module_& m);
void bindUtility(py::module_& m);
void bindGain(py::module_& m);
void bindFilters(py::module_& m);
void bindReference(py::module_& m);

/// Numpy array of these shape and type that owns its data.
template <class T>
py::array_t<T> toArray(const std::vector<T>& values) {
  return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
}

/// (N, 3) float32 centres [m].
inline PointsF centres(const OccupancyMap& map, const std::vector<Voxel>& voxels) {
  PointsF out(voxels.size(), 3);
  for (std::size_t i = 0; i < voxels.size(); ++i) out.row(i) = map.centre(voxels[i]).cast<float>();
  return out;
}

/// (N, 4, 4) numpy array to matrices; (4, 4) is one. @throws InputError for other shapes.
std::vector<Eigen::Matrix4d> toMatrices(
    const py::array_t<double, py::array::c_style | py::array::forcecast>& array);

/// (N, 3) points of any float type; @throws InputError for other shapes.
Points toPoints(const py::array_t<double, py::array::c_style | py::array::forcecast>& array,
                const char* name);

}  // namespace fv
