#include <pybind11/eval.h>

#include <cmath>

#include "bindings.h"
#include "convex_hull.h"
#include "fv_exploration/evaluator.h"
#include "void_clusters.h"

namespace fv {

namespace {

/// One row of the structured array of ellipsoids.
struct EllipsoidRow {
  double center[3];
  double axes[9];
  double semi_axes[3];
  int64_t count;
  double fit;
  double volume;
};

py::array ellipsoidArray(const std::vector<Ellipsoid>& ellipsoids) {
  std::vector<EllipsoidRow> rows;
  for (const Ellipsoid& e : ellipsoids) {
    EllipsoidRow row{};
    for (int i = 0; i < 3; ++i) {
      row.center[i] = e.center[i];
      row.semi_axes[i] = e.semi_axes[i];
      for (int j = 0; j < 3; ++j) row.axes[3 * i + j] = e.axes(i, j);
    }
    row.count = e.count;
    row.fit = e.fit;
    row.volume = e.volume;
    rows.push_back(row);
  }
  const py::dtype type = py::dtype::from_args(py::eval(
      "[('center', 'f8', 3), ('axes', 'f8', (3, 3)), ('semi_axes', 'f8', 3), ('count', 'i8'), ('fit', 'f8'), "
      "('volume', 'f8')]"));
  return py::array(type, static_cast<py::ssize_t>(rows.size()), rows.data());
}

/// A result with its arrays, which are made when they are asked for.
class PyEvaluation {
 public:
  PyEvaluation(const Evaluator& evaluator, py::object owner)
      : evaluator_(&evaluator), owner_(std::move(owner)), result_(evaluator.sharedEvaluation()) {}

  const Evaluation& result() const { return *result_; }
  py::object frontier() { return frontiers()[0]; }
  py::object frontierCluster() { return frontiers()[1]; }
  py::object voids() { return allVoids()[0]; }
  py::object voidEllipsoid() { return allVoids()[1]; }

 private:
  using Lister = void (Evaluator::*)(std::vector<Voxel>&, std::vector<int>&) const;

  py::tuple& fill(py::tuple& pair, Lister list) {
    if (pair.size() == 2) return pair;
    if (evaluator_->evaluation().update != result_->update)
      throw InputError("evaluation is of update " + std::to_string(result_->update) +
                       ", the evaluator is at " + std::to_string(evaluator_->evaluation().update) +
                       "; valid: read its voxels before the next update");
    std::vector<Voxel> voxels;
    std::vector<int> labels;
    (evaluator_->*list)(voxels, labels);
    pair = py::make_tuple(centres(evaluator_->map(), voxels), toArray(labels));
    return pair;
  }
  py::tuple& frontiers() { return fill(frontier_, &Evaluator::frontier); }
  py::tuple& allVoids() { return fill(voids_, &Evaluator::voids); }

