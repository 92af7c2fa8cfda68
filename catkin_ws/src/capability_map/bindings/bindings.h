/// One bind function per concept; module.cpp calls them in order of dependence.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

namespace capability_map {

void bindSpheres(pybind11::module_& m);
void bindQuery(pybind11::module_& m);
void bindShapes(pybind11::module_& m);

/// float64 array, C order; anything else is converted on the way in.
using Array = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;

}  // namespace capability_map
