#include "bindings.h"
#include "capability_map/shape_fit.h"

namespace capability_map {
namespace {

namespace py = pybind11;

/// (S, N) flags to arrays with one row per sphere.
py::dict fitMany(const Points& outward,
                 const py::array_t<bool, py::array::c_style | py::array::forcecast>& valid,
                 bool least_error) {
  if (valid.ndim() != 2 || valid.shape(1) != outward.rows()) {
    throw std::invalid_argument("valid must be (S, N) with N rows of outward");
  }
  const py::ssize_t spheres = valid.shape(0);
  py::array_t<uint8_t> type(spheres);
  py::array_t<float> axis({spheres, py::ssize_t{3}});
  py::array_t<float> opening(spheres);
  py::array_t<float> error(spheres);
  const AngleRule rule = least_error ? AngleRule::LeastError : AngleRule::CoverAll;
  std::vector<bool> flags(static_cast<size_t>(outward.rows()));
  for (py::ssize_t i = 0; i < spheres; ++i) {
    for (size_t k = 0; k < flags.size(); ++k) flags[k] = valid.at(i, static_cast<py::ssize_t>(k));
    const Shape shape = fitBestShape(outward, flags, rule);
    type.mutable_at(i) = static_cast<uint8_t>(shape.type);
    for (int c = 0; c < 3; ++c) axis.mutable_at(i, c) = static_cast<float>(shape.axis[c]);
    opening.mutable_at(i) = static_cast<float>(shape.opening_rad);
    error.mutable_at(i) = static_cast<float>(shape.error_percent);
  }
  py::dict out;
  out["type"] = type;
  out["axis"] = axis;
  out["opening_rad"] = opening;
  out["error_percent"] = error;
  return out;
}

}  // namespace

void bindShapes(py::module_& m) {
  m.def("fit_shapes", &fitMany, py::arg("outward"), py::arg("valid"), py::arg("least_error"),
        "n-vectors (N, 3) and flags (S, N) to a dict of type (S,) uint8 (0 empty, 1 cone, 2 double cone, 3 "
        "ring), axis "
        "(S, 3), opening_rad (S,), error_percent (S,). least_error False: the thesis's opening angle.");
}

}  // namespace capability_map
