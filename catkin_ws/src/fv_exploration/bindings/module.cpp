#include "bindings.h"

namespace fv {

std::vector<Eigen::Matrix4d> toMatrices(
    const py::array_t<double, py::array::c_style | py::array::forcecast>& a) {
  const bool one = a.ndim() == 2;
  if (a.ndim() < 2 || a.ndim() > 3 || a.shape(a.ndim() - 1) != 4 || a.shape(a.ndim() - 2) != 4)
    throw InputError("transforms have " + std::to_string(a.ndim()) +
                     " dimensions; valid: shape (N, 4, 4) or (4, 4)");
  using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
  std::vector<Eigen::Matrix4d> out(one ? 1 : a.shape(0));
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = Eigen::Map<const RowMajor>(a.data() + 16 * i);
  return out;
}

Points toPoints(const py::array_t<double, py::array::c_style | py::array::forcecast>& a, const char* name) {
  if (a.ndim() == 1 && a.size() == 0) return Points(0, 3);  // an empty list
  if (a.ndim() != 2 || a.shape(1) != 3)
    throw InputError(std::string(name) + " has " + std::to_string(a.ndim()) + " dimensions, the last of " +
                     std::to_string(a.ndim() ? a.shape(a.ndim() - 1) : 0) + "; valid: shape (N, 3)");
  return Eigen::Map<const Points>(a.data(), a.shape(0), 3);
}

}  // namespace fv

PYBIND11_MODULE(_core, m) {
  m.doc() =
      "Occupancy map, frontiers, voids, utility and view gain. Metres and radians; map frame unless said "
      "otherwise.";
  const auto input_error = pybind11::register_exception<fv::InputError>(m, "InputError", PyExc_ValueError);
  pybind11::register_exception<fv::OutsideKeysError>(m, "OutsideKeysError", input_error);
  pybind11::register_exception<fv::MapFileError>(m, "MapFileError", PyExc_OSError);
  m.attr("NEAREST_RETURN_M") = fv::kNearestReturn;
  m.attr("FARTHEST_RETURN_M") = fv::kFarthestReturn;
  fv::bindMap(m);
  fv::bindEvaluation(m);
  fv::bindUtility(m);
  fv::bindGain(m);
  fv::bindFilters(m);
  fv::bindReference(m);
}
