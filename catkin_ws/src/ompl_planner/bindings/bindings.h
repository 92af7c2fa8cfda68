/// One function per concept; module.cpp calls them all.
#pragma once

#include <pybind11/pybind11.h>

namespace ompl_planner {

void bindScenes(pybind11::module_& m);
void bindTiming(pybind11::module_& m);
void bindPlanner(pybind11::module_& m);

}  // namespace ompl_planner
