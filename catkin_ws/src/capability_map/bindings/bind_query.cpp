#include "bindings.h"
#include "capability_map/capability_query.h"
#include "capability_map/seed_lookup.h"
#include "view_direction.h"

namespace capability_map {
namespace {

namespace py = pybind11;

SphereBits bitsOf(const Points& view_directions, std::vector<int32_t> row_of_cell,
                  std::vector<uint64_t> words) {
  SphereBits bits;
  bits.row_of_cell = std::move(row_of_cell);
  bits.words = std::move(words);
  bits.words_per_row = static_cast<int>((view_directions.rows() + 63) / 64);
  return bits;
}

CapabilityQuery makeQuery(const SphereGrid& grid, const Points& view_directions,
                          std::vector<int32_t> row_of_cell, std::vector<uint64_t> words, double wrist_m,
                          const Eigen::Vector3d& shoulder) {
  return CapabilityQuery(grid, view_directions,
                         bitsOf(view_directions, std::move(row_of_cell), std::move(words)),
                         {wrist_m, shoulder});
}

void checkViews(const Array& positions, const Array& directions) {
  const auto isPoints = [](const Array& a) { return a.ndim() == 2 && a.shape(1) == 3; };
  if (!isPoints(positions) || !isPoints(directions) || positions.shape(0) != directions.shape(0)) {
    throw std::invalid_argument("positions and directions must both be (N, 3)");
  }
}

/// work(i, position, direction) for each view, without the GIL; what it refuses is told with the view's
/// number.
template <class Work>
void forEachView(const Array& positions, const Array& directions, const Work& work) {
  const double* p = positions.data();
  const double* d = directions.data();
  const py::ssize_t count = positions.shape(0);
  const py::gil_scoped_release release;
  for (py::ssize_t i = 0; i < count; ++i) {
    try {
      work(i, Eigen::Vector3d(p + 3 * i), Eigen::Vector3d(d + 3 * i));
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("view " + std::to_string(i) + ": " + error.what());
    }
  }
}

/// (N, 3) and (N, 3) to unit vectors (N, 3).
Array unitDirections(const Array& positions, const Array& directions) {
  checkViews(positions, directions);
  Array out({positions.shape(0), py::ssize_t{3}});
  double* unit = out.mutable_data();
  forEachView(positions, directions, [&](py::ssize_t i, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
    Eigen::Map<Eigen::Vector3d>(unit + 3 * i) = viewDirection(p, d);
  });
  return out;
}

/// (N, 3) and (N, 3) to points (N,) int64 and angles (N,).
py::tuple nearestSeeds(const SeedLookup& lookup, const Array& positions, const Array& directions) {
  checkViews(positions, directions);
  py::array_t<int64_t> points(positions.shape(0));
  Array angles(positions.shape(0));
  int64_t* point = points.mutable_data();
  double* angle = angles.mutable_data();
  forEachView(positions, directions, [&](py::ssize_t i, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
    const SeedLookup::Seed seed = lookup.nearest(p, d);
    point[i] = seed.point;
    angle[i] = seed.angle_rad;
  });
  return py::make_tuple(points, angles);
}

/// (N, 3) and (N, 3) to (N,) float32.
py::array_t<float> queryMany(const CapabilityQuery& query, const Array& positions, const Array& directions,
                             bool interpolate) {
  checkViews(positions, directions);
  py::array_t<float> out(positions.shape(0));
  float* values = out.mutable_data();
  forEachView(positions, directions, [&](py::ssize_t i, const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
    values[i] = interpolate ? query.interpolated(p, d) : query.nearest(p, d);
  });
  return out;
}

SeedLookup makeSeeds(const SphereGrid& grid, const Points& view_directions, std::vector<int32_t> row_of_cell,
                     std::vector<uint64_t> words) {
  return SeedLookup(grid, view_directions, bitsOf(view_directions, std::move(row_of_cell), std::move(words)));
}

}  // namespace

void bindQuery(py::module_& m) {
  py::class_<SeedLookup>(m, "SeedLookup", "Nearest stored points of views.")
      .def(py::init(&makeSeeds), py::arg("grid"), py::arg("view_directions"), py::arg("row_of_cell"),
           py::arg("words"), "As CapabilityQuery.")
      .def("nearest", &nearestSeeds, py::arg("positions"), py::arg("directions"),
           "Views (N, 3), (N, 3) to the number of the nearest valid point of their sphere (N,) int64, -1 "
           "where there "
           "is none, and the angle between both directions (N,) [rad]. ValueError as "
           "CapabilityQuery.query().");
  py::class_<CapabilityQuery>(m, "CapabilityQuery", "Answers from stored spheres.")
      .def(py::init(&makeQuery), py::arg("grid"), py::arg("view_directions"), py::arg("row_of_cell"),
           py::arg("words"), py::arg("wrist_m"), py::arg("shoulder"),
           "view_directions (N, 3) of the sphere points' z axes, row_of_cell (cells,) (-1: empty sphere), "
           "words "
           "(rows * ceil(N / 64),) uint64, the wrist's place behind the tip on its z axis [m], the shoulder "
           "(3,) "
           "[m].")
      .def_property_readonly("reach_rad", &CapabilityQuery::reachRad,
                             "How far blended directions lie from the one asked for [rad].")
      .def("query", &queryMany, py::arg("positions"), py::arg("directions"), py::arg("interpolate") = true,
           "Tip positions (N, 3) [m] and viewing directions (N, 3), base frame, to (N,) float32 in 0..1; 0 "
           "outside "
           "the map. ValueError names a view that is not finite or has no direction.");
  m.def("unit_directions", &unitDirections, py::arg("positions"), py::arg("directions"),
        "Viewing directions (N, 3) of any length but 0 as unit vectors (N, 3). ValueError as query().");
}

}  // namespace capability_map
