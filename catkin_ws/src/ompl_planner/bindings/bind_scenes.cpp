#include <octomap/OcTree.h>
#include <pybind11/eigen.h>

#include <stdexcept>

#include "bindings.h"
#include "scenes.h"

namespace py = pybind11;

namespace ompl_planner {
namespace {

using Boxes = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;

std::vector<Eigen::AlignedBox3d> boxesFrom(const Boxes& rows) {
  std::vector<Eigen::AlignedBox3d> boxes;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    boxes.emplace_back(Eigen::Vector3d(rows.row(i).head<3>()), Eigen::Vector3d(rows.row(i).tail<3>()));
  }
  return boxes;
}

}  // namespace

void bindScenes(py::module_& m) {
  m.def(
      "octree_payload",
      [](double resolution_m, const Boxes& free, const Boxes& occupied, const Boxes& unknown) {
        std::string payload;
        {
          const py::gil_scoped_release release;
          payload = binaryPayload(
              *makeOctree({resolution_m, boxesFrom(free), boxesFrom(occupied), boxesFrom(unknown)}));
        }
        return py::bytes(payload);
      },
      py::kw_only(), py::arg("resolution_m"), py::arg("free"), py::arg("occupied"), py::arg("unknown"),
      R"(Data of an octomap_msgs/Octomap (binary) for a scene of boxes.

Each argument is (N, 6), rows of min x y z, max x y z [m], map frame. Later arguments overwrite earlier ones; what
no box covers is unknown. Raises ValueError unless resolution_m > 0.)");
}

}  // namespace ompl_planner
