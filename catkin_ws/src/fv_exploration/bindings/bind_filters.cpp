#include "bindings.h"
#include "cloud_filters.h"

namespace fv {

void bindFilters(py::module_& m) {
  const FilterConfig d;
  py::class_<FilterConfig>(
      m, "FilterConfig",
      "Filters before integration, all off by default, in this order: range [m], thinning to one point\n"
      "per cube, statistical outliers, isolated points. InputError for values out of range.")
      .def(py::init([](double min_range_m, double max_range_m, double voxel_leaf_m, int outlier_neighbours,
                       double outlier_deviations, double isolated_radius_m, int isolated_neighbours) {
             FilterConfig c{min_range_m,        max_range_m,       voxel_leaf_m,       outlier_neighbours,
                            outlier_deviations, isolated_radius_m, isolated_neighbours};
             c.validate();
             return c;
           }),
           py::kw_only(), py::arg("min_range_m") = d.min_range_m, py::arg("max_range_m") = d.max_range_m,
           py::arg("voxel_leaf_m") = d.voxel_leaf_m, py::arg("outlier_neighbours") = d.outlier_neighbours,
           py::arg("outlier_deviations") = d.outlier_deviations,
           py::arg("isolated_radius_m") = d.isolated_radius_m,
           py::arg("isolated_neighbours") = d.isolated_neighbours);
  m.def(
      "filter_cloud",
      [](const py::array_t<double, py::array::c_style | py::array::forcecast>& points,
         const FilterConfig& config) {
        const PointsF list = toPoints(points, "points_sensor").cast<float>();
        const py::gil_scoped_release released;
        return filterCloud(list, config);
      },
      py::arg("points_sensor"), py::arg("config"),
      "(M, 3) float32 points of (N, 3) that pass, sensor frame. Rows that are not finite, or at ranges that "
      "no "
      "sensor sees,\n"
      "are gone, so that rows no longer match pixels: rays without return cannot clear anything after it.");
}

}  // namespace fv
