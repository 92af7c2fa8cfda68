#pragma once
#include <pybind11/pybind11.h>

namespace fv {

/// Which instruction set the inner loops use, and how fast they are with each.
void bindLanes(pybind11::module_& m);

}  // namespace fv