  const Evaluator* evaluator_;
  py::object owner_;
  std::shared_ptr<const Evaluation> result_;
  py::tuple frontier_, voids_;
};

void bindConfig(py::module_& m) {
  const EvaluationConfig d;
  py::class_<EvaluationConfig>(
      m, "EvaluationConfig",
      "How a map is evaluated: min_fit (S that a merger of void ellipsoids needs, (0, 1]), seed, "
      "seed_share,\n"
      "literal_formula (thesis 3.1, 3.2 to the letter), tiled (False: nearest pairs first everywhere, as in "
      "the thesis,\n"
      "anew in each update), threads (0: all cores). InputError for values out of range.")
      .def(py::init(
               [](double min_fit, uint64_t seed, double seed_share, bool literal, bool tiled, int threads) {
                 EvaluationConfig c{min_fit, seed, seed_share, literal, tiled, threads};
                 c.validate();
                 return c;
               }),
           py::kw_only(), py::arg("min_fit") = d.min_fit, py::arg("seed") = d.seed,
           py::arg("seed_share") = d.seed_share, py::arg("literal_formula") = d.literal_formula,
           py::arg("tiled") = d.tiled, py::arg("threads") = d.threads)
      .def_readonly("min_fit", &EvaluationConfig::min_fit)
      .def_readonly("seed", &EvaluationConfig::seed)
      .def_readonly("seed_share", &EvaluationConfig::seed_share)
      .def_readonly("literal_formula", &EvaluationConfig::literal_formula)
      .def_readonly("tiled", &EvaluationConfig::tiled)
      .def_readonly("threads", &EvaluationConfig::threads);
}

std::vector<std::pair<int, py::array_t<int>>> frontierVoids(const PyEvaluation& e) {
  std::vector<std::pair<int, py::array_t<int>>> out;
  for (const FrontierVoid& fv : e.result().frontier_voids)
    out.emplace_back(fv.ellipsoid,
                     py::array_t<int>(fv.last - fv.first, &e.result().neighbour_clusters[fv.first]));
  return out;
}

void bindResult(py::module_& m) {
  py::class_<PyEvaluation>(
      m, "Evaluation",
      "What an update found. Voxel arrays are made at first access, which must come before the next\n"
      "update (InputError after it).")
      .def_property_readonly("frontier", &PyEvaluation::frontier, "(N, 3) float32 centres [m].")
      .def_property_readonly("frontier_cluster", &PyEvaluation::frontierCluster,
                             "(N,) int32 cluster of each frontier voxel, 0 to frontier_clusters - 1.")
      .def_property_readonly("void", &PyEvaluation::voids, "(M, 3) float32 centres [m].")
      .def_property_readonly("void_ellipsoid", &PyEvaluation::voidEllipsoid,
                             "(M,) int32 index into ellipsoids of each void voxel.")
      .def_property_readonly(
          "ellipsoids", [](const PyEvaluation& e) { return ellipsoidArray(e.result().ellipsoids); },
          "Structured array (E,), largest count first: center (3,) [m], axes (3, 3) a rotation whose columns "
          "belong to\n"
          "semi_axes (3,) [m], largest first; count voxels; fit S; volume [m^3].")
      .def_property_readonly("frontier_voids", &frontierVoids,
                             "List of (ellipsoid index, frontier clusters that neighbour it).")
      .def_property_readonly("frontier_clusters", [](const PyEvaluation& e) { return e.result().clusters; })
      .def_property_readonly("map_sequence", [](const PyEvaluation& e) { return e.result().map_sequence; })
      .def_property_readonly("counts", [](const PyEvaluation& e) { return e.result().counts; })
      .def_property_readonly(
          "timings", [](const PyEvaluation& e) { return e.result().timings; }, "Seconds.");
}

/// @throws InputError unless each is there once, in order, within OctoMap's keys.
std::vector<Voxel> orderedVoxels(const Voxels& voxels) {
  std::vector<Voxel> out;
  out.reserve(voxels.rows());
  for (Eigen::Index i = 0; i < voxels.rows(); ++i) {
    const Voxel v = voxels.row(i);
    for (const int c : v) require(c >= -kKeyOffset && c < kKeyOffset, "voxels", c, "-32768 to 32767");
    if (!out.empty() && voxelId(v) <= voxelId(out.back()))
      throw InputError("voxels are not in order at row " + std::to_string(i) +
                       "; valid: each once, ascending with z, then y, then x");
    out.push_back(v);
  }
  return out;
}

py::tuple hullOf(const Evaluator& e) {
  Voxels vertices(e.hull().vertices.size(), 3), triangles(e.hull().triangles.size(), 3);
  for (std::size_t i = 0; i < e.hull().vertices.size(); ++i) vertices.row(i) = e.hull().vertices[i];
  for (std::size_t i = 0; i < e.hull().triangles.size(); ++i)
    for (int k = 0; k < 3; ++k) triangles(i, k) = e.hull().triangles[i].corners[k];
  return py::make_tuple(vertices, triangles);
}

}  // namespace

void bindEvaluation(py::module_& m) {
  bindConfig(m);
  bindResult(m);
  py::class_<Evaluator>(
      m, "Evaluator",
      "Frontiers, voids, their clusters and neighbourhoods of a map, updated where it changed.\n\n"
      "Frontier: free with an unknown 26-neighbour within the bounds. Void: unknown, inside the convex hull\n"
      "of the occupied voxels' centres. Fewer than 4 of these, or all in a plane: no voids.")
      .def(py::init<const OccupancyMap&, const EvaluationConfig&>(), py::arg("map"),
           py::arg("config") = EvaluationConfig{}, py::keep_alive<1, 2>())
      .def(
          "update",
          [](py::object self) {
            auto& evaluator = self.cast<Evaluator&>();
            {
              const py::gil_scoped_release released;
              evaluator.update();
            }
            return PyEvaluation(evaluator, self);
          },
          "Bring everything up to date with the map. Returns Evaluation.")
      .def(
          "initial_ellipsoids", [](const Evaluator& e) { return ellipsoidArray(e.initialEllipsoids()); },
          "The ellipsoids that merging starts from, as Evaluation.ellipsoids; computed at each call.")
      .def("hull", &hullOf, "(vertices (K, 3) int32 voxels, triangles (F, 3) indices); empty without a hull.")
      .def_property_readonly("config", &Evaluator::config);
  m.def(
      "cluster_voids",
      [](const Voxels& voxels, const EvaluationConfig& config, double resolution_m) {
        const std::vector<Voxel> list = orderedVoxels(voxels);
        require(resolution_m > 0 && std::isfinite(resolution_m), "resolution_m", resolution_m,
                "above 0, finite");
        const EllipsoidModel model{resolution_m, config.literal_formula};
        std::vector<int> labels;
        std::vector<Ellipsoid> ellipsoids;
        {
          const py::gil_scoped_release released;
          const ClusterRule rule{model, config.min_fit, config.seed, config.seed_share};
          for (const VoidNode& node : clusterVoids(list, rule, labels).nodes)
            ellipsoids.push_back(fitEllipsoid(node.moments, model));
        }
        return py::make_tuple(toArray(labels), ellipsoidArray(ellipsoids));
      },
      py::arg("voxels"), py::arg("config"), py::arg("resolution_m"),
      "Seeding and merging nearest first (thesis 3.1.1) of voxels (N, 3) int32, ascending with z, y, x.\n"
      "Returns (labels (N,), ellipsoids (E,)), ellipsoids ascending by their first voxel.");
}

}  // namespace fv
